// SPDX-License-Identifier: BSD-3-Clause
// Depth noise, edge-safe look-up, grids, conversion and registration.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>

#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_core/depth/grid_spacing.h"

namespace vip_slam {
namespace {

// Depth of the plane n.x + d = 0 seen by a pinhole camera.
cv::Mat planeDepth(const Eigen::Vector3d& n, double d, double f = 500, int w = 640, int h = 480) {
  cv::Mat depth(h, w, CV_32FC1);
  for (int v = 0; v < h; ++v) {
    for (int u = 0; u < w; ++u) {
      const double z = -d / n.dot(Eigen::Vector3d((u - 319.5) / f, (v - 239.5) / f, 1));
      depth.at<float>(v, u) = z > 0 ? float(z) : 0.0f;
    }
  }
  return depth;
}

void addNoise(cv::Mat* depth, const DepthNoise& noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  for (int v = 0; v < depth->rows; ++v) {
    for (int u = 0; u < depth->cols; ++u) {
      float& z = depth->at<float>(v, u);
      z += float(noise.sigma(z)) * normal(random);
    }
  }
}

CameraIntrinsics camera(int w, int h, double f) {
  CameraIntrinsics k;
  k.width = w, k.height = h, k.fx = k.fy = f, k.cx = 0.5 * (w - 1), k.cy = 0.5 * (h - 1);
  return k;
}

TEST(DepthNoiseTest, ModelsNamesAndMistakes) {
  for (const auto type : {DepthSensorType::kProportional, DepthSensorType::kStructuredLight, DepthSensorType::kStereo,
                          DepthSensorType::kTof}) {
    EXPECT_EQ(depthSensorTypeFromName(depthSensorTypeName(type)), type);
    const DepthNoise noise = DepthNoise::preset(type);
    EXPECT_EQ(noise.type, type);
    EXPECT_EQ(noise.validate(), "");
    EXPECT_LT(noise.sigma(1), noise.sigma(4));
    EXPECT_TRUE(noise.inRange(1));
    EXPECT_FALSE(noise.inRange(0));
    EXPECT_FALSE(noise.inRange(NAN));
    EXPECT_FALSE(noise.inRange(100));
  }
  EXPECT_THROW(depthSensorTypeFromName("sonar"), std::invalid_argument);
  DepthNoise noise;
  noise.a = 0.01, noise.b = 0.002, noise.c = 0.003;
  EXPECT_DOUBLE_EQ(noise.sigma(2), 0.01 + 0.004 + 0.012);
  noise.max_range = 0.1;
  EXPECT_NE(noise.validate().find("max_range"), std::string::npos);
  noise = DepthNoise();
  noise.b = -1;
  EXPECT_NE(noise.validate().find("b must"), std::string::npos);
  noise.b = NAN;
  EXPECT_NE(noise.validate(), "");
}

TEST(SafeDepth, ExactOnSlantedPlanesBetweenPixels) {
  const DepthNoise noise;
  const cv::Mat depth = planeDepth(Eigen::Vector3d(0.8, 0.2, -0.57).normalized(), 1.2);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(60, 380), v(20, 460);
  int judged = 0;
  for (int k = 0; k < 300; ++k) {
    const double x = u(random), y = v(random);
    const Eigen::Vector3d n = Eigen::Vector3d(0.8, 0.2, -0.57).normalized();
    const double z = -1.2 / n.dot(Eigen::Vector3d((x - 319.5) / 500, (y - 239.5) / 500, 1));
    if (z < 0.3 || z > 5) continue;
    const float measured = safeDepth(depth, x, y, noise);
    ASSERT_GT(measured, 0) << x << " " << y;
    EXPECT_NEAR(measured, z, 1e-5 * z);
    ++judged;
  }
  EXPECT_GT(judged, 200);
}

TEST(SafeDepth, WallsAlongACorridorAreNotPutTooFar) {
  // A wall 1.1 m to the left, seen along: noise averages out, what stays is bias.
  DepthNoise noise;
  cv::Mat depth = planeDepth({1, 0, 0}, 1.1);
  addNoise(&depth, noise, 5);
  double sum = 0;
  int count = 0;
  for (int v = 10; v < 470; v += 3) {
    for (int u = 196; u < 214; u += 3) {
      const float z = safeDepth(depth, u, v, noise);
      if (z == 0) continue;
      sum += z / (1.1 * 500 / (319.5 - u)) - 1;
      ++count;
    }
  }
  EXPECT_GT(count, 700);
  EXPECT_LT(std::abs(sum / count), 7e-5);
}

TEST(SafeDepth, AveragesNoise) {
  const DepthNoise noise = DepthNoise::preset(DepthSensorType::kStructuredLight);
  cv::Mat depth = planeDepth({0, 0, -1}, 3.0);
  addNoise(&depth, noise, 2);
  double sum2 = 0;
  int count = 0;
  for (int v = 10; v < 470; v += 9) {
    for (int u = 10; u < 630; u += 9) {
      const float z = safeDepth(depth, u, v, noise);
      if (z == 0) continue;
      sum2 += (z - 3.0) * (z - 3.0);
      ++count;
    }
  }
  EXPECT_GT(count, 0.95 * 52 * 69);
  EXPECT_LT(std::sqrt(sum2 / count), 0.4 * noise.sigma(3.0));
}

TEST(SafeDepth, RefusesEdgesHolesRangeAndOutside) {
  const DepthNoise noise;
  cv::Mat depth(100, 100, CV_32FC1, cv::Scalar(2.0));
  depth.colRange(50, 100) = 2.5;
  EXPECT_NEAR(safeDepth(depth, 30, 50, noise), 2.0, 1e-6);
  for (double u = 47.6; u <= 51.4; u += 0.3) EXPECT_EQ(safeDepth(depth, u, 50, noise), 0.0f) << u;
  EXPECT_NEAR(safeDepth(depth, 53, 50, noise), 2.5, 1e-6);

  depth.setTo(2.0);
  depth(cv::Rect(40, 40, 10, 10)) = 0.0;
  EXPECT_EQ(safeDepth(depth, 45, 45, noise), 0.0f);
  depth(cv::Rect(40, 40, 10, 10)) = NAN;
  EXPECT_EQ(safeDepth(depth, 45, 45, noise), 0.0f);
  depth(cv::Rect(40, 40, 10, 10)) = 50.0;
  EXPECT_EQ(safeDepth(depth, 45, 45, noise), 0.0f);
  depth.setTo(2.0);
  depth.at<float>(20, 20) = 0;  // single drop-outs do not matter
  depth.at<float>(21, 19) = NAN;
  EXPECT_NEAR(safeDepth(depth, 20, 20, noise), 2.0, 1e-6);

  EXPECT_NEAR(safeDepth(depth, 0, 0, noise), 2.0, 1e-6);
  EXPECT_NEAR(safeDepth(depth, 99, 99, noise), 2.0, 1e-6);
  EXPECT_EQ(safeDepth(depth, -3, 50, noise), 0.0f);
  EXPECT_EQ(safeDepth(depth, 103, 50, noise), 0.0f);
  EXPECT_EQ(safeDepth(depth, NAN, 50, noise), 0.0f);
  EXPECT_EQ(safeDepth(depth, 1e12, 50, noise), 0.0f);
  EXPECT_EQ(safeDepth(cv::Mat(), 5, 5, noise), 0.0f);
  EXPECT_THROW(safeDepth(cv::Mat(5, 5, CV_16UC1), 2, 2, noise), std::invalid_argument);
}

TEST(DepthToMetres, TypesAndInvalidValues) {
  cv::Mat millimetres(2, 2, CV_16UC1, cv::Scalar(1500));
  millimetres.at<std::uint16_t>(0, 0) = 0;
  cv::Mat metres = depthToMetres(millimetres, 0.001);
  EXPECT_EQ(metres.type(), CV_32FC1);
  EXPECT_FLOAT_EQ(metres.at<float>(1, 1), 1.5f);
  EXPECT_EQ(metres.at<float>(0, 0), 0.0f);
  cv::Mat floats(1, 4, CV_32FC1);
  floats.at<float>(0) = NAN, floats.at<float>(1) = INFINITY, floats.at<float>(2) = -1, floats.at<float>(3) = 2.5f;
  metres = depthToMetres(floats, 0.001);
  EXPECT_EQ(metres.at<float>(0), 0);
  EXPECT_EQ(metres.at<float>(1), 0);
  EXPECT_EQ(metres.at<float>(2), 0);
  EXPECT_EQ(metres.at<float>(3), 2.5f);
  // The offset added to every reading must not turn invalid depth into a reading.
  metres = depthToMetres(floats, 0.001, -0.01);
  EXPECT_EQ(metres.at<float>(1), 0);
  EXPECT_FLOAT_EQ(metres.at<float>(3), 2.49f);
  millimetres.at<std::uint16_t>(0, 1) = 5;
  metres = depthToMetres(millimetres, 0.001, -0.01);
  EXPECT_FLOAT_EQ(metres.at<float>(1, 1), 1.49f);
  EXPECT_EQ(metres.at<float>(0, 0), 0.0f);
  EXPECT_EQ(metres.at<float>(0, 1), 0.0f);
  try {
    depthToMetres(cv::Mat(2, 2, CV_8UC3), 1);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("CV_8UC3"), std::string::npos);
  }
}

TEST(DepthGridTest, AgreesWithTheLookUp) {
  const DepthNoise noise;
  cv::Mat depth = planeDepth(Eigen::Vector3d(0.5, -0.1, -0.8).normalized(), 1.7);
  depth(cv::Rect(100, 100, 120, 80)) = 0.9;
  addNoise(&depth, noise, 4);
  depth(cv::Rect(400, 300, 30, 50)) = 0;
  for (const int stride : {4, 8, 13}) {
    const DepthGrid grid = makeDepthGrid(depth, stride, noise);
    EXPECT_EQ(grid.stride, stride);
    for (int r = 0; r < grid.rows; ++r) {
      for (int c = 0; c < grid.cols; ++c) {
        const Eigen::Vector2d p = grid.pixel(c, r);
        ASSERT_LT(p.x(), 640);
        ASSERT_LT(p.y(), 480);
        EXPECT_NEAR(grid.at(c, r), safeDepth(depth, p.x(), p.y(), noise), 1e-6) << p.transpose();
      }
    }
    EXPECT_GE(grid.pixel(grid.cols, grid.rows).x(), 640);
    EXPECT_GE(grid.pixel(grid.cols, grid.rows).y(), 480);
  }
  EXPECT_TRUE(makeDepthGrid(cv::Mat(), 8, noise).empty());
  EXPECT_THROW(makeDepthGrid(depth, 0, noise), std::invalid_argument);
}

TEST(DepthGridTest, SmallImagesAreLookedUpAsOftenAsLargeOnes) {
  EXPECT_EQ(8, strideOn(640, 480, 8));
  EXPECT_EQ(8, strideOn(480, 640, 8)) << "on its side";
  EXPECT_EQ(8, strideOn(1280, 720, 8));
  EXPECT_EQ(4, strideOn(320, 240, 8));
  EXPECT_EQ(5, strideOn(424, 240, 8));
  EXPECT_EQ(1, strideOn(64, 48, 8));
  EXPECT_DOUBLE_EQ(10.6, spacingOn(424, 240, 16));
}

TEST(DepthGridTest, KeepsSurfacesAtAGrazingAngleButNoEdges) {
  // A table top 0.55 m below the camera and, below its far edge at 6 m, the floor behind it.
  const DepthNoise noise;
  const double f = 525, horizon = 100;
  cv::Mat depth(480, 640, CV_32FC1, cv::Scalar(0));
  for (int v = 0; v < depth.rows; ++v) {
    const double top = v > horizon ? 0.55 * f / (v - horizon) : 1e9,
                 floor = v > horizon ? 0.8 * f / (v - horizon) : 1e9;
    depth.row(v) = top < 6.0 ? top : floor < 10.0 ? floor : 0.0;
  }
  int far_nodes = 0;
  for (const int stride : {4, 8}) {
    const DepthGrid grid = makeDepthGrid(depth, stride, noise);
    for (int r = 0; r < grid.rows; ++r) {
      const double v = grid.pixel(0, r).y(), top = 0.55 * f / (v - horizon), z = grid.at(20, r);
      if (z == 0) continue;
      const double surface = top < 6.0 ? top : 0.8 * f / (v - horizon);
      EXPECT_NEAR(z, surface, 0.02) << "row " << v;  // on one of the two surfaces, never in between
      if (top > 4.0 && top < 5.8) {
        ++far_nodes;
        EXPECT_EQ(safeDepth(depth, grid.pixel(20, r).x(), v, noise), 0.0f) << v;  // as cautious as ever for one point
      }
    }
    for (int r = 0; r < grid.rows; ++r) {  // windows that hold both surfaces
      const double v = grid.pixel(0, r).y();
      const bool both = 0.55 * f / (v + 2 - horizon) < 6.0 && 0.55 * f / (v - 2 - horizon) > 6.0;
      if (both) {
        EXPECT_EQ(grid.at(20, r), 0.0f) << v;
      }
    }
  }
  EXPECT_GE(far_nodes, 6);
}

TEST(DepthRegistration, PlaneSeenFromAnotherCamera) {
  const auto depth_camera = makeCamera(camera(640, 480, 500)), colour = makeCamera(camera(640, 480, 600));
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T(0, 3) = 0.05;
  T(2, 3) = 0.01;
  // A wall at z = 2 m of the depth camera is at 2.01 m of the colour camera, everywhere.
  const cv::Mat wall(480, 640, CV_32FC1, cv::Scalar(2.0));
  const cv::Mat seen = DepthRegistration(depth_camera, colour, T)(wall);
  ASSERT_EQ(seen.size(), cv::Size(640, 480));
  int covered = 0;
  for (int v = 20; v < 460; ++v) {
    for (int u = 40; u < 620; ++u) {
      const float z = seen.at<float>(v, u);
      if (z == 0) continue;
      EXPECT_NEAR(z, 2.01, 1e-5);
      ++covered;
    }
  }
  EXPECT_EQ(covered, 440 * 580);  // no holes though the colour image is finer
}

TEST(DepthRegistration, NearestSurfaceWinsAndShadowsStayEmpty) {
  const auto k = makeCamera(camera(640, 480, 500));
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T(0, 3) = -0.2;  // the colour camera stands 20 cm to the right
  cv::Mat depth(480, 640, CV_32FC1, cv::Scalar(3.0));
  depth(cv::Rect(300, 200, 40, 40)) = 1.0;  // a box in front: moves by 100 px, the wall by 33
  const cv::Mat seen = DepthRegistration(k, k, T)(depth);
  EXPECT_NEAR(seen.at<float>(220, 220), 1.0, 1e-5);  // pixel 320 moved by -100
  EXPECT_NEAR(seen.at<float>(220, 150), 3.0, 1e-5);
  EXPECT_EQ(seen.at<float>(220, 285), 0.0f);  // hidden from the depth camera by the box
}

TEST(DepthRegistration, RefusesOtherSizes) {
  const auto k = makeCamera(camera(640, 480, 500));
  const DepthRegistration registration(k, k, Eigen::Matrix4d::Identity());
  EXPECT_THROW(registration(cv::Mat(100, 100, CV_32FC1)), std::invalid_argument);
  EXPECT_THROW(registration(cv::Mat(480, 640, CV_16UC1)), std::invalid_argument);
  EXPECT_THROW(DepthRegistration(nullptr, k, Eigen::Matrix4d::Identity()), std::invalid_argument);
}

TEST(DepthSpeed, GridAndRegistrationFitTheFrameBudget) {
  const DepthNoise noise;
  cv::Mat depth = planeDepth(Eigen::Vector3d(0.3, -0.1, -0.9).normalized(), 2);
  addNoise(&depth, noise, 5);
  const auto fastest = [](const auto& work) {
    double best = 1e9;
    for (int k = 0; k < 20; ++k) {
      const auto start = std::chrono::steady_clock::now();
      work();
      best =
          std::min(best, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    }
    return best;
  };
  const double grid = fastest([&] { makeDepthGrid(depth, 8, noise); });
  const double look_ups = fastest([&] {
    for (int k = 0; k < 1000; ++k) safeDepth(depth, 10.3 + (k * 37) % 620, 10.7 + (k * 91) % 460, noise);
  });
  const auto k = makeCamera(camera(640, 480, 500));
  const DepthRegistration registration(k, k, Eigen::Matrix4d::Identity());
  const double warp = fastest([&] { registration(depth); });
  std::printf("grid of 80x60: %.2f ms, 1000 look-ups: %.2f ms, registration: %.2f ms\n", grid, look_ups, warp);
  // Generous: shared machines. The front end's whole budget is 10 ms.
  EXPECT_LT(grid, 6.0);
  EXPECT_LT(look_ups, 2.0);
  EXPECT_LT(warp, 60.0);
}

}  // namespace
}  // namespace vip_slam
