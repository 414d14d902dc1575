// SPDX-License-Identifier: BSD-3-Clause
// Bags and folders: data survive the round trip, no partial output stays; folders of real images.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>
#include <vector>

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <opencv2/imgcodecs.hpp>

#include "test_support.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_sim/io/rgbd_folder.h"
#include "vip_slam_sim/io/sequence_writer.h"

namespace vip_slam {
namespace {

namespace fs = std::filesystem;

/// A path in a temporary directory, which is removed when the program ends.
std::string scratch(const std::string& name) {
  struct Directory {
    fs::path path = fs::path(testing::TempDir()) / ("vip_slam_sim_io_" + std::to_string(getpid()));
    Directory() { fs::create_directories(path); }
    ~Directory() {
      std::error_code ignored;
      fs::remove_all(path, ignored);
    }
  };
  static const Directory directory;
  return (directory.path / name).string();
}

void writeAll(SequenceRenderer& s, SequenceWriter& writer) {
  std::size_t next = 0;
  const auto& imu = s.imu().samples;
  const auto until = [&](std::int64_t ns) {
    for (; next < imu.size() && s.toNanoseconds(imu[next].t) <= ns; ++next)
      writer.imu(s.toNanoseconds(imu[next].t), imu[next], s.stateAt(imu[next].t),
                 s.trajectory().at(imu[next].t).omega_I);
  };
  s.render([&](const SimFrame& f) {
    until(f.stamp_ns);
    writer.frame(f);
    return true;
  });
}

std::string bytesOf(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::stringstream all;
  all << in.rdbuf();
  return all.str();
}

TEST(Bag, HoldsADriversTopicsAndIsTheSameTwice) {
  const SequenceSpec spec = loadSequence("07", libraryPath());
  const std::string a = scratch("a.bag"), b = scratch("b.bag");
  std::vector<SimFrame> frames;
  for (const std::string& path : {a, b}) {
    SequenceRenderer s(spec, quickOptions(0, 4));
    const auto writer = makeBagWriter(path, s.sensor(), s.toNanoseconds(0));
    writeAll(s, *writer);
    EXPECT_FALSE(fs::exists(path));
    writer->commit();
    for (int i = 0; i < 4 && path == a; ++i) frames.push_back(s.renderFrame(i));
  }
  EXPECT_EQ(bytesOf(a), bytesOf(b));
  rosbag::Bag bag(a, rosbag::bagmode::Read);
  std::map<std::string, int> count;
  int image = 0;
  for (const rosbag::MessageInstance& m : rosbag::View(bag)) {
    ++count[m.getTopic()];
    if (const auto color = m.instantiate<sensor_msgs::Image>(); color && m.getTopic() == "/camera/color/image_raw") {
      const SimFrame& f = frames[image++];
      EXPECT_EQ(color->encoding, "rgb8");
      EXPECT_EQ(color->header.stamp.toNSec(), static_cast<std::uint64_t>(f.stamp_ns));
      EXPECT_EQ(0, std::memcmp(color->data.data(), f.rgb.data, color->data.size()));
      EXPECT_EQ(color->header.frame_id, "camera_color_optical_frame");
    }
    if (const auto imu = m.instantiate<sensor_msgs::Imu>()) {
      EXPECT_EQ(imu->orientation_covariance[0], -1);
    }
    if (const auto info = m.instantiate<sensor_msgs::CameraInfo>()) {
      EXPECT_EQ(info->distortion_model, "plumb_bob");
      EXPECT_DOUBLE_EQ(info->K[0], spec.camera.fx);
      EXPECT_DOUBLE_EQ(info->D[0], spec.camera.k1);
    }
  }
  for (const char* topic : {"/camera/color/image_raw", "/camera/aligned_depth_to_color/image_raw",
                            "/camera/color/camera_info", "/camera/aligned_depth_to_color/camera_info"})
    EXPECT_EQ(count[topic], 4) << topic;
  EXPECT_EQ(count["/tf_static"], 1);
  EXPECT_GT(count["/camera/imu"], 40);
  EXPECT_EQ(count["/camera/imu"], count["/ground_truth/odometry"]);
}

TEST(Bag, NothingIsLeftWithoutCommit) {
  const std::string path = scratch("never.bag");
  {
    SequenceRenderer s(loadSequence("smoke", libraryPath()), quickOptions(0, 1));
    const auto writer = makeBagWriter(path, s.sensor(), s.toNanoseconds(0));
    writeAll(s, *writer);
  }
  EXPECT_FALSE(fs::exists(path));
  for (const auto& entry : fs::directory_iterator(fs::path(path).parent_path()))
    EXPECT_NE(entry.path().filename().string().rfind("never", 0), 0u) << entry.path();
  EXPECT_THROW(makeBagWriter("/nowhere/at/all.bag", SensorConfig(), 0), std::runtime_error);
}

TEST(Folder, ReadsBackAsAnRgbdFolderAndKnowsUp) {
  const std::string path = scratch("folder");
  SequenceSpec spec = loadSequence("07", libraryPath());
  spec.camera.rate = 2;  // few images, but much to see
  SequenceRenderer s(spec, quickOptions(5, 33));
  std::vector<SimFrame> frames;
  {
    const auto writer = makeFolderWriter(path);
    s.render([&](const SimFrame& f) {
      writer->frame(f);
      frames.push_back(f);
      return true;
    });
    writer->commit();
  }
  EXPECT_THROW(makeFolderWriter(path), std::runtime_error);  // does not overwrite
  RgbdFolder folder = openRgbdFolder(path, 30);
  folder.camera = s.sensor().camera;
  ASSERT_EQ(folder.frames.size(), frames.size());
  cv::Mat rgb, depth;
  loadRgbdFrame(folder, folder.frames[3], &rgb, &depth);
  EXPECT_EQ(cv::norm(rgb, frames[3].rgb, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(depth, frames[3].depth, cv::NORM_INF), 0);
  // Up is found for any orientation of the folder's world.
  const SE3 turn(expQuaternion(Eigen::Vector3d(1.1, -0.7, 0.4)), Eigen::Vector3d(1, 2, 3));
  for (StampedPose& p : folder.T_W_C) p.T_W_B = turn * p.T_W_B;
  const Eigen::Vector3d up = upFromDepth(folder), want = turn.rotation() * Eigen::Vector3d::UnitZ();
  const double angle = std::acos(std::min(1.0, up.dot(want))) / kDegree;
  std::printf("  up found to %.3f deg\n", angle);
  EXPECT_LT(angle, 0.3);
  // A camera that is upside down half of the time does not determine up.
  for (std::size_t k = 0; k < folder.T_W_C.size(); k += 2) {
    SE3& T = folder.T_W_C[k].T_W_B;
    T = T * SE3(expQuaternion(Eigen::Vector3d(0, 0, M_PI)), Eigen::Vector3d::Zero());
  }
  try {
    upFromDepth(folder);
    ADD_FAILURE() << "must be refused";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("do not agree on which side is up; give --up"), std::string::npos) << e.what();
  }
}

TEST(Folder, SevenScenesHaveADepthCameraOfTheirOwn) {
  const std::string path = scratch("kinect");
  fs::create_directories(path);
  for (const std::string stem : {"/frame-000000", "/frame-000001"}) {
    cv::imwrite(path + stem + ".color.png", cv::Mat(480, 640, CV_8UC3, cv::Scalar(9, 9, 9)));
    cv::imwrite(path + stem + ".depth.png", cv::Mat(480, 640, CV_16UC1, cv::Scalar(1500)));
    std::ofstream(path + stem + ".pose.txt") << "0 -1 0 1\n1 0 0 2\n0 0 1 3\n0 0 0 1\n";
  }
  std::ofstream(path + "/camera-intrinsics.txt") << "585 0 320\n0 585 240\n0 0 1\n";
  const RgbdFolder folder = openRgbdFolder(path, 30);
  EXPECT_FALSE(folder.depth_registered);
  EXPECT_EQ(folder.depth_camera.fx, 585);
  EXPECT_NEAR(folder.camera.fx, 530, 5);
  EXPECT_GT(folder.colour_readout, 0.02);
  EXPECT_EQ(folder.depth_camera.width, 640);
  // The poses are the depth camera's: the colour camera is 25 mm to its right, along its own x axis, which is the
  // world's y here but for the degree by which the cameras are turned against each other.
  const SE3 T_W_D = folder.T_W_C.front().T_W_B * folder.T_color_depth;
  EXPECT_NEAR((T_W_D.t() - Eigen::Vector3d(1, 2, 3)).norm(), 0, 1e-12);
  EXPECT_NEAR((folder.T_W_C.front().T_W_B.t() - Eigen::Vector3d(1, 2.025, 3)).norm(), 0, 1e-3);

  const RgbdFolder registered = openRgbdFolder(path, 30, true);
  EXPECT_TRUE(registered.depth_registered);
  EXPECT_EQ(registered.camera.fx, 585);
  EXPECT_EQ(registered.colour_readout, 0);
  EXPECT_NEAR((registered.T_W_C.front().T_W_B.t() - Eigen::Vector3d(1, 2, 3)).norm(), 0, 1e-12);
}

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

TEST(Folder, EveryImageIsPairedOnceAndInOrder) {
  // The depth image at 0.03 is the nearest of two colour images.
  EXPECT_EQ(pairInOrder({0.00, 0.02, 0.038, 0.07}, {0.001, 0.03, 0.071}, 0.02), (Pairs{{0, 0}, {2, 1}, {3, 2}}));
  // With one more before it both have one, if not the nearest.
  EXPECT_EQ(pairInOrder({0.00, 0.02, 0.038, 0.07}, {0.001, 0.029, 0.03, 0.071}, 0.02),
            (Pairs{{0, 0}, {1, 1}, {2, 2}, {3, 3}}));
  // A lost depth image leaves one colour image alone and shifts no others.
  EXPECT_EQ(pairInOrder({0.0, 0.03, 0.06, 0.09}, {0.0, 0.06, 0.09}, 0.02), (Pairs{{0, 0}, {2, 1}, {3, 2}}));
  EXPECT_EQ(pairInOrder({0.0, 0.03}, {0.06}, 0.02), Pairs());
  EXPECT_EQ(pairInOrder({}, {0.06}, 0.02), Pairs());
}

TEST(Folder, DepthPastHalfAnIntervalStaysWithItsColour) {
  std::vector<double> colour, depth;
  Pairs own;
  for (std::size_t i = 0; i < 400; ++i) {
    colour.push_back(static_cast<double>(i) / 30);
    depth.push_back(colour.back() + 0.016 + 0.003 * std::sin(2.3 * static_cast<double>(i)));
    own.emplace_back(i, i);
  }
  EXPECT_EQ(pairInOrder(colour, depth, 0.02), own);
}

TEST(Folder, TumStampsAndDepthAreInWhateverUnitTheFilesHave) {
  const std::string path = scratch("units");
  fs::create_directories(path);
  cv::Mat depth(480, 640, CV_16UC1);
  for (int v = 0; v < depth.rows; ++v) depth.row(v).setTo(500 + 2 * v);  // millimetres
  cv::imwrite(path + "/d.png", depth);
  cv::imwrite(path + "/c.png", cv::Mat(480, 640, CV_8UC3, cv::Scalar(9, 9, 9)));
  std::ofstream(path + "/rgb.txt") << "1403636579763555584 c.png\n1403636579796555584 c.png\n";
  std::ofstream(path + "/depth.txt") << "1403636579763555584 d.png\n1403636579796555584 d.png\n";
  std::ofstream(path + "/groundtruth.txt") << "1403636579763555584 0 0 0 0 0 0 1\n1403636579796555584 0 0 0 0 0 0 1\n";
  RgbdFolder folder = openRgbdFolder(path, 30);
  ASSERT_EQ(folder.frames.size(), 2u);
  EXPECT_NEAR(folder.frames[1].t - folder.frames[0].t, 0.033, 1e-6);
  EXPECT_NEAR(folder.frames[1].t, 1403636579.796555584, 1e-6);
  EXPECT_NEAR(folder.T_W_C[1].t, 1403636579.796555584, 1e-6);
  EXPECT_DOUBLE_EQ(folder.depth_scale, 0.001);
  ASSERT_TRUE(folder.depth_guess);
  cv::Mat rgb, read;
  loadRgbdFrame(folder, folder.frames[0], &rgb, &read);
  EXPECT_EQ(cv::norm(depth, read, cv::NORM_INF), 0);
  folder = openRgbdFolder(path, 30, false, 2500);
  EXPECT_DOUBLE_EQ(folder.depth_scale, 1.0 / 2500);
  EXPECT_FALSE(folder.depth_guess);
}

TEST(Folder, ErrorsNameTheFile) {
  const auto messageOf = [](const std::string& folder) -> std::string {
    try {
      openRgbdFolder(folder, 30);
    } catch (const std::exception& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(messageOf("/nowhere").find("/nowhere"), std::string::npos);
  const std::string path = scratch("tum");
  fs::create_directories(path);
  std::ofstream(path + "/rgb.txt") << "1.0 a.png\n0.9 b.png\n";
  std::ofstream(path + "/depth.txt") << "1.0 a.png\n";
  std::ofstream(path + "/groundtruth.txt") << "1.0 0 0 0 0 0 0 1\n2.0 0 0 0 0 0 0 1\n";
  EXPECT_NE(messageOf(path).find("rgb.txt:2"), std::string::npos) << messageOf(path);
  const std::string seven = scratch("seven");
  fs::create_directories(seven);
  std::ofstream(seven + "/frame-000000.color.png") << "x";
  EXPECT_NE(messageOf(seven).find("frame-000000.depth.png"), std::string::npos) << messageOf(seven);
  std::ofstream(seven + "/frame-000000.depth.png") << "x";
  std::ofstream(seven + "/frame-000000.pose.txt") << "1 0 0 0\n0 1 0 abc\n0 0 1 0\n0 0 0 1\n";
  EXPECT_NE(messageOf(seven).find("frame-000000.pose.txt:2: 'abc', expected a number"), std::string::npos)
      << messageOf(seven);
}

}  // namespace
}  // namespace vip_slam
