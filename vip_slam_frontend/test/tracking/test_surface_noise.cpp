// SPDX-License-Identifier: BSD-3-Clause
// What flat walls teach of the two parts of depth noise.
#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "test_camera.h"
#include "vip_slam_frontend/tracking/surface_tracker.h"

namespace vip_slam::surface_noise_test {
namespace {

constexpr double kLongFocal = 480;
constexpr int kWindow = 11;

/// A wall 2 m ahead with errors in sigmas of a reading: white, and correlated over `reach` px.
cv::Mat noisyWall(const DepthNoise& noise, double white, double correlated, int reach, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  cv::Mat_<float> depth(480, 640), smooth(480, 640);
  for (float& x : smooth) x = static_cast<float>(normal(random));
  cv::GaussianBlur(smooth, smooth, cv::Size(), reach / 2.0);
  cv::Scalar mean, deviation;
  cv::meanStdDev(smooth, mean, deviation);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      const double error = white * normal(random) + correlated * (smooth(v, u) - mean[0]) / deviation[0];
      depth(v, u) = static_cast<float>(2.0 + noise.sigma(2.0) * error);
    }
  }
  return depth;
}

TEST(SurfaceNoise, WhiteDepthIsLearntToBeWhite) {
  const DepthNoise noise;
  SurfaceTracker tracker(testCamera(kLongFocal), noise, kWindow);
  EXPECT_GT(tracker.learnt().shared(), 0.5);  // a poor camera until something is known
  for (unsigned i = 0; i < 30; ++i) {
    tracker.match(noisyWall(noise, 1.0, 0.0, 1, 100 + i), SE3());
    tracker.setReference(noisyWall(noise, 1.0, 0.0, 1, i), i + 1);
  }
  EXPECT_LT(tracker.learnt().shared(), 0.1);
  EXPECT_LT(tracker.learnt().parts().shared, 0.02);  // nor does the map believe otherwise
  EXPECT_LT(tracker.learnt().white(), 0.3);          // of 49 readings a patch has a seventh, and a little for its tilt
}

TEST(SurfaceNoise, CorrelatedDepthIsLearntToBeShared) {
  const DepthNoise noise;
  SurfaceTracker tracker(testCamera(kLongFocal), noise, kWindow);
  for (unsigned i = 0; i < 30; ++i) tracker.setReference(noisyWall(noise, 0.5, 1.5, 96, i), i + 1);
  const double learnt = tracker.learnt().shared();
  // With what the fit takes up, all of the correlated part.
  EXPECT_NEAR(learnt, 1.5, 0.4);
  EXPECT_NEAR(std::sqrt(tracker.learnt().parts().shared), learnt, 1e-9);
  tracker.clear();
  EXPECT_EQ(tracker.learnt().shared(), learnt);  // it belongs to the sensor
}

TEST(SurfaceNoise, ManyPairsOfWhiteDepthAgreeWithTheirCovarianceOverTheLifeOfAReference) {
  const DepthNoise noise;
  SurfaceTracker tracker(testCamera(kLongFocal), noise, 10);
  // The error of the mean distance over ten images that share one reference, and what their pairs' sigmas promise. The
  // first references teach the noise.
  double squares = 0, promised = 0;
  constexpr int kReferences = 60, kImages = 10, kTaught = 20;
  for (unsigned k = 0; k < kReferences; ++k) {
    tracker.setReference(noisyWall(noise, 1.0, 0.0, 1, 1000 + k), 100 + k);
    double weights = 0, sum = 0;
    for (unsigned i = 0; i < kImages; ++i) {
      for (const SurfacePair& pair : tracker.match(noisyWall(noise, 1.0, 0.0, 1, 2000 + 50 * k + i), SE3()).pairs) {
        const double w = 1.0 / (pair.sigma * pair.sigma);
        weights += w;
        sum += w * (pair.q_cur.z() - pair.p_ref.z());
      }
    }
    squares += (k >= kTaught) * std::pow(sum / weights, 2);
    promised += (k >= kTaught) / weights;
  }
  EXPECT_LT(squares, 1.5 * promised);
  EXPECT_GT(squares, 0.2 * promised);
}

}  // namespace
}  // namespace vip_slam::surface_noise_test
