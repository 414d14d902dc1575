// SPDX-License-Identifier: BSD-3-Clause
// Corrections of extrinsics, depth, gyro and intrinsics that the front end learns late apply to all keyframes.
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "back_end/back_end_runs.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/types/camera_correction.h"

using namespace vip_slam;

namespace {

/// The keyframe as published by a front end whose extrinsics are wrong by `error`.
KeyframePtr mountedWrongly(const KeyframePtr& keyframe, const SE3& error) {
  auto wrong = std::make_shared<Keyframe>(*keyframe);
  wrong->frame.T_I_C = keyframe->frame.T_I_C * error;
  const SE3 body = keyframe->frame.T_I_C * wrong->frame.T_I_C.inverse();  // maps the wrong body into the true one
  wrong->frame.state.T_W_I = keyframe->frame.state.T_W_I * body;
  wrong->motion.T_a_b = body.inverse() * keyframe->motion.T_a_b * body;
  return wrong;
}

/// The keyframe of a camera whose depth is `too_long` m too long, as published by a front end that applies
/// `correction`.
KeyframePtr readTooLong(const KeyframePtr& keyframe, double too_long, double correction) {
  auto exact = std::make_shared<Keyframe>(*keyframe);
  exact->frame.camera_correction.offset = -too_long;
  return withCameraCorrection(exact, {correction, {}});
}

PlaneUpdate readTooLong(PlaneUpdate update, double too_long, double correction) {
  for (PlaneObservation& o : update.observations) {
    o.camera_correction.offset = -too_long;
    setCameraCorrection({correction, {}}, &o);
  }
  return update;
}

/// Largest orientation error of a keyframe, degrees, after removing the best common rotation about the vertical.
double worstDirection(const MapSnapshot& snapshot, const SimulatedKeyframes& world) {
  double yaw = 0, worst = 0;
  for (const SnapshotKeyframe& kf : snapshot.keyframes) {
    yaw +=
        yawOf(world.truth(kf.t).T_W_I.rotation() * kf.state.T_W_I.rotation().conjugate()) / snapshot.keyframes.size();
  }
  const Eigen::Quaterniond turn = expQuaternion({0, 0, yaw});
  for (const SnapshotKeyframe& kf : snapshot.keyframes) {
    const Eigen::Quaterniond left = world.truth(kf.t).T_W_I.rotation().conjugate() * (turn * kf.state.T_W_I.rotation());
    worst = std::max(worst, logSO3(left).norm() / kDegree);
  }
  return worst;
}

}  // namespace

// The front end learns the extrinsics in the first keyframes, halving the error each time. The newest estimate has to
// be applied to all: the first keyframes, long fixed, would stay turned by two degrees.
TEST(BackEnd, ExtrinsicsLearntOnTheWayHoldForAllKeyframes) {
  SimulatedKeyframes world(5);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  Eigen::Vector3d turn(0.03, -0.02, 0.02);
  for (int k = 0; k < 40; ++k, turn *= 0.5) {
    back_end.addKeyframe(mountedWrongly(world.next(), SE3(expQuaternion(turn), Eigen::Vector3d::Zero())));
    EXPECT_EQ(back_end.lastRefusal(), "");
    back_end.applyPlaneUpdate(world.planes());
  }
  back_end.finish();
  EXPECT_LT(worstDirection(back_end.snapshot(), world), 0.3);
}

TEST(BackEnd, AGlobalAdjustmentDoesNotBringBackOldExtrinsics) {
  SimulatedKeyframes world(3);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  const SE3 error(expQuaternion({0.02, 0.02, -0.02}), Eigen::Vector3d::Zero());
  for (int k = 0; k < 15; ++k) {
    back_end.addKeyframe(mountedWrongly(world.next(), error));
    back_end.applyPlaneUpdate(world.planes());
  }
  back_end.requestGlobalBa();
  const GbaResult solution = back_end.run(back_end.startGlobalBa());
  feed(&world, &back_end, 3);
  const SE3 T_W_C = back_end.map().keyframe(5).T_W_C();
  const SE3 between = T_W_C.inverse() * back_end.map().keyframe(17).T_W_C();
  back_end.merge(solution);
  // The correction keeps the adjusted camera poses, up to small changes.
  const SE3 after = back_end.map().keyframe(5).T_W_C().inverse() * back_end.map().keyframe(17).T_W_C();
  EXPECT_LT(after.boxminus(between).norm(), 0.01);
}

