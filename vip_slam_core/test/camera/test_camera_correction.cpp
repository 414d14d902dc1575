// SPDX-License-Identifier: BSD-3-Clause
// Depth that turns out to have been read too long.
#include <gtest/gtest.h>

#include <cmath>

#include "vip_slam_core/types/camera_correction.h"

namespace vip_slam {
namespace {

TEST(CameraCorrection, MovesReadingsAndLeavesTheRest) {
  auto keyframe = std::make_shared<Keyframe>();
  keyframe->id = 7;
  keyframe->frame.camera_correction.offset = 0.002;
  Feature with, without;
  with.depth = 2.0f;
  with.depth_sigma = 0.01f;
  keyframe->frame.features = {with, without};
  keyframe->frame.depth_grid.z = {1.5f, 0.0f, 0.003f};
  const KeyframePtr corrected = withCameraCorrection(keyframe, {-0.01, {}});
  EXPECT_EQ(corrected->id, 7u);
  EXPECT_EQ(corrected->frame.camera_correction.offset, -0.01);
  EXPECT_FLOAT_EQ(corrected->frame.features[0].depth, 2.0f - 0.012f);
  EXPECT_EQ(corrected->frame.features[0].depth_sigma, 0.01f);
  EXPECT_EQ(corrected->frame.features[1].depth, 0.0f);
  EXPECT_FLOAT_EQ(corrected->frame.depth_grid.z[0], 1.5f - 0.012f);
  EXPECT_EQ(corrected->frame.depth_grid.z[1], 0.0f);
  EXPECT_GT(corrected->frame.depth_grid.z[2], 0.0f);
  EXPECT_EQ(keyframe->frame.features[0].depth, 2.0f);
  EXPECT_EQ(withCameraCorrection(keyframe, {0.002, {}}), keyframe);
}

TEST(CameraCorrection, MovesPointsOnPlanesAlongTheirRays) {
  const Eigen::Vector3f rays[] = {{0.3f, -0.2f, 1}, {-0.5f, 0.1f, 1}, {0, 0.4f, 1}};
  const auto observe = [&](double too_long) {
    PlaneObservation observation;
    observation.weight_scale = 0.4;
    for (int k = 0; k < 3; ++k) {
      const PlaneSample point{rays[k] * float(1.0 + 0.7 * k + too_long), 0.004f + 0.001f * float(k)};
      const Eigen::Vector4d p = point.p_C.cast<double>().homogeneous();
      observation.G += 0.4 * p * p.transpose() / std::pow(double(point.sigma), 2);
      observation.points.push_back(point);
    }
    return observation;
  };
  PlaneObservation read = observe(0.01);
  setCameraCorrection({-0.01, {}}, &read);
  const PlaneObservation truth = observe(0);
  EXPECT_EQ(read.camera_correction.offset, -0.01);
  for (int k = 0; k < 3; ++k) EXPECT_LT((read.points[k].p_C - truth.points[k].p_C).norm(), 1e-6f);
  EXPECT_LT((read.G - truth.G).norm(), 1e-5 * truth.G.norm());
  // A keyframe that already has the correction stays unchanged.
  const Eigen::Matrix4d before = read.G;
  setCameraCorrection({-0.01, {}}, &read);
  EXPECT_EQ(read.G, before);
}

// A keyframe of a camera whose intrinsics are wrong, and what it would have been had they been right.
TEST(CameraCorrection, MovesBearingsAndWhatLiesOnThem) {
  const BearingCorrection bearing{{0.004, -0.003, 0.002, 0.001}}, earlier{{0.001, 0.002, -0.001, 0.003}};
  auto keyframe = std::make_shared<Keyframe>();
  Feature feature;
  feature.xy = {0.4f, -0.3f};
  feature.depth = 2.0f;
  keyframe->frame.features = {feature};
  const auto observe = [](const Eigen::Matrix3d& bearings) {
    PlaneObservation observation;
    observation.weight_scale = 0.4;
    for (const Eigen::Vector3d& given : {Eigen::Vector3d(0.3, -0.2, 1), Eigen::Vector3d(-1, 0.2, 2)}) {
      const Eigen::Vector3d p_C = bearings * given;
      observation.G += 0.4 * p_C.homogeneous() * p_C.homogeneous().transpose() / (0.005 * 0.005);
      observation.points.push_back({p_C.cast<float>(), 0.005f});
    }
    return observation;
  };
  PlaneObservation observation = observe(Eigen::Matrix3d::Identity());
  // By way of an intermediate correction.
  KeyframePtr corrected = keyframe;
  for (const BearingCorrection& known : {earlier, bearing}) {
    corrected = withCameraCorrection(corrected, {0, {}, known});
    setCameraCorrection({0, {}, known}, &observation);
  }
  EXPECT_LT((corrected->frame.features[0].xy - bearing(feature.xy)).norm(), 1e-6f);
  EXPECT_NEAR(corrected->frame.features[0].xy.x(), 0.4 + 0.004 * 0.4 + 0.002, 1e-6);
  EXPECT_NEAR(corrected->frame.features[0].xy.y(), -0.3 + 0.003 * 0.3 + 0.001, 1e-6);
  EXPECT_EQ(corrected->frame.features[0].depth, 2.0f);
  const PlaneObservation truth = observe(bearing.matrix());
  for (int k = 0; k < 2; ++k) EXPECT_LT((observation.points[k].p_C - truth.points[k].p_C).norm(), 1e-6f);
  EXPECT_LT((observation.G - truth.G).norm(), 1e-5 * truth.G.norm());
}

TEST(BearingCorrection, TheIntrinsicsItNamesNeedNone) {
  const Eigen::Vector4d given(481.4, 478.9, 320.9, 238.8);
  const BearingCorrection bearing{{0.004, -0.003, 0.002, 0.001}};
  const Eigen::Vector4d right = correctedIntrinsics(given, bearing);
  const Eigen::Vector2d pixel(17, 433);
  const Eigen::Vector2d before = (pixel - given.tail<2>()).cwiseQuotient(given.head<2>());
  const Eigen::Vector2d after = (pixel - right.tail<2>()).cwiseQuotient(right.head<2>());
  EXPECT_LT((bearing(before) - after).norm(), 1e-12);
}

TEST(CameraCorrection, AnotherCurveTakesTheOldOnesPlace) {
  CameraCorrection before{0.004, {}}, after{-0.003, {}};
  before.scale = 1.01;
  after.scale = 0.97;
  for (int k = 0; k < 40; ++k) {
    before.curve.added.push_back(0.004f * std::sin(0.5f * float(k)));
    after.curve.added.push_back(0.006f * std::cos(0.3f * float(k)));
  }
  const auto corrected = [](float reading, const CameraCorrection& c) {
    return float(c.scale) * (reading + c.curve.at(reading)) + float(c.offset);
  };
  auto keyframe = std::make_shared<Keyframe>();
  keyframe->frame.camera_correction = before;
  keyframe->motion.T_a_b = SE3(Eigen::Matrix3d(Eigen::Matrix3d::Identity()), Eigen::Vector3d(0.1, 0.2, -0.3));
  PlaneObservation observation;
  observation.camera_correction = before;
  std::vector<float> readings;
  for (float z = 0.3f; z < 7; z += 0.07f) readings.push_back(z);
  for (const float z : readings) {
    keyframe->frame.depth_grid.z.push_back(corrected(z, before));
    observation.points.push_back({Eigen::Vector3f(0.2f, -0.3f, 1) * corrected(z, before), 0.01f});
  }
  keyframe->frame.depth_grid.z.push_back(0);
  const KeyframePtr other = withCameraCorrection(keyframe, after);
  setCameraCorrection(after, &observation);
  EXPECT_EQ(other->frame.camera_correction, after);
  EXPECT_EQ(observation.camera_correction, after);
  for (std::size_t k = 0; k < readings.size(); ++k) {
    EXPECT_NEAR(other->frame.depth_grid.z[k], corrected(readings[k], after), 2e-6f);
    EXPECT_LT((observation.points[k].p_C - Eigen::Vector3f(0.2f, -0.3f, 1) * corrected(readings[k], after)).norm(),
              4e-6f);
  }
  EXPECT_EQ(other->frame.depth_grid.z.back(), 0.0f);
  EXPECT_LT((other->motion.T_a_b.t() - 0.97 / 1.01 * Eigen::Vector3d(0.1, 0.2, -0.3)).norm(), 1e-12);
  EXPECT_EQ(withCameraCorrection(other, after), other);
}

}  // namespace
}  // namespace vip_slam
