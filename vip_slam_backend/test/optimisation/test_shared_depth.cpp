// SPDX-License-Identifier: BSD-3-Clause
// Depth of single points that share their errors.
#include <gtest/gtest.h>

#include "../../src/optimisation/shared_depth.h"

using namespace vip_slam;

// Readings next to each other in a keyframe err alike, those of other surfaces and much later keyframes do not.
TEST(SharedDepth, ReadingsOfOneSurfaceAreWorthOne) {
  const DepthNoise model = DepthNoise::preset(DepthSensorType::kTof);
  const auto information = [&model](int points, double apart, double seconds, const DepthNoiseParts& noise) {
    BaProblem problem;
    for (int f = 0; f < 2; ++f) problem.frames.emplace_back();
    for (int p = 0; p < points; ++p) {
      BaPoint point;
      point.first = static_cast<int>(problem.observations.size());
      point.count = 2;
      problem.points.push_back(point);
      for (int f = 0; f < 2; ++f) {
        BaObservation seen;
        seen.frame = f;
        seen.x = apart * p;
        seen.depth = 2;
        seen.depth_weight = 1 / model.sigma(2);
        problem.observations.push_back(seen);
      }
    }
    shareDepthErrors(model, noise, {0, seconds}, &problem);
    double sum = 0;
    for (const BaObservation& o : problem.observations) sum += o.depth_weight * o.depth_weight;
    return sum;
  };
  // Of a reading, and of what readings share on a poor camera.
  const double white = 1 / (model.sigma(2) * model.sigma(2)), shared = white;
  EXPECT_NEAR(information(10, 0.001, 60, {1, 0}), 20 * white, 1e-6 * white);  // nothing is shared
  EXPECT_LT(information(100, 0.0001, 60, {}), 2 * shared);
  EXPECT_GT(information(100, 0.0001, 60, {}), 1.9 * shared);
  EXPECT_LT(information(100, 0.0001, 0, {}), 1.1 * shared);          // two images of one moment
  EXPECT_GT(information(10, 0.2, 60, {}), 20 / (1 / white + 1 / shared) - 1e-6 * shared);  // each its own surface
}
