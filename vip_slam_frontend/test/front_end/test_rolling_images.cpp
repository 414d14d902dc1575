// SPDX-License-Identifier: BSD-3-Clause
// Rolling-shutter images and depth, and depth taken at another time than colour, while the body turns and sways in
// front of a textured corner.
#include <cmath>

#include <gtest/gtest.h>

#include "corner_world.h"
#include "vip_slam_frontend/front_end.h"

namespace vip_slam {
namespace {

constexpr double kReadout = 0.03;

/// RMS position error over five seconds of motion, metres. `see`: fills the images at time t. `depth_delay`: as found.
template <class See>
double errorOf(const SensorConfig& sensor, double depth_lag, const See& see, bool find_delay = true,
               double* depth_delay = nullptr) {
  const CornerWorld world;
  FrontEndOptions options = cornerOptions();
  options.filter.calibration.depth_delay = find_delay;
  FrontEnd front_end(options, sensor);
  double imu_t = 0, square = 0;
  int n = 0;
  for (int k = 0; k < 125; ++k) {
    FrameInput input;
    input.t = 0.05 * k;
    input.depth_lag = depth_lag;
    for (; !front_end.ready(input.t, depth_lag); imu_t += 0.005) front_end.addImu(CornerWorld::imu(imu_t));
    see(world, &input);
    const FrameOutput output = front_end.process(input);
    if (input.t < kStill + 0.05) continue;
    square += (output.frame->state.T_W_I.t() - CornerWorld::pose(input.t).t()).squaredNorm();
    ++n;
  }
  if (depth_delay) *depth_delay = front_end.calibration().depth_delay;
  return std::sqrt(square / n);
}

/// Rolling-shutter colour, depth likewise or global. `..._told`: readout times configured for the sensor.
double errorOfRows(double colour_told, double depth_told, bool depth_rolls) {
  return errorOf(cornerSensor(colour_told, depth_told), 0, [&](const CornerWorld& world, FrameInput* input) {
    world.look(input->t, kReadout, &input->gray, &input->depth);
    cv::Mat not_used;
    if (!depth_rolls) world.look(input->t, 0, &not_used, &input->depth);
  });
}

/// Global-shutter colour, depth taken `lag` later. `told`: the lag by the stamps.
double errorWithLag(double lag, double told, const SensorConfig& sensor, bool find_delay = true,
                    double* depth_delay = nullptr) {
  const auto see = [&](const CornerWorld& world, FrameInput* input) {
    cv::Mat not_used;
    world.look(input->t, 0, &input->gray, &not_used);
    world.look(input->t + lag, sensor.depth_rolling_shutter, &not_used, &input->depth);
  };
  return errorOf(sensor, told, see, find_delay, depth_delay);
}

TEST(RollingImages, RowsAreTakenForWhatTheyAre) {
  const double told = errorOfRows(kReadout, kReadout, true), not_told = errorOfRows(0, 0, true);
  EXPECT_LT(told, 0.003);
  EXPECT_GT(not_told, 4 * told);
}

TEST(RollingImages, DepthOfOneInstantBelongsToTheStamp) {
  const double told = errorOfRows(kReadout, 0, false), taken_for_rolling = errorOfRows(kReadout, kReadout, false);
  EXPECT_LT(told, 0.003);
  EXPECT_GT(taken_for_rolling, 2 * told);
}

TEST(LaggingDepth, IsCarriedOverToTheStampOfColour) {
  for (const double lag : {-0.015, 0.015}) {
    const double told = errorWithLag(lag, lag, cornerSensor(0, 0));
    EXPECT_LT(told, 0.003) << lag;
    EXPECT_GT(errorWithLag(lag, 0, cornerSensor(0, 0), false), 3 * told) << lag;
    SensorConfig sensor = cornerSensor(0, 0);
    sensor.depth_delay = -lag;
    EXPECT_LT(errorWithLag(lag, 0, sensor, false), 0.003) << lag;
  }
}

TEST(LaggingDepth, IsFoundWhereStampsDoNotTellIt) {
  for (const double lag : {-0.025, 0.0}) {
    double found = 1;
    const double learnt = errorWithLag(lag, 0, cornerSensor(0, 0), true, &found);
    EXPECT_NEAR(found, -lag, 0.003);
    EXPECT_EQ(found == 0, lag == 0);
    if (lag != 0) EXPECT_LT(learnt, 0.5 * errorWithLag(lag, 0, cornerSensor(0, 0), false));
  }
}

TEST(LaggingDepth, RowsOfALaterDepthImage) { EXPECT_LT(errorWithLag(0.012, 0.012, cornerSensor(0, kReadout)), 0.003); }

}  // namespace
}  // namespace vip_slam