// Depth reads 3 % too long and the odometry goes by it, until the front end learns the scale at the 16th keyframe: then
// the map has it from its beginning on.
TEST(BackEnd, AScaleOfDepthLearntOnTheWayHoldsForTheWholeMap) {
  SimulatedKeyframes world(4);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  CameraCorrection known;
  const auto length = [&] {  // of the map, against the true one
    double found = 0, truth = 0;
    const SnapshotKeyframe* before = nullptr;
    const MapSnapshot snapshot = back_end.snapshot();
    for (const SnapshotKeyframe& kf : snapshot.keyframes) {
      if (before) {
        found += (kf.state.T_W_I.t() - before->state.T_W_I.t()).norm();
        truth += (world.truth(kf.t).T_W_I.t() - world.truth(before->t).T_W_I.t()).norm();
      }
      before = &kf;
    }
    return found / truth;
  };
  for (int k = 0; k < 30; ++k) {
    auto exact = std::make_shared<Keyframe>(*world.next());
    exact->frame.camera_correction.scale = 1 / 1.03;
    if (k == 15) {
      EXPECT_GT(length(), 1.02);
      known.scale = 1 / 1.03;
    }
    const MapUpdate update = back_end.addKeyframe(withCameraCorrection(exact, known));
    ASSERT_EQ(back_end.lastRefusal(), "");
    EXPECT_EQ(back_end.map().keyframe(1).data->frame.camera_correction, known);
    if (k == 15) EXPECT_TRUE(back_end.globalBaWanted());
    PlaneUpdate planes = world.planes();
    for (PlaneObservation& o : planes.observations) {
      o.camera_correction.scale = 1 / 1.03;
      setCameraCorrection(known, &o);
    }
    back_end.applyPlaneUpdate(planes);
  }
  back_end.finish();
  EXPECT_NEAR(length(), 1.0, 0.005);
}

// Depth reads 2 cm too long; the front end learns it at the 16th keyframe and refines it with each further one.
TEST(BackEnd, ADepthCorrectionHoldsForAllKeyframes) {
  SimulatedKeyframes world(4);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  std::map<KeyframeId, KeyframePtr> exact;
  double correction = 0;
  const auto worst = [&] {
    double error = 0;
    for (const auto& [id, kf] : back_end.map().keyframes()) {
      for (std::size_t k = 0; k < kf.features().size(); ++k)
        error = std::max(error, std::abs(double(kf.features()[k].depth) - exact[id]->frame.features[k].depth));
      for (const auto& [plane, o] : kf.planes) {
        EXPECT_EQ(o.camera_correction, kf.data->frame.camera_correction);
        const Eigen::Vector4d p_C =
            transformPlane(kf.T_W_C().inverse(), back_end.map().planes().at(plane).estimate.plane).coefficients();
        EXPECT_LT(std::sqrt(p_C.dot(o.G * p_C) / o.G(3, 3)), 0.03);
      }
    }
    return error;
  };
  for (int k = 0; k < 30; ++k) {
    const KeyframePtr kf = exact[k + 1] = world.next();
    const bool knows_now = k == 15;
    if (k >= 15) correction = -0.0205 + 0.0001 * (k - 15) / 3;
    const MapUpdate update = back_end.addKeyframe(readTooLong(kf, 0.02, correction));
    ASSERT_EQ(back_end.lastRefusal(), "");
    if (k == 14) EXPECT_NEAR(worst(), 0.02, 1e-4);
    if (knows_now) {
      EXPECT_TRUE(update.global);
      EXPECT_EQ(update.keyframes.size(), back_end.map().keyframes().size());
      for (const KeyframeEstimate& estimate : update.keyframes)
        EXPECT_EQ(estimate.camera_correction.offset, correction);
      EXPECT_LT(worst(), 0.0006);
      EXPECT_TRUE(back_end.globalBaWanted());
      back_end.merge(back_end.run(back_end.startGlobalBa()));
    } else if (k < 22) {  // again once there are half as many keyframes more
      EXPECT_FALSE(back_end.globalBaWanted());
    }
    // Plane updates may still be based on the previous correction.
    back_end.applyPlaneUpdate(readTooLong(world.planes(), 0.02, k % 2 ? correction : 0.0));
  }
  back_end.finish();  // applies the newest correction
  EXPECT_LT(worst(), std::abs(correction + 0.02) + 1e-6);
  double rmse = 0;
  for (const SnapshotKeyframe& kf : back_end.snapshot().keyframes)
    rmse += (kf.state.T_W_I.t() - world.truth(kf.t).T_W_I.t()).squaredNorm() / 30;
  const double known = std::sqrt(rmse);
  const double never_wrong = run("vip", 30, 4).rmse;
  std::printf("rmse %.2f mm, with exact depth %.2f mm\n", 1e3 * known, 1e3 * never_wrong);
  EXPECT_LT(known, never_wrong + 0.001);
}

