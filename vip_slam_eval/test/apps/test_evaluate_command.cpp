// SPDX-License-Identifier: BSD-3-Clause
// The command itself: its output, its files, and how it rejects bad input.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <sstream>

#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>

#include "vip_slam_core/testing/analytic_motion.h"
#include "vip_slam_core/types/planes_yaml.h"
#include "vip_slam_eval/io/trajectory_source.h"
#include "vip_slam_eval/io/trajectory_text.h"

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

TEST_F(EvaluateCommand, AClockThatWasSetBackIsNamedAndTimeThatRepeatsLeftOut) {
  Trajectory set = estimate_;
  for (std::size_t k = 0; k < set.size(); ++k)
    if (set[k].t > 112) set[k].t -= 0.4;
  writeTum(path("set.tum"), set);
  ASSERT_EQ(run("--truth " + path("truth.tum") + " --estimate " + path("set.tum")), 0) << error_;
  EXPECT_NE(error_.find("does not follow"), std::string::npos) << error_;
  EXPECT_NE(error_.find("poses are left out"), std::string::npos) << error_;
  EXPECT_NE(output_.find("position rmse"), std::string::npos);
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

TEST_F(EvaluateCommand, ReadsEurocAndKittiTruth) {
  std::ofstream csv(path("data.csv")), kitti(path("poses.txt")), times(path("times.txt"));
  csv << "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n";
  for (const StampedPose& pose : truth_) {
    const Eigen::Vector3d& p = pose.T_W_B.t();
    const Eigen::Quaterniond& q = pose.T_W_B.rotation();
    csv << std::llround((pose.t + 1.4e9) * 1e9) << std::setprecision(12) << "," << p.x() << "," << p.y() << "," << p.z()
        << "," << q.w() << "," << q.x() << "," << q.y() << "," << q.z() << ",0,0,0\n";
    const Eigen::Matrix<double, 3, 4> T = pose.T_W_B.matrix().topRows<3>();
    kitti << std::setprecision(7);
    for (int k = 0; k < 12; ++k) kitti << (k ? " " : "") << T(k / 4, k % 4);
    kitti << "\n";
    times << std::setprecision(12) << pose.t << "\n";
  }
  csv.close(), kitti.close(), times.close();
  const std::string estimate = " --estimate " + path("estimate.tum");
  const std::string expected = "\"ATE, position and yaw aligned\",position rmse,0.01999";
  ASSERT_EQ(run("--truth " + path("data.csv") + estimate + " --time-offset 1.4e9 --out " + path("a")), 0) << error_;
  EXPECT_NE(text(path("a/metrics.csv")).find(expected), std::string::npos) << text(path("a/metrics.csv"));
  EXPECT_EQ(error_, "") << "the order is right";
  ASSERT_EQ(
      run("--truth " + path("poses.txt") + " --truth-times " + path("times.txt") + estimate + " --out " + path("b")), 0)
      << error_;
  EXPECT_NE(text(path("b/metrics.csv")).find(expected), std::string::npos) << text(path("b/metrics.csv"));
  EXPECT_EQ(error_, "");

  expectRefused("--truth " + path("poses.txt") + estimate, "poses.txt: KITTI poses have no stamps");
  expectRefused("--truth " + path("truth.tum") + " --truth-times " + path("times.txt") + estimate, "times.txt");
  std::ofstream(path("times.txt"), std::ios::app) << "1e6\n";
  expectRefused("--truth " + path("poses.txt") + " --truth-times " + path("times.txt") + estimate,
                "times.txt: 2002 stamps, expected 2001");
  std::ofstream(path("seven.txt")) << "# t\n1 0 0 0 0 0 0\n";
  expectRefused("--truth " + path("seven.txt") + estimate, "seven.txt:2: 7 numbers between blanks, expected 8");
  std::ofstream(path("short.csv")) << "1403636579763555584,0,0,0,1,0,0,0\n1403636579763555584,0,0,0,1,0,0,0\n";
  expectRefused("--truth " + path("short.csv") + estimate, "short.csv:2: the stamp");
  std::ofstream(path("skewed.txt")) << "1 0 0 0 0 1 0.5 0 0 0 1 0\n";
  std::ofstream(path("one.txt")) << "1\n";
  expectRefused("--truth " + path("skewed.txt") + " --truth-times " + path("one.txt") + estimate,
                "skewed.txt:1: its first three columns are no rotation");
}

TEST_F(EvaluateCommand, QuaternionsInTheOtherOrderAreReadSoAndNamed) {
  std::ofstream tum(path("w_first.tum")), csv(path("w_last.csv"));
  tum << std::setprecision(12), csv << std::setprecision(12);
  for (const StampedPose& pose : truth_) {
    const Eigen::Vector3d& p = pose.T_W_B.t();
    const Eigen::Quaterniond& q = pose.T_W_B.rotation();
    tum << pose.t << " " << p.transpose() << " " << q.w() << " " << q.x() << " " << q.y() << " " << q.z() << "\n";
    csv << pose.t << "," << p.x() << "," << p.y() << "," << p.z() << "," << q.x() << "," << q.y() << "," << q.z() << ","
        << q.w() << "\n";
  }
  tum.close(), csv.close();
  // The estimate's body is another one, turned against the truth's.
  Trajectory turned = estimate_;
  for (StampedPose& pose : turned)
    pose.T_W_B = pose.T_W_B * SE3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), Eigen::Vector3d::Zero());
  writeTum(path("turned.tum"), turned);
  for (const std::string estimate : {"estimate.tum", "turned.tum"}) {
    ASSERT_EQ(run("--truth " + path("w_first.tum") + " --estimate " + path(estimate)), 0) << error_;
    EXPECT_NE(error_.find("w_first.tum: quaternions are read as qw qx qy qz"), std::string::npos) << error_;
    ASSERT_EQ(run("--truth " + path("w_last.csv") + " --estimate " + path(estimate)), 0) << error_;
    EXPECT_NE(error_.find("w_last.csv: quaternions are read as qx qy qz qw"), std::string::npos) << error_;
    ASSERT_EQ(run("--truth " + path("truth.tum") + " --estimate " + path(estimate)), 0) << error_;
    EXPECT_EQ(error_, "");
  }
  const Trajectory read = rereadQuaternions(readTextTrajectory(path("w_first.tum")), true);
  const Trajectory last = rereadQuaternions(readTextTrajectory(path("w_last.csv")), false);
  ASSERT_EQ(read.size(), truth_.size());
  for (std::size_t k = 0; k < truth_.size(); k += 100) {
    EXPECT_LT(read[k].T_W_B.boxminus(truth_[k].T_W_B).norm(), 1e-9);
    EXPECT_LT(last[k].T_W_B.boxminus(truth_[k].T_W_B).norm(), 1e-9);
  }
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
