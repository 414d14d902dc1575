// Images and depth whose rows are read one after the other, and depth that is taken at another time than colour, while
// the body turns and sways before a textured corner.
#include <cmath>

#include <gtest/gtest.h>

#include "corner_world.h"
#include "vip_slam_frontend/front_end.h"

namespace vip_slam {
namespace {

constexpr double kReadout = 0.03;

/// Root mean square of the position's error over five seconds of motion, metres. `told`: the sensor's readouts.
double errorOf(double colour_told, double depth_told, bool depth_rolls) {
  const CornerWorld world;
  FrontEnd front_end(cornerOptions(), cornerSensor(colour_told, depth_told));
  double imu_t = 0, square = 0;
  int n = 0;
  for (int k = 0; k < 125; ++k) {
    const double t = 0.05 * k;
    for (; imu_t < t + 0.03; imu_t += 0.005) front_end.addImu(CornerWorld::imu(imu_t));
    FrameInput input;
    input.t = t;
    cv::Mat instant, not_used;
    world.look(t, kReadout, &input.gray, &input.depth);
    if (!depth_rolls) {
      world.look(t, 0, &not_used, &instant);
      input.depth = instant;
    }
    const FrameOutput output = front_end.process(input);
    if (t < kStill + 0.05) continue;
    square += (output.frame->state.T_W_I.t() - CornerWorld::pose(t).t()).squaredNorm();
    ++n;
  }
  return std::sqrt(square / n);
}

TEST(RollingImages, RowsAreTakenForWhatTheyAre) {
  const double told = errorOf(kReadout, kReadout, true), not_told = errorOf(0, 0, true);
  EXPECT_LT(told, 0.003);
  EXPECT_GT(not_told, 4 * told);
}

TEST(RollingImages, DepthOfOneInstantBelongsToTheStamp) {
  const double told = errorOf(kReadout, 0, false), taken_for_rolling = errorOf(kReadout, kReadout, false);
  EXPECT_LT(told, 0.003);
  EXPECT_GT(taken_for_rolling, 2 * told);
}

/// The same with colour of one instant and depth that is taken `lag` later. `told`: what the front end hears of it.
double errorWithLag(double lag, double told, double depth_readout) {
  const CornerWorld world;
  FrontEnd front_end(cornerOptions(), cornerSensor(0, depth_readout));
  double imu_t = 0, square = 0;
  int n = 0;
  for (int k = 0; k < 125; ++k) {
    const double t = 0.05 * k;
    FrameInput input;
    input.t = t;
    input.depth_lag = told;
    for (; !front_end.ready(t, told); imu_t += 0.005) front_end.addImu(CornerWorld::imu(imu_t));
    cv::Mat not_used;
    world.look(t, 0, &input.gray, &not_used);
    world.look(t + lag, depth_readout, &not_used, &input.depth);
    const FrameOutput output = front_end.process(input);
    if (t < kStill + 0.05) continue;
    square += (output.frame->state.T_W_I.t() - CornerWorld::pose(t).t()).squaredNorm();
    ++n;
  }
  return std::sqrt(square / n);
}

TEST(LaggingDepth, IsCarriedOverToTheStampOfColour) {
  for (const double lag : {-0.015, 0.015}) {
    const double told = errorWithLag(lag, lag, 0), not_told = errorWithLag(lag, 0, 0);
    EXPECT_LT(told, 0.003) << lag;
    EXPECT_GT(not_told, 3 * told) << lag;
  }
}

TEST(LaggingDepth, RowsOfALaterDepthImage) { EXPECT_LT(errorWithLag(0.012, 0.012, kReadout), 0.003); }

}  // namespace
}  // namespace vip_slam