/// As from a gyro that measures 5 % too much and a front end that applies `correction`.
KeyframePtr turningTooFast(const KeyframePtr& keyframe, double correction) {
  auto kf = std::make_shared<Keyframe>(*keyframe);
  for (ImuSample& sample : kf->imu) sample.gyro *= 1.05;
  kf->gyro_correction = correction * Eigen::Matrix3d::Identity();
  return kf;
}

TEST(BackEnd, AGyroCorrectionHoldsForAllKeyframes) {
  const auto rmse = [](bool tells) {
    SimulatedKeyframes world(4);
    BackEndOptions inertial = options("vip");
    inertial.measurement.use_odometry = false;  // with it the map hardly follows a wrong gyro
    CheckedBackEnd back_end(inertial, world.sensor());
    double correction = 0;
    for (int k = 0; k < 30; ++k) {
      if (tells && k >= 15) correction = 1 / 1.05 - 1 + 1e-5 * (k - 15);
      back_end.addKeyframe(turningTooFast(world.next(), correction));
      EXPECT_EQ(back_end.lastRefusal(), "");
      EXPECT_EQ(back_end.globalBaWanted(), tells && (k == 15 || k == 23)) << k;
      if (back_end.globalBaWanted()) back_end.merge(back_end.run(back_end.startGlobalBa()));
      back_end.applyPlaneUpdate(world.planes());
    }
    back_end.finish();  // applies the newest correction
    double sum = 0;
    for (const auto& [id, kf] : back_end.map().keyframes()) {
      EXPECT_EQ(kf.gyro_correction(1, 1), correction);
      sum += (kf.state.T_W_I.t() - world.truth(kf.data->frame.t).T_W_I.t()).squaredNorm() / 30;
    }
    return std::sqrt(sum);
  };
  const double known = rmse(true), believed = rmse(false), exact = run("vip", 30, 4).rmse;
  std::printf("rmse %.2f mm, with an exact gyro %.2f, the gyro believed %.2f mm\n", 1e3 * known, 1e3 * exact,
              1e3 * believed);
  EXPECT_LT(known, exact + 0.001);
  EXPECT_GT(believed, known + 0.0005);
}

// Shocks of 20 ms that the accelerometer measures wrongly; the odometry, thanks to images, was not affected.
TEST(BackEnd, AnImuThatTheOdometryContradictsDoesNotBendTheMap) {
  double square = 0, worst = 0;
  for (const unsigned seed : {4u, 5u, 6u}) {
    SimulatedKeyframes world(seed);
    CheckedBackEnd back_end(options("vip"), world.sensor());
    for (int k = 0; k < 60; ++k) {
      auto kf = std::make_shared<Keyframe>(*world.next());
      if (k % 10 == 7)
        for (int s = 20; s < 24; ++s) kf->imu[s].accel.x() -= 25.0;  // 0.5 m/s
      back_end.addKeyframe(kf);
      back_end.applyPlaneUpdate(world.planes());
      const double scale = back_end.map().keyframe(kf->id).imu_noise_scale.density;
      if (k % 10 == 7) EXPECT_GT(scale, 3.0) << k;
      if (k % 10 != 7) EXPECT_LT(scale, 2.5) << k;
    }
    back_end.finish();
    for (const auto& [id, kf] : back_end.map().keyframes()) {
      const double error = (kf.state.T_W_I.t() - world.truth(kf.data->frame.t).T_W_I.t()).norm();
      worst = std::max(worst, error);
      square += error * error / 180;
    }
  }
  std::printf("with blows: rmse %.1f mm, worst %.1f\n", 1e3 * std::sqrt(square), 1e3 * worst);
  EXPECT_LT(worst, 0.01);  // 0.04 if the IMU were trusted fully
}

