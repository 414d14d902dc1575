// SPDX-License-Identifier: BSD-3-Clause
// What real depth cameras get wrong, each effect measured in what comes out.
#include <gtest/gtest.h>

#include "test_support.h"
#include "vip_slam_sim/scene/scene_builder.h"

namespace vip_slam {
namespace {

/// A wall of which the camera sees nothing else, `z` away; the right half belongs to another surface.
struct Walls {
  Scene scene;
  FrameBuffers frame;
  Walls(int width, int height, float z) {
    SceneBuilder b("walls");
    for (int k = 0; k < 2; ++k) b.rectangle({0, 5.0 * k, 0}, {0, -1, 0}, {0, 0, 1}, {});
    scene = b.finish();
    frame.depth = cv::Mat(height, width, CV_32FC1, cv::Scalar(z));
    frame.piece = cv::Mat::zeros(height, width, CV_32SC1);
    frame.piece(cv::Rect(width / 2, 0, width - width / 2, height)).setTo(1);
    frame.grazing = cv::Mat::ones(height, width, CV_32FC1);
  }
};

DepthOptions millimetre() {
  DepthOptions o;
  o.a = 0.001;
  o.b = o.c = 0;
  return o;
}

/// Correlation of two lists of numbers of zero mean.
double correlation(const std::vector<float>& a, const std::vector<float>& b) {
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) ab += a[i] * b[i], aa += a[i] * a[i], bb += b[i] * b[i];
  return ab / std::sqrt(aa * bb);
}

TEST(LatticeNoise, HasUnitVarianceAndUnitLength) {
  const LatticeNoise noise(7);
  const float steps[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (const auto& step : steps) {
    std::vector<float> here, beside, far;
    for (int i = 0; i < 20000; ++i) {
      const float x = 0.37f * float(i % 200), y = 0.61f * float(i / 200), t = 0.83f * float(i % 37);
      here.push_back(noise(x, y, t));
      beside.push_back(noise(x + step[0], y + step[1], t + step[2]));
      far.push_back(noise(x + 4 * step[0], y + 4 * step[1], t + 4 * step[2]));
    }
    double square = 0, mean = 0;
    for (float v : here) square += v * v, mean += v;
    EXPECT_NEAR(square / 20000, 1, 0.05);
    EXPECT_NEAR(mean / 20000, 0, 0.05);
    EXPECT_NEAR(correlation(here, beside), std::exp(-1), 0.08);
    EXPECT_NEAR(correlation(here, far), 0, 0.06);
  }
}

TEST(SharedDepthError, ScaleAndOffsetAreThoseGiven) {
  const Walls walls(64, 48, 3.f);
  DepthOptions o = millimetre();
  EXPECT_TRUE(SharedDepthError(o, 1).none());
  o.scale = 1.02;
  o.offset = -0.01;
  const cv::Mat depth = SharedDepthError(o, 1).apply(walls.frame, walls.scene, 5);
  EXPECT_NEAR(depth.at<float>(20, 20), 1.02 * 3 - 0.01, 1e-5);
}

TEST(SharedDepthError, WarpIsCorrelatedOverSixtyFourPixelsAndHalfASecond) {
  const Walls walls(640, 480, 2.f);
  DepthOptions o = millimetre();
  o.warp = 2;
  const SharedDepthError error(o, 3);
  std::vector<float> here, half, beside, far, soon, late;
  for (int k = 0; k < 40; ++k) {
    const double t = 3.1 * k;
    const cv::Mat now = error.apply(walls.frame, walls.scene, t), then = error.apply(walls.frame, walls.scene, t + 0.5);
    const cv::Mat later = error.apply(walls.frame, walls.scene, t + 2);
    for (int v = 10; v < 470; v += 40)
      for (int u = 10; u < 380; u += 40) {
        const auto at = [&](const cv::Mat& m, int x) { return 1000 * (m.at<float>(v, x) - 2.f); };
        here.push_back(at(now, u));
        half.push_back(at(now, u + 32));
        beside.push_back(at(now, u + 64));
        far.push_back(at(now, u + 250));
        soon.push_back(at(then, u));
        late.push_back(at(later, u));
      }
  }
  double square = 0;
  for (float v : here) square += v * v;
  const double in_space = correlation(here, beside), in_time = correlation(here, soon);
  std::printf(
      "  warp %.2f mm; correlation %.2f over 32 px, %.2f over 64, %.2f over 250; %.2f after 0.5 s, %.2f after 2\n",
      std::sqrt(square / double(here.size())), correlation(here, half), in_space, correlation(here, far), in_time,
      correlation(here, late));
  EXPECT_NEAR(std::sqrt(square / double(here.size())), 2, 0.2);
  EXPECT_GT(correlation(here, half), 0.6);
  EXPECT_NEAR(in_space, std::exp(-1), 0.12);
  EXPECT_NEAR(in_time, std::exp(-1), 0.12);
  EXPECT_NEAR(correlation(here, far), 0, 0.1);
  EXPECT_NEAR(correlation(here, late), 0, 0.1);
}

TEST(SharedDepthError, FixedWarpStays) {
  const Walls walls(640, 480, 2.f);
  DepthOptions o = millimetre();
  o.fixed_warp = 2;
  const SharedDepthError error(o, 3);
  const cv::Mat a = error.apply(walls.frame, walls.scene, 1), b = error.apply(walls.frame, walls.scene, 1000);
  EXPECT_EQ(cv::norm(a, b, cv::NORM_INF), 0);
  EXPECT_NEAR(1000 * cv::norm(a - 2.f) / std::sqrt(640. * 480), 2, 0.6);
}

TEST(SharedDepthError, ASurfaceErrsAsAWholeAndItsNeighbourOtherwise) {
  const Walls walls(64, 48, 2.f);
  DepthOptions o = millimetre();
  o.surface_error = 3;
  const SharedDepthError error(o, 5);
  std::vector<float> left, right;
  for (int k = 0; k < 600; ++k) {
    const cv::Mat depth = error.apply(walls.frame, walls.scene, 1.7 * k);
    left.push_back(1000 * (depth.at<float>(5, 5) - 2));
    right.push_back(1000 * (depth.at<float>(5, 60) - 2));
    EXPECT_EQ(depth.at<float>(40, 20), depth.at<float>(5, 5));
  }
  double square = 0;
  for (float v : left) square += v * v;
  EXPECT_NEAR(std::sqrt(square / 600), 3, 0.4);
  EXPECT_NEAR(correlation(left, right), 0, 0.12);
  // Seen at a slant it errs more.
  Walls slanted(64, 48, 2.f);
  slanted.frame.grazing.setTo(0.5f);
  const cv::Mat frontal = error.apply(walls.frame, walls.scene, 1.7),
                steep = error.apply(slanted.frame, walls.scene, 1.7);
  EXPECT_NEAR((steep.at<float>(5, 5) - 2) / (frontal.at<float>(5, 5) - 2), 1.5, 1e-2);
}

/// What was measured of real cameras: the mean of 64 x 64 pixels errs by two thirds of what a pixel does.
TEST(SharedDepthError, MeansOfRealSequencesHardlyAverageOut) {
  for (const std::string name : {"real_01", "real_04", "real_05"}) {
    const SequenceSpec spec = loadSequence(name, libraryPath());
    const Walls walls(640, 480, 2.f);
    const SharedDepthError error(spec.depth, spec.seed);
    const double sigma = spec.depth.a + spec.depth.b * 2 + spec.depth.c * 4;
    double pixels = 0, blocks = 0;
    int n = 0;
    for (int k = 0; k < 60; ++k) {
      const cv::Mat depth = error.apply(walls.frame, walls.scene, 2.3 * k) - 2 * spec.depth.scale - spec.depth.offset;
      for (int v = 0; v < 448; v += 64)
        for (int u = 0; u < 256; u += 64, ++n) {
          pixels += std::pow(depth.at<float>(v + 31, u + 31) / sigma, 2) + std::pow(spec.depth.white, 2);
          blocks += std::pow(cv::mean(depth(cv::Rect(u, v, 64, 64)))[0] / sigma, 2);
        }
    }
    const double one = std::sqrt(pixels / n), mean = std::sqrt(blocks / n);
    std::printf("  %s: a pixel errs by %.2f sigmas, the mean of 64 x 64 by %.2f\n", name.c_str(), one, mean);
    EXPECT_NEAR(one, 2.1, 0.4) << name;
    EXPECT_NEAR(mean / one, 0.75, 0.15) << name;
  }
}

TEST(DisparitySteps, AreThoseOfTheDisparity) {
  const DisparitySteps kinect(580 * 0.075, 0.125);
  // At 3 m a step is z^2 / (f b) / 8 = 2.6 cm.
  std::vector<float> levels;
  for (float z = 2.8f; z < 3.2f; z += 1e-4f)
    if (levels.empty() || kinect(z) != levels.back()) levels.push_back(kinect(z));
  ASSERT_GT(levels.size(), 10u);
  for (std::size_t i = 1; i < levels.size(); ++i) {
    EXPECT_NEAR(levels[i] - levels[i - 1], 0.125 / 43.5 * levels[i] * levels[i - 1], 1e-4);
    EXPECT_NEAR(std::remainder(43.5 / levels[i], 0.125), 0, 1e-4);
  }
  EXPECT_EQ(DisparitySteps(43.5, 0)(2.345f), 2.345f);
  EXPECT_LE(DisparitySteps(43.5, 0.125)(1000.f), 0);
}

TEST(EdgeFattening, GrowsTheForegroundByAFewPixels) {
  cv::Mat depth(120, 160, CV_32FC1, cv::Scalar(3));
  depth(cv::Rect(60, 0, 40, 120)).setTo(1.5);
  depth(cv::Rect(0, 0, 10, 120)).setTo(0);
  const cv::Mat before = depth.clone();
  EdgeFattening(4, 3).apply(1.0, &depth);
  double grown = 0;
  int most = 0;
  for (int v = 0; v < 120; ++v) {
    int row = 0;
    for (int u = 100; u < 110; ++u) row += depth.at<float>(v, u) == 1.5f;
    grown += row;
    most = std::max(most, row);
    for (int u = 60; u < 100; ++u) EXPECT_EQ(depth.at<float>(v, u), 1.5f);
  }
  EXPECT_NEAR(grown / 120, 2.6, 0.9);
  EXPECT_LE(most, 4);
  EXPECT_EQ(cv::norm(before(cv::Rect(110, 0, 50, 120)), depth(cv::Rect(110, 0, 50, 120))), 0);
  EXPECT_EQ(cv::countNonZero(depth(cv::Rect(0, 0, 5, 120))), 0);
}

/// Two walls that meet at right angles, or one alone, seen from 2.8 m.
double multipathError(bool corner, double reflectance, int u) {
  SceneBuilder b("corner");
  if (corner) {
    b.rectangle({0, 0, -4}, {4, 0, 0}, {0, 0, 8}, {});
    b.rectangle({0, 4, -4}, {0, -4, 0}, {0, 0, 8}, {});
  } else {
    b.rectangle({-2, 2, -4}, {4, -4, 0}, {0, 0, 8}, {});
  }
  auto scene = std::make_shared<Scene>(b.finish());
  auto tracer = std::make_shared<RayTracer>(*scene);
  CameraOptions o;
  const auto camera = makeCamera(o.intrinsics());
  const Renderer renderer(scene, tracer, camera);
  Eigen::Matrix3d R;  // looks along (-1, -1, 0)
  R.col(2) = Eigen::Vector3d(-1, -1, 0).normalized();
  R.col(1) = Eigen::Vector3d(0, 0, -1);
  R.col(0) = R.col(1).cross(R.col(2));
  const SE3 T_W_C(R, Eigen::Vector3d(2, 2, 0));
  FrameBuffers frame;
  renderer.renderDepth(T_W_C, &frame);
  cv::Mat depth = frame.depth.clone();
  Multipath(reflectance, scene, tracer).apply(renderer, frame, T_W_C, &depth);
  return depth.at<float>(240, u) - frame.depth.at<float>(240, u);
}

TEST(Multipath, MakesCornersLongAndLeavesFlatWallsAlone) {
  EXPECT_NEAR(multipathError(false, 0.4, 320), 0, 1e-6);
  const double corner = multipathError(true, 0.4, 330), side = multipathError(true, 0.4, 600);
  std::printf("  corner %.1f mm long, its sides %.1f mm\n", 1000 * corner, 1000 * side);
  EXPECT_GT(corner, 0.005);
  EXPECT_LT(corner, 0.05);
  EXPECT_GT(side, 0);
  EXPECT_LT(side, 0.05);
  EXPECT_NEAR(multipathError(true, 0.05, 330) / multipathError(true, 0.025, 330), 2, 0.1);
  EXPECT_EQ(multipathError(true, 0, 330), 0);
}

TEST(CoarseDepth, BlendsReadingsAndDropsWhatTouchesAHole) {
  cv::Mat depth(48, 64, CV_16UC1);
  for (int v = 0; v < 48; ++v)
    for (int u = 0; u < 64; ++u) depth.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(1000 + 10 * u + 4 * v);
  cv::Mat ramp = depth.clone();
  CoarseDepth(2).apply(&ramp);
  for (int v = 1; v < 46; ++v)
    for (int u = 1; u < 62; ++u) EXPECT_EQ(ramp.at<std::uint16_t>(v, u), depth.at<std::uint16_t>(v, u));
  depth.at<std::uint16_t>(21, 31) = 0;  // a place of a reading
  CoarseDepth(2).apply(&depth);
  int lost = 0;
  for (int v = 18; v < 25; ++v)
    for (int u = 28; u < 35; ++u) lost += depth.at<std::uint16_t>(v, u) == 0;
  EXPECT_EQ(lost, 9);
}

}  // namespace
}  // namespace vip_slam
