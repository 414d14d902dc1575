// SPDX-License-Identifier: BSD-3-Clause
// Nothing is detected in the masked area (the robot's own bumper): no features, no depth, no corners.
#include <gtest/gtest.h>

#include "corner_world.h"
#include "vip_slam_frontend/front_end.h"

namespace vip_slam {
namespace {

constexpr int kBumper = 180;  // the image's rows from here on show it
constexpr float kBumperDepth = 0.45f;

SensorConfig masked() {
  SensorConfig config = cornerSensor(0, 0);
  config.mask = cv::Mat(240, 320, CV_8U, cv::Scalar(255));
  config.mask.rowRange(kBumper, 240) = 0;
  config.mask_file = "bumper.png";
  return config;
}

struct Drive {
  std::size_t on_bumper = 0, corners_on_bumper = 0, depth_on_bumper = 0;  ///< features, keyframes' corners, grid points
  std::size_t near_bumper = 0;  ///< features so close that their patch would reach over it
  std::size_t features = 0, keyframes = 0;
  double error = 0;  ///< m, largest
};

/// A chequered board that moves with the camera, in front of the corner of a room.
Drive drive(const SensorConfig& sensor) {
  const CornerWorld world;
  FrontEndOptions options = cornerOptions();
  options.tracking.keyframe_corners = 100;
  FrontEnd front_end(options, sensor);
  Drive run;
  double imu_t = 0;
  for (int k = 0; k < 120; ++k) {
    const double t = 0.05 * k;
    for (; imu_t < t + 0.03; imu_t += 0.005) front_end.addImu(CornerWorld::imu(imu_t));
    FrameInput input;
    input.t = t;
    world.look(t, 0, &input.gray, &input.depth);
    for (int v = kBumper; v < 240; ++v) {
      for (int u = 0; u < 320; ++u) {
        input.gray.at<std::uint8_t>(v, u) = (u / 14 + v / 12) % 2 ? 190 : 60;
        input.depth.at<float>(v, u) = kBumperDepth;
      }
    }
    const FrameOutput output = front_end.process(input);
    EXPECT_EQ(input.depth.at<float>(239, 160), kBumperDepth);  // the caller's image is unchanged
    const auto gridPoints = [](const DepthGrid& grid) {
      std::size_t points = 0;
      for (int v = 0; v < grid.rows; ++v) {
        for (int u = 0; u < grid.cols; ++u)
          points += grid.pixel(u, v).y() >= kBumper && grid.z[static_cast<std::size_t>(v) * grid.cols + u] > 0;
      }
      return points;
    };
    for (const Feature& f : output.frame->features) {
      run.on_bumper += f.pixel.y() >= kBumper;
      run.near_bumper += f.pixel.y() >= kBumper - 6 && f.pixel.y() < kBumper;
    }
    run.features += output.frame->features.size();
    run.depth_on_bumper += gridPoints(output.frame->depth_grid);
    if (output.keyframe) {
      ++run.keyframes;
      for (const Feature& f : output.keyframe->frame.features) run.corners_on_bumper += f.pixel.y() >= kBumper;
      run.depth_on_bumper += gridPoints(output.keyframe->frame.depth_grid);
    }
    if (t > kStill) {
      run.error = std::max(run.error, (output.frame->state.T_W_I.t() - CornerWorld::pose(t).t()).norm());
    }
  }
  return run;
}

TEST(Mask, NothingIsSeenThere) {
  const Drive with = drive(masked());
  EXPECT_EQ(with.on_bumper, 0u);
  EXPECT_EQ(with.near_bumper, 0u);
  EXPECT_EQ(with.corners_on_bumper, 0u);
  EXPECT_EQ(with.depth_on_bumper, 0u);
  EXPECT_GT(with.features, 120u * 40u);
  EXPECT_GT(with.keyframes, 2u);
  EXPECT_LT(with.error, 0.02);

  const Drive without = drive(cornerSensor(0, 0));  // the reference without bumper
  EXPECT_GT(without.on_bumper, 100u);
  EXPECT_GT(without.corners_on_bumper, 10u);
  EXPECT_GT(without.depth_on_bumper, 100u);
}

TEST(Mask, WhiteAllOverChangesNothing) {
  SensorConfig white = cornerSensor(0, 0);
  white.mask = cv::Mat(240, 320, CV_8U, cv::Scalar(255));
  const Drive with = drive(white), without = drive(cornerSensor(0, 0));
  EXPECT_EQ(with.features, without.features);
  EXPECT_EQ(with.on_bumper, without.on_bumper);
  EXPECT_EQ(with.depth_on_bumper, without.depth_on_bumper);
  EXPECT_EQ(with.error, without.error);
}

TEST(Mask, MustBeAsLargeAsTheImage) {
  SensorConfig wrong = masked();
  wrong.mask = cv::Mat(480, 640, CV_8U, cv::Scalar(255));
  try {
    FrontEnd front_end(cornerOptions(), wrong);
    ADD_FAILURE() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("mask: bumper.png is 640x480, the colour image is 320x240"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace vip_slam