TEST(BackEnd, AKeyframeTellsHowNoisyItsImuIs) {
  SimulatedKeyframes world(3);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 3; ++k) {
    auto kf = std::make_shared<Keyframe>(*world.next());
    if (k == 2) kf->imu_noise_scale.density = 4;
    back_end.addKeyframe(kf);
  }
  const Matrix15d &as_told = back_end.map().keyframe(2).preintegration->covariance(),
                  &wider = back_end.map().keyframe(3).preintegration->covariance();
  EXPECT_NEAR(wider.trace() / as_told.trace(), 16.0, 2.0);
  auto bad = std::make_shared<Keyframe>(*world.next());
  bad->imu_noise_scale.density = 0;
  back_end.addKeyframe(bad);
  EXPECT_NE(back_end.lastRefusal().find("scale of the IMU's noise"), std::string::npos) << back_end.lastRefusal();
}

TEST(BackEnd, AGlobalAdjustmentOfAGyroAsItMeasuredIsDoneAgain) {
  SimulatedKeyframes world(3);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 12; ++k) back_end.addKeyframe(turningTooFast(world.next(), 0));
  const GbaResult before = back_end.run(back_end.startGlobalBa());
  back_end.addKeyframe(turningTooFast(world.next(), -0.048));
  back_end.startGlobalBa();
  EXPECT_FALSE(back_end.merge(before).global);
  EXPECT_TRUE(back_end.globalBaWanted());
}

// Focal lengths 0.4 % too long, principal point a pixel off; the front end knows from the 15th keyframe on.
TEST(BackEnd, IntrinsicsThatAreKnownBetterHoldForAllKeyframes) {
  SimulatedKeyframes world(4);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  const BearingCorrection bearing{{0.004, 0.004, 0.002, -0.001}};
  std::map<KeyframeId, KeyframePtr> exact;
  const auto worst = [&] {
    double error = 0;
    for (const auto& [id, kf] : back_end.map().keyframes()) {
      for (std::size_t k = 0; k < kf.features().size(); ++k)
        error = std::max(error, double((kf.features()[k].xy - exact[id]->frame.features[k].xy).cwiseAbs().maxCoeff()));
    }
    return error;
  };
  for (int k = 0; k < 30; ++k) {
    const KeyframePtr kf = exact[k + 1] = world.next();
    // What this camera sees, with the correction known so far.
    auto seen = std::make_shared<Keyframe>(*kf);
    seen->frame.camera_correction.bearing = bearing;
    const MapUpdate update =
        back_end.addKeyframe(withCameraCorrection(seen, {0, {}, k >= 15 ? bearing : BearingCorrection()}));
    ASSERT_EQ(back_end.lastRefusal(), "");
    if (k == 14) EXPECT_GT(worst(), 0.002);
    if (k != 15) continue;
    EXPECT_TRUE(update.global);
    EXPECT_TRUE(back_end.globalBaWanted());
    for (const KeyframeEstimate& estimate : update.keyframes) EXPECT_EQ(estimate.camera_correction.bearing, bearing);
    EXPECT_LT(worst(), 1e-6);
  }
  EXPECT_LT(worst(), 1e-6);
}

// On real images the intrinsics that the front end tells wander with every keyframe.
TEST(BackEnd, AWanderingCorrectionAsksForFewAdjustments) {
  SimulatedKeyframes world(4);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  int adjustments = 0;
  BearingCorrection bearing;
  for (int k = 0; k < 57; ++k) {
    bearing.value.setConstant(k % 2 ? 0.001 : 0.0005);
    back_end.addKeyframe(withCameraCorrection(world.next(), {0, {}, bearing}));
    ASSERT_EQ(back_end.lastRefusal(), "");
    if (!back_end.globalBaWanted()) continue;
    ++adjustments;
    back_end.merge(back_end.run(back_end.startGlobalBa()));
  }
  EXPECT_GE(adjustments, 4);
  EXPECT_LE(adjustments, 10);
  back_end.finish();  // adopts the newest
  for (const auto& [id, kf] : back_end.map().keyframes()) EXPECT_EQ(kf.data->frame.camera_correction.bearing, bearing);
}

TEST(BackEnd, AGlobalAdjustmentOfDepthAsItWasReadIsDoneAgain) {
  SimulatedKeyframes world(3);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 12; ++k) back_end.addKeyframe(readTooLong(world.next(), 0.02, 0));
  const GbaResult before = back_end.run(back_end.startGlobalBa());
  back_end.addKeyframe(readTooLong(world.next(), 0.02, -0.02));
  back_end.startGlobalBa();
  EXPECT_FALSE(back_end.merge(before).global);
  EXPECT_TRUE(back_end.globalBaWanted());
}
