// The command itself: its output, its files, and how it rejects bad input.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>

#include "vip_slam_core/testing/analytic_motion.h"
#include "vip_slam_core/types/planes_yaml.h"
#include "vip_slam_eval/io/trajectory_source.h"

namespace vip_slam {
namespace {

namespace fs = std::filesystem;

class EvaluateCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              ("evaluate_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    const testing::AnalyticMotion motion(2);
    for (int k = 0; k <= 2000; ++k) truth_.push_back({100 + 0.01 * k, motion.stateAt(0.01 * k).T_W_I});
    for (std::size_t k = 0; k < truth_.size(); k += 5) {
      estimate_.push_back(truth_[k]);
      estimate_.back().T_W_B.t().z() += k % 10 ? 0.02 : -0.02;
    }
    writeTum(path("truth.tum"), truth_);
    writeTum(path("estimate.tum"), estimate_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  // Exit status; standard output and error in output_ and error_.
  int run(const std::string& arguments) {
    const std::string command =
        std::string(VIP_SLAM_EVALUATE) + " " + arguments + " >" + path("stdout") + " 2>" + path("stderr");
    const int status = std::system(command.c_str());
    output_ = text(path("stdout"));
    error_ = text(path("stderr"));
    return WEXITSTATUS(status);
  }
  static std::string text(const std::string& file) {
    std::ostringstream out;
    out << std::ifstream(file).rdbuf();
    return out.str();
  }
  // One line that names `what`, non-zero status, nothing left behind.
  void expectRefused(const std::string& arguments, const std::string& what) {
    EXPECT_NE(run(arguments + " --out " + path("out")), 0);
    EXPECT_NE(error_.find(what), std::string::npos) << error_;
    EXPECT_EQ(std::count(error_.begin(), error_.end(), '\n'), 1) << error_;
    EXPECT_FALSE(fs::exists(path("out")));
  }

  fs::path folder_;
  Trajectory truth_, estimate_;
  std::string output_, error_;
};

TEST_F(EvaluateCommand, CovarianceFileAddsTheNees) {
  const auto write = [this](double shift, const std::string& sigma2) {
    std::ofstream file(path("covariance.csv"));
    file << "t,xx,xy,xz,xa,xb,xc,yy,yz,ya,yb,yc,zz,za,zb,zc,aa,ab,ac,bb,bc,cc\n";
    for (const StampedPose& pose : estimate_) {
      char stamp[32];
      std::snprintf(stamp, sizeof stamp, "%.9f", pose.t + shift);
      file << stamp;
      for (int r = 0; r < 6; ++r) {
        for (int c = r; c < 6; ++c) file << ',' << (r == c ? sigma2 : "0");
      }
      file << '\n';
    }
  };
  const std::string input = "--truth " + path("truth.tum") + " --estimate " + path("estimate.tum") + " --covariance ";
  // The first pose is aligned with the truth, so the others are off by 0 and 4 cm alternately.
  write(0, "0.0004");
  ASSERT_EQ(run(input + path("covariance.csv") + " --out " + path("out")), 0) << error_;
  const std::string metrics = text(path("out") + "/metrics.csv");
  const auto at = metrics.find("position mean (honest: 3),");
  ASSERT_NE(at, std::string::npos) << metrics;
  EXPECT_NEAR(std::stod(metrics.substr(at + 26)), 0.5 * 0.04 * 0.04 / 0.0004, 0.02);
  fs::remove_all(path("out"));
  write(0.003, "0.0004");
  expectRefused(input + path("covariance.csv"), "covariance.csv:2: no pose of the estimate has this stamp");
  write(0, "nan");
  expectRefused(input + path("covariance.csv"), "covariance.csv:2: expected a stamp and 21 finite numbers");
}

TEST_F(EvaluateCommand, LeavesTableCsvAndPicture) {
  ASSERT_EQ(run("--truth " + path("truth.tum") + " --estimate " + path("estimate.tum") + " --out " + path("out")), 0)
      << error_;
  EXPECT_NE(output_.find("position rmse"), std::string::npos);
  const std::string metrics = text(path("out/metrics.csv"));
  EXPECT_NE(metrics.find("\"ATE, position and yaw aligned\",position rmse,0.01999"), std::string::npos) << metrics;
  const std::string errors = text(path("out/errors.csv"));
  EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), static_cast<long>(estimate_.size()) + 1);
  const std::string picture = text(path("out/evaluation.svg"));
  EXPECT_EQ(picture.compare(0, 4, "<svg"), 0);
  EXPECT_NE(picture.find("</svg>"), std::string::npos);
  for (const auto& entry : fs::directory_iterator(path("out"))) {
    EXPECT_EQ(entry.path().string().find("partial"), std::string::npos) << entry.path();
  }
}

TEST_F(EvaluateCommand, JudgesPlanesAndPoints) {
  PlaneEstimate floor;
  floor.id = 1;
  floor.kind = PlaneKind::kHorizontal;
  floor.polygons.push_back({{{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}}, {}});
  floor.area = 16;
  writePlanesYaml(path("planes.yaml"), {floor});
  std::ofstream(path("points.csv")) << "id,x,y,z,plane,keyframes\n1,0.5,0.5,0,1,4\n2,0.5,0.5,0.5,1,4\n";
  ASSERT_EQ(run("--truth " + path("truth.tum") + " --estimate " + path("truth.tum") + " --planes-truth " +
                path("planes.yaml") + " --planes " + path("planes.yaml") + " --points " + path("points.csv") +
                " --out " + path("out")),
            0)
      << error_;
  EXPECT_NE(text(path("out/metrics.csv")).find("planes,recall,100,%"), std::string::npos);
  EXPECT_NE(text(path("out/metrics.csv")).find("points on planes,precision,50,%"), std::string::npos);
  EXPECT_TRUE(fs::exists(path("out/planes.csv")));
}

TEST_F(EvaluateCommand, ReadsBagsWithCovariances) {
  {
    rosbag::Bag bag(path("run.bag"), rosbag::bagmode::Write);
    for (const StampedPose& pose : estimate_) {
      nav_msgs::Odometry odometry;
      odometry.header.stamp = ros::Time(pose.t);
      odometry.pose.pose.position.x = pose.T_W_B.t().x();
      odometry.pose.pose.position.y = pose.T_W_B.t().y();
      odometry.pose.pose.position.z = pose.T_W_B.t().z();
      odometry.pose.pose.orientation.x = pose.T_W_B.rotation().x();
      odometry.pose.pose.orientation.y = pose.T_W_B.rotation().y();
      odometry.pose.pose.orientation.z = pose.T_W_B.rotation().z();
      odometry.pose.pose.orientation.w = pose.T_W_B.rotation().w();
      for (int k = 0; k < 6; ++k) odometry.pose.covariance[7 * k] = 0.02 * 0.02;
      bag.write("/odometry", odometry.header.stamp, odometry);
    }
  }
  ASSERT_EQ(run("--truth " + path("truth.tum") + " --estimate " + path("run.bag")), 0) << error_;
  EXPECT_NE(output_.find("NEES"), std::string::npos);
  std::vector<PoseWithCovariance> covariances;
  const Trajectory read = readTrajectory(path("run.bag"), "/odometry", &covariances);
  EXPECT_EQ(read.size(), estimate_.size());
  EXPECT_EQ(covariances.size(), estimate_.size());
  EXPECT_LT(read[7].T_W_B.boxminus(estimate_[7].T_W_B).norm(), 1e-9);
  expectRefused("--truth " + path("truth.tum") + " --estimate " + path("run.bag") + " --estimate-topic /nothing",
                "/nothing");

  fs::resize_file(path("run.bag"), fs::file_size(path("run.bag")) / 2);
  expectRefused("--truth " + path("truth.tum") + " --estimate " + path("run.bag"), "run.bag");
}

TEST_F(EvaluateCommand, RefusesBadInputInOneLine) {
  const std::string truth = "--truth " + path("truth.tum");
  expectRefused(truth + " --estimate " + path("missing.tum"), "missing.tum");
  std::ofstream(path("bad.tum")) << "# t\n1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0\n";
  expectRefused(truth + " --estimate " + path("bad.tum"), "bad.tum:3:");
  std::ofstream(path("twice.tum")) << "2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n";
  expectRefused(truth + " --estimate " + path("twice.tum"), "twice.tum:2:");
  std::ofstream(path("empty.tum")) << "# nothing\n";
  expectRefused(truth + " --estimate " + path("empty.tum"), "empty.tum");
  std::ofstream(path("elsewhere.tum")) << "1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n";
  expectRefused(truth + " --estimate " + path("elsewhere.tum"), "time of the truth");
  expectRefused(truth + " --estimate " + path("estimate.tum") + " --align scale", "scale");
  expectRefused(truth + " --estimate " + path("estimate.tum") + " --max-gap -1", "max-gap");
  expectRefused(truth + " --estimate " + path("estimate.tum") + " --planes " + path("p.yaml"), "planes");
  expectRefused(truth, "--estimate");
}

}  // namespace
}  // namespace vip_slam
