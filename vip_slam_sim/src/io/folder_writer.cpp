// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "vip_slam_sim/io/sequence_writer.h"

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

namespace fs = std::filesystem;

std::string secondsText(std::int64_t ns) {
  return formatted("%lld.%09lld", static_cast<long long>(ns / 1000000000LL), static_cast<long long>(ns % 1000000000LL));
}

class FolderWriter : public SequenceWriter {
 public:
  explicit FolderWriter(const std::string& folder) : target_(folder), work_(folder + ".part") {
    if (fs::exists(target_)) throw std::runtime_error(target_.string() + ": exists already");
    fs::remove_all(work_);
    for (const char* sub : {"rgb", "depth", "imu0", "state_groundtruth_estimate0"}) fs::create_directories(work_ / sub);
    open(imu_, "imu0/data.csv",
         "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],"
         "a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]");
    open(truth_, "state_groundtruth_estimate0/data.csv",
         "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z [],"
         "v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],b_w_RS_S_x [rad s^-1],b_w_RS_S_y [rad s^-1],"
         "b_w_RS_S_z [rad s^-1],b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],b_a_RS_S_z [m s^-2]");
    open(rgb_, "rgb.txt", "# timestamp filename");
    open(depth_, "depth.txt", "# timestamp filename (16-bit, 5000 per metre as in TUM RGB-D)");
    open(poses_, "groundtruth.txt", "# colour camera in world: timestamp tx ty tz qx qy qz qw");
    open(both_, "associations.txt", "# rgb_timestamp rgb_file depth_timestamp depth_file");
  }
  ~FolderWriter() override {
    std::error_code ignored;
    if (!committed_) fs::remove_all(work_, ignored);
  }

  void imu(std::int64_t ns, const ImuSample& s, const NavState& x, const Eigen::Vector3d&) override {
    const auto list = [](std::ofstream& out, const Eigen::Vector3d& v) {
      out << ',' << v.x() << ',' << v.y() << ',' << v.z();
    };
    imu_ << ns;
    list(imu_, s.gyro);
    list(imu_, s.accel);
    imu_ << '\n';
    truth_ << ns;
    list(truth_, x.T_W_I.t());
    const Eigen::Quaterniond& q = x.T_W_I.rotation();
    truth_ << ',' << q.w() << ',' << q.x() << ',' << q.y() << ',' << q.z();
    list(truth_, x.v_W);
    list(truth_, x.bias_gyro);
    list(truth_, x.bias_accel);
    truth_ << '\n';
  }

  void frame(const SimFrame& f) override {
    const std::string stamp = secondsText(f.stamp_ns);
    const std::string depth_stamp = secondsText(f.depth_stamp_ns);
    const std::string rgb = "rgb/" + stamp + ".png", depth = "depth/" + depth_stamp + ".png";
    cv::Mat bgr;
    cv::cvtColor(f.rgb, bgr, cv::COLOR_RGB2BGR);
    cv::Mat fifth_millimetres;
    f.depth.convertTo(fifth_millimetres, CV_16U, 5.0);
    fifth_millimetres.setTo(0, f.depth > 13000);
    const std::vector<int> quick = {cv::IMWRITE_PNG_COMPRESSION, 1};
    for (const auto& [name, image] : {std::pair<std::string, cv::Mat>{rgb, bgr}, {depth, fifth_millimetres}})
      if (!cv::imwrite((work_ / name).string(), image, quick))
        throw std::runtime_error((work_ / name).string() + ": cannot be written");
    rgb_ << stamp << ' ' << rgb << '\n';
    depth_ << depth_stamp << ' ' << depth << '\n';
    both_ << stamp << ' ' << rgb << ' ' << depth_stamp << ' ' << depth << '\n';
    const Eigen::Vector3d& t = f.T_W_C.t();
    const Eigen::Quaterniond& q = f.T_W_C.rotation();
    poses_ << stamp << ' ' << t.x() << ' ' << t.y() << ' ' << t.z() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z()
           << ' ' << q.w() << '\n';
  }

  void commit() override {
    for (const auto& [out, name] : lists_) {
      out->close();
      if (!*out) throw std::runtime_error((work_ / name).string() + ": cannot be written");
    }
    fs::rename(work_, target_);
    committed_ = true;
  }

 private:
  void open(std::ofstream& out, const char* name, const char* header) {
    out.open(work_ / name);
    if (!out) throw std::runtime_error((work_ / name).string() + ": cannot be written");
    out << header << '\n' << std::setprecision(12);
    lists_.emplace_back(&out, name);
  }

  fs::path target_, work_;
  std::ofstream imu_, truth_, rgb_, depth_, both_, poses_;
  std::vector<std::pair<std::ofstream*, std::string>> lists_;  ///< all of them, with their names in the folder
  bool committed_ = false;
};

}  // namespace

std::unique_ptr<SequenceWriter> makeFolderWriter(const std::string& folder) {
  return std::make_unique<FolderWriter>(folder);
}

}  // namespace vip_slam
