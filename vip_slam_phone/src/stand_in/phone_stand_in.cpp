// SPDX-License-Identifier: BSD-3-Clause
// Plays a rendered bag as a phone with the app would, on the loopback interface only: for tests and for trying the
// system without a phone. The clock is a day ahead and drifts, the focus breathes, the exposure changes, RTP and
// sequence numbers wrap. Images of the bag are stamped at mid-exposure.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <iostream>
#include <thread>

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <zlib.h>
#include <boost/program_options.hpp>
#include <opencv2/imgproc.hpp>

#include "rtsp_server.h"
#include "video_encoder.h"
#include "vip_slam_core/camera/constant_camera.h"
#include "vip_slam_core/sensor/phone_geometry.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_ros/bag_files.h"
#include "vip_slam_ros/image_decoding.h"

namespace vip_slam::phone {
namespace {

constexpr double kGravity = 9.80665, kDay = 86400, kDrift = 20e-6;
constexpr double kSettled = 3;  // s, until a receiver has found the clock

std::atomic<bool> stop{false};

template <typename T>
void put(std::vector<std::uint8_t>* bytes, std::size_t at, T value) {
  std::memcpy(bytes->data() + at, &value, sizeof(T));
}

std::vector<std::uint8_t> withLength(const std::string& json) {
  std::vector<std::uint8_t> out(4);
  put(&out, 0, static_cast<std::uint32_t>(json.size()));
  out.insert(out.end(), json.begin(), json.end());
  return out;
}

bool greetBy(int client, const std::string& json) {
  const auto bytes = withLength(json);
  return sendAll(client, bytes.data(), bytes.size());
}

/// Half floats, DEFLATE.
std::vector<std::uint8_t> depthMessage(const cv::Mat& metres, std::uint16_t sequence, double host, double unix_time) {
  cv::Mat halves;
  cv::convertFp16(metres, halves);
  std::vector<std::uint8_t> out(36 + halves.total() * 2 + 1024, 0);
  z_stream z{};
  deflateInit2(&z, 1, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
  z.next_in = halves.data;
  z.avail_in = static_cast<uInt>(halves.total() * 2);
  z.next_out = out.data() + 36;
  z.avail_out = static_cast<uInt>(out.size() - 36);
  deflate(&z, Z_FINISH);
  out.resize(36 + z.total_out);
  deflateEnd(&z);
  put(&out, 0, static_cast<std::uint32_t>(out.size() - 4));
  out[4] = 10;
  out[5] = 3;
  put(&out, 6, sequence);
  put(&out, 12, host);
  put(&out, 20, unix_time);
  put(&out, 28, static_cast<std::uint16_t>(metres.cols));
  put(&out, 30, static_cast<std::uint16_t>(metres.rows));
  out[32] = 2;
  out[33] = 2;
  return out;
}

double wallTime() { return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count(); }

struct Options {
  std::string bag, sensor, coding = "h264";
  int rtsp_port = 8554, record_port = 8555, depth_port = 8556;
  double mbit = 8, breathing = 0.03, reconnect = 0, wait = 0;
  int piece = 0, lose = 0;

  Codec codec() const { return coding == "hevc" ? Codec::kHevc : Codec::kH264; }
};

class StandIn {
 public:
  explicit StandIn(const Options& options)
      : options_(options),
        sensor_(loadSensorConfig(options.sensor)),
        rtsp_(options.rtsp_port, options.codec()),
        records_(options.record_port,
                 [](int client) {
                   return greetBy(client, R"({"protocol":"irtsp-imu","version":2,"revision":6,"endianness":"little",)"
                                          R"("record_bytes":64,"streams":{"imu":true,"intrinsics":true,"pose":true}})");
                 }),
        depth_(options.depth_port, [](int client) {
          return greetBy(client, R"({"protocol":"irtsp-depth","version":2,"compression":{"supported":["zlib"]}})");
        }) {
    if (sensor_.camera.model != DistortionModel::kNone)
      throw std::runtime_error(options.sensor + ": the lens has distortion, a phone's images have none");
    R_phone_imu_ = phoneCameraInImu().R() * sensor_.T_imu_cam.R().transpose();
  }

  void play() {
    rosbag::Bag bag;
    openBag(options_.bag, &bag);
    rosbag::View view(bag, rosbag::TopicQuery({sensor_.topics.color, sensor_.topics.depth, sensor_.topics.imu}));
    if (view.size() == 0) throw std::runtime_error(options_.bag + ": none of the topics of " + options_.sensor);
    first_ = view.getBeginTime().toSec();
    begin_ = wallTime() + options_.wait;
    std::cout << "begin " << std::fixed << begin_ - first_ << " s after the bag's clock" << std::endl;
    double next_break = options_.reconnect;
    for (const rosbag::MessageInstance& message : view) {
      const double t = message.getTime().toSec() - first_;
      while (!stop && wallTime() < begin_ + t) {
        const double rest = begin_ + t - wallTime();
        std::this_thread::sleep_for(std::chrono::duration<double>(std::min(0.05, std::max(1e-4, rest))));
      }
      if (stop) return;
      if (options_.reconnect > 0 && t > next_break) {
        next_break += options_.reconnect;
        rtsp_.disconnect();
        records_.disconnect();
        depth_.disconnect();
      }
      if (const auto imu = message.instantiate<sensor_msgs::Imu>()) {
        sendImu(*imu);
      } else if (const auto image = message.instantiate<sensor_msgs::Image>()) {
        message.getTopic() == sensor_.topics.color ? sendColor(*image) : sendDepth(*image);
      }
    }
    // The last of it is still under way.
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    std::cout << "sent " << images_ << " images, " << depths_ << " depth images, " << imus_ << " IMU samples\n";
    // What of a latency is not the receiver's: coding, and waiting for a core.
    std::sort(ages_.begin(), ages_.end());
    if (!ages_.empty())
      std::cout << formatted("images had left, after mid-exposure: median %.1f ms, 99 %% within %.1f ms",
                             1e3 * ages_[ages_.size() / 2], 1e3 * ages_[ages_.size() * 99 / 100])
                << std::endl;
  }

 private:
  /// The phone's clock at a stamp of the bag, and what it takes for the time of day.
  double host(double stamp) const { return 5000 + (stamp - first_) * (1 + kDrift); }
  double unixOf(double stamp) const { return host(stamp) - 5000 + begin_ + kDay; }
  double exposure(double t) const { return 0.006 + 0.003 * std::sin(0.9 * t); }
  CameraIntrinsics camera(double t) const {
    CameraIntrinsics camera = sensor_.camera;
    const double ratio = 1 + options_.breathing * std::sin(0.7 * t);
    camera.fx *= ratio;
    camera.fy *= ratio;
    return camera;
  }

  std::vector<std::uint8_t> record(std::uint8_t type, double host_time, double unix_time) {
    std::vector<std::uint8_t> out(64, 0);
    out[0] = type;
    put(&out, 2, sequence_++);
    put(&out, 8, host_time);
    put(&out, 16, unix_time);
    return out;
  }

  void sendImu(const sensor_msgs::Imu& imu) {
    const auto& g = imu.angular_velocity;
    const auto& a = imu.linear_acceleration;
    const Eigen::Vector3f gyro = (R_phone_imu_ * Eigen::Vector3d(g.x, g.y, g.z)).cast<float>();
    const Eigen::Vector3f accel = (R_phone_imu_ * Eigen::Vector3d(a.x, a.y, a.z) / -kGravity).cast<float>();
    auto out = record(1, host(imu.header.stamp.toSec()), unixOf(imu.header.stamp.toSec()));
    std::memcpy(out.data() + 24, gyro.data(), 12);
    std::memcpy(out.data() + 36, accel.data(), 12);
    records_.send(out, options_.piece);
    ++imus_;
  }

  void sendColor(const sensor_msgs::Image& message) {
    const double t = message.header.stamp.toSec() - first_, end = message.header.stamp.toSec() + 0.5 * exposure(t);
    const cv::Mat stored(static_cast<int>(message.height), static_cast<int>(message.width),
                         message.encoding == "mono8" ? CV_8UC1 : CV_8UC3,
                         const_cast<std::uint8_t*>(message.data.data()), message.step);
    cv::Mat bgr = stored;
    if (message.encoding == "mono8") cv::cvtColor(stored, bgr, cv::COLOR_GRAY2BGR);
    if (message.encoding == "rgb8") cv::cvtColor(stored, bgr, cv::COLOR_RGB2BGR);
    const CameraIntrinsics own = camera(t);
    const cv::Mat seen = warpColor(bgr, sensor_.camera, own);
    if (!encoder_)
      encoder_ = std::make_unique<VideoEncoder>(options_.codec(), seen.size(),
                                                static_cast<int>(std::lround(sensor_.color_rate)),
                                                static_cast<int>(1e6 * options_.mbit));
    auto out = record(5, host(end), unixOf(end));
    const float k[6] = {float(own.fx), float(own.fy),    float(own.cx),
                        float(own.cy), float(own.width), float(own.height)};
    std::memcpy(out.data() + 24, k, sizeof(k));
    put(&out, 60, static_cast<std::uint32_t>(std::lround(1e6 * exposure(t))));
    records_.send(out, options_.piece);
    ++images_;
    rtsp_.send(encoder_->encode(seen), unixOf(end), options_.piece, options_.lose > 0 && images_ % options_.lose == 0);
    if (t > kSettled) ages_.push_back(wallTime() - begin_ - t);
  }

  void sendDepth(const sensor_msgs::Image& message) {
    const double t = message.header.stamp.toSec() - first_, end = message.header.stamp.toSec() + 0.5 * exposure(t);
    const cv::Mat metres = decodeDepth(message, sensor_.depth_scale);
    const CameraIntrinsics own = camera(t).scaled(256, 256 * metres.rows / metres.cols);
    depth_.send(depthMessage(warpDepth(metres, sensor_.camera, own), depth_sequence_++, host(end), unixOf(end)),
                options_.piece);
    ++depths_;
  }

  Options options_;
  SensorConfig sensor_;
  RtspServer rtsp_;
  Port records_, depth_;
  Eigen::Matrix3d R_phone_imu_;
  std::unique_ptr<VideoEncoder> encoder_;
  double begin_ = 0, first_ = 0;  ///< s: of playing, by this clock; of the bag, by its own
  std::uint16_t sequence_ = 65000, depth_sequence_ = 65500;
  std::size_t images_ = 0, depths_ = 0, imus_ = 0;
  std::vector<double> ages_;  ///< of images, s from mid-exposure until they had left
};

}  // namespace
}  // namespace vip_slam::phone

int main(int argc, char** argv) {
  namespace po = boost::program_options;
  vip_slam::phone::Options options;
  po::options_description described("phone_stand_in BAG --sensor YAML [options]");
  // clang-format off
  described.add_options()
    ("help", "this text")
    ("bag", po::value(&options.bag), "rendered bag, also as the first argument")
    ("sensor", po::value(&options.sensor), "its sensor file")
    ("rtsp-port", po::value(&options.rtsp_port)->default_value(options.rtsp_port), "video")
    ("record-port", po::value(&options.record_port)->default_value(options.record_port), "IMU and intrinsics")
    ("depth-port", po::value(&options.depth_port)->default_value(options.depth_port), "depth")
    ("mbit", po::value(&options.mbit)->default_value(options.mbit), "of the video, Mbit/s")
    ("codec", po::value(&options.coding)->default_value(options.coding), "of the video: h264 or hevc")
    ("breathing", po::value(&options.breathing)->default_value(options.breathing), "of the focal length")
    ("wait", po::value(&options.wait)->default_value(options.wait), "s before it plays")
    ("reconnect", po::value(&options.reconnect)->default_value(options.reconnect), "s after which connections break")
    ("piece", po::value(&options.piece)->default_value(options.piece), "longest write, bytes; 0: any")
    ("lose", po::value(&options.lose)->default_value(options.lose), "a packet of every so many images is lost; 0: none");
  // clang-format on
  po::positional_options_description positional;
  positional.add("bag", 1);
  try {
    po::variables_map values;
    po::store(po::command_line_parser(argc, argv).options(described).positional(positional).run(), values);
    po::notify(values);
    if (values.count("help")) {
      std::cout << described;
      return 0;
    }
    if (options.coding != "h264" && options.coding != "hevc")
      throw po::error("--codec " + options.coding + ": expected h264 or hevc");
    if (!vip_slam::phone::VideoEncoder::available(options.codec()))
      throw po::error("--codec " + options.coding + ": libavcodec has no encoder for it");
    if (options.bag.empty() || options.sensor.empty()) throw po::error("a bag and --sensor are needed");
  } catch (const po::error& e) {
    std::cerr << e.what() << "\n";
    return 2;
  }
  std::signal(SIGINT, [](int) { vip_slam::phone::stop = true; });
  std::signal(SIGTERM, [](int) { vip_slam::phone::stop = true; });
  try {
    vip_slam::phone::StandIn(options).play();
  } catch (const std::exception& e) {
    std::cerr << e.what() << "\n";
    return 1;
  }
}
