// SPDX-License-Identifier: BSD-3-Clause
// The facade on rendered images of a textured wall: a whole run, bitwise repeatability, rest, feedback from a map.
#include <cmath>
#include <map>
#include <random>

#include <Eigen/Eigenvalues>

#include "vip_slam_core/depth/disparity_curve.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/types/session_numbers.h"
#include "wall_world.h"

namespace vip_slam {
namespace {

TEST_F(FrontEndTest, WholeRunFollowsAndHandsOnKeyframes) {
  EXPECT_FALSE(front_end_.ready(0.5));
  FrameOutput output = run(0.0, 0.1);
  EXPECT_EQ(output.frame->status.state, TrackingState::kInitialising);
  EXPECT_FALSE(output.frame->status.reason.empty());
  EXPECT_FALSE(front_end_.predict(0.1));
  output = run(0.1, 0.5);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << output.frame->status.reason;
  output = run(0.5, 6.0);
  EXPECT_TRUE(front_end_.ready(5.95));
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << output.frame->status.reason;
  EXPECT_LT(error(output), 0.01);
  EXPECT_GT(output.frame->features.size(), 80u);
  EXPECT_FALSE(output.frame->depth_grid.empty());
  const auto eigenvalues = output.frame->covariance.selfadjointView<Eigen::Lower>().eigenvalues();
  EXPECT_GT(eigenvalues.minCoeff(), 0.0);

  ASSERT_GT(keyframes_.size(), 4u);
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    const Keyframe& keyframe = *keyframes_[i];
    EXPECT_EQ(keyframe.id, i + 1);
    EXPECT_EQ(keyframe.previous, i);
    EXPECT_EQ(keyframe.frame.depth_grid.stride, options().keyframe_grid_stride / 2) << "an image of 320 px";
    if (i > 0) {
      ASSERT_GT(keyframe.imu.size(), 2u);
      EXPECT_NEAR(keyframe.imu.front().t, keyframes_[i - 1]->frame.state.t, 1e-9);
      EXPECT_NEAR(keyframe.imu.back().t, keyframe.frame.state.t, 1e-9);
      ASSERT_TRUE(keyframe.motion.isUsable());
      const double way = (World::position(keyframe.frame.t) - World::position(keyframes_[i - 1]->frame.t)).norm();
      EXPECT_NEAR(keyframe.motion.T_a_b.t().norm(), way, 4e-3);
      const SE3& T_I_C = keyframe.frame.T_I_C;
      const SE3 chained = keyframes_[i - 1]->frame.T_chain_C.inverse() * keyframe.frame.T_chain_C;
      EXPECT_LT(chained.boxminus(T_I_C.inverse() * keyframe.motion.T_a_b * T_I_C).norm(), 1e-9);
      EXPECT_LT(std::sqrt(keyframe.motion.covariance.bottomRightCorner<3, 3>().diagonal().maxCoeff()), 0.02);
    } else {
      EXPECT_FALSE(keyframe.motion.known());
    }
    int described = 0, untracked = 0;
    for (const Feature& f : keyframe.frame.features) {
      described += f.descriptor != Descriptor{};
      untracked += f.id == kNoLandmark;
      EXPECT_NEAR(f.depth, kWall - World::position(keyframe.frame.t).x(), 0.01);
    }
    EXPECT_EQ(described, static_cast<int>(keyframe.frame.features.size()));
    EXPECT_GT(untracked, 10);
  }
  // Prediction extrapolates from the last image with the IMU.
  feedImu(6.1);
  const auto predicted = front_end_.predict(6.05);
  ASSERT_TRUE(predicted);
  EXPECT_LT((predicted->T_W_I.t() - World::position(6.05)).norm(), 0.02);
}

TEST_F(FrontEndTest, ThePoseIsToldBeforeTheRestAndIsTheOneReturned) {
  run(0.0, 2.0);
  for (int k = 40; k < 60; ++k) {
    const double t = 0.05 * k;
    feedImu(t);
    std::vector<TrackedFrame> told;
    const FrameOutput output = front_end_.process({t, world_.image(t), World::depth(t)},
                                                  [&told](const TrackedFrame& frame) { told.push_back(frame); });
    ASSERT_EQ(told.size(), 1u);
    EXPECT_EQ(told[0].t, t);
    EXPECT_EQ(told[0].status.state, output.frame->status.state);
    EXPECT_EQ(told[0].state.T_W_I.matrix(), output.frame->state.T_W_I.matrix());
    EXPECT_EQ(told[0].covariance, output.frame->covariance);
  }
  const FrameOutput bad = front_end_.process({std::nan(""), world_.image(3.0), cv::Mat()},
                                             [](const TrackedFrame&) { FAIL() << "told a pose that is not known"; });
  EXPECT_FALSE(bad.frame->status.reason.empty());
}

TEST_F(FrontEndTest, DepthIsHandedOnAsWhatItMeans) {
  FrameOutput output;
  KeyframePtr keyframe;
  double t = 0;
  for (int k = 0; k < 400; ++k) {
    t = 0.05 * k;
    feedImu(t + 0.05);
    output = front_end_.process({t, world_.image(t), World::depth(t) + 0.015});
    if (output.keyframe) keyframe = output.keyframe;
    if (output.keyframe && output.frame->camera_correction.offset != 0) break;
  }
  ASSERT_TRUE(output.keyframe);
  const double offset = front_end_.calibration().depth_offset;
  EXPECT_LT(offset, -0.001);
  EXPECT_EQ(output.frame->camera_correction.offset, offset);
  EXPECT_EQ(keyframe->frame.camera_correction.offset, offset);
  const double z = kWall - World::position(t).x() + 0.015 + offset;
  for (const Feature& f : keyframe->frame.features) EXPECT_NEAR(f.depth, z, 5e-4);
  for (const Feature& f : output.frame->features) EXPECT_NEAR(f.depth, z, 5e-4);
  EXPECT_NEAR(keyframe->frame.depth_grid.at(20, 20), z, 5e-4);
  EXPECT_NEAR(output.frame->depth_grid.at(10, 10), z, 5e-4);
}

TEST_F(FrontEndTest, DepthHasWhatTheMapFoundOutAboutItsCamera) {
  run(0.0, 2.0);
  MapUpdate update;
  update.depth_curve.added.assign(60, 0.02f);
  update.depth_curve.added[0] = 0.01f;
  front_end_.applyMapUpdate(update);
  feedImu(2.05);
  const cv::Mat read = World::depth(2.05);
  const cv::Mat before = read.clone();
  FrameOutput output = front_end_.process({2.05, world_.image(2.05), read});
  EXPECT_EQ(output.frame->camera_correction.curve, update.depth_curve);
  const double z = kWall - World::position(2.05).x() + 0.02 + output.frame->camera_correction.offset;
  EXPECT_NEAR(output.frame->depth_grid.at(10, 10), z, 5e-4);
  EXPECT_EQ(cv::norm(read, before, cv::NORM_INF), 0.0);  // the caller's image is unchanged
  // An implausible curve is ignored.
  update.depth_curve.added[3] = std::nanf("");
  front_end_.applyMapUpdate(update);
  feedImu(2.10);
  output = front_end_.process({2.10, world_.image(2.10), World::depth(2.10)});
  EXPECT_FLOAT_EQ(output.frame->camera_correction.curve.at(3.0f), 0.02f);
}

// A constant disparity error looks like a depth offset until the map distinguishes the two.
TEST_F(FrontEndTest, AnOffsetThatStoodForDisparitiesIsNoneAnyMore) {
  double t = 0;
  const auto go = [&](int images, double too_long) {
    FrameOutput output;
    for (int k = 0; k < images; ++k, t += 0.05) {
      feedImu(t + 0.05);
      output = front_end_.process({t, world_.image(t), World::depth(t) + too_long});
    }
    return output;
  };
  const auto goUntilFound = [&] {
    for (int k = 0; k < 20 && !(front_end_.calibration().depth_offset < -0.001); ++k) go(20, 0.015);
  };
  goUntilFound();
  ASSERT_LT(front_end_.calibration().depth_offset, -0.001);
  MapUpdate update;
  update.depth_curve = disparityCurve(-0.002, 8);
  update.disparity_error = -0.002;
  front_end_.applyMapUpdate(update);
  EXPECT_EQ(front_end_.calibration().depth_offset, 0.0);
  FrameOutput output = go(20, 0.015);
  EXPECT_LT(std::abs(front_end_.calibration().depth_offset), 1e-6);
  EXPECT_EQ(output.frame->camera_correction, (CameraCorrection{0.0, update.depth_curve}));
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking);
  // A further change by a hundredth has no effect; a new map has no knowledge of it.
  update.depth_curve = disparityCurve(-0.00202, 8);
  update.disparity_error = -0.00202;
  front_end_.applyMapUpdate(update);
  EXPECT_LT(front_end_.calibration().sigma_depth_offset, 1e-5);
  front_end_.applyMapUpdate(MapUpdate());
  EXPECT_NEAR(front_end_.calibration().sigma_depth_offset, FilterOptions().calibration.sigma_depth_offset, 1e-9);
  goUntilFound();
  EXPECT_LT(front_end_.calibration().depth_offset, -0.001);
}

// What the map finds of the odometry's error is in the covariance, and in nothing else.
TEST_F(FrontEndTest, TheMapsFactorIsOnThePublishedCovarianceAlone) {
  FrontEndOptions fixed = options();
  fixed.filter.calibration.depth_scale = false;  // what is found of it is in the covariance as well
  FrontEnd without(fixed, sensor()), updated(fixed, sensor());
  for (double t = 0; t < 2.1; t += 0.005) {
    without.addImu(World::imu(t));
    updated.addImu(World::imu(t));
  }
  MapUpdate update;
  update.odometry_variance = 9;
  Matrix15d alone, with;
  for (int k = 0; k < 40; ++k) {
    const double t = 0.05 * k;
    if (k == 30) updated.applyMapUpdate(update);
    alone = without.process({t, world_.image(t), World::depth(t)}).frame->covariance;
    with = updated.process({t, world_.image(t), World::depth(t)}).frame->covariance;
  }
  EXPECT_GT(alone.norm(), 0);
  EXPECT_LT((with - 9 * alone).norm(), 1e-12 * with.norm());
}

// However far the map is moved against the odometry, the odometry goes on to the last bit.
TEST_F(FrontEndTest, ACorrectionOfTheMapDoesNotMoveTheOdometry) {
  FrontEnd untouched(options(), sensor());
  for (double t = 0; t < 4.1; t += 0.005) untouched.addImu(World::imu(t));
  MapUpdate update;
  update.newest_keyframe = 1;
  for (int k = 0; k < 80; ++k) {
    const double t = 0.05 * k;
    const FrameOutput output = step(t);
    const FrameOutput expected = untouched.process({t, world_.image(t), World::depth(t)});
    ASSERT_EQ(output.frame->state.T_W_I.matrix(), expected.frame->state.T_W_I.matrix()) << t;
    EXPECT_EQ(output.frame->state.v_W, expected.frame->state.v_W) << t;
    if (k < 40) continue;
    update.epoch = output.frame->epoch;
    update.T_map_odom = SE3(expQuaternion(Eigen::Vector3d(0, 0, 0.02 * k)), Eigen::Vector3d(0.1 * k, -1, 0.3));
    front_end_.applyMapUpdate(update);
  }
}

// A change of the depth calibration must not look like motion.
TEST_F(FrontEndTest, ADepthCurveDoesNotMoveThePose) {
  FrameOutput output = run(0.0, 4.0);
  const auto off = [&] { return output.frame->state.T_W_I.t().x() - World::position(output.frame->t).x(); };
  const double before = off();
  MapUpdate update;
  update.depth_curve.added.assign(60, -0.006f);
  front_end_.applyMapUpdate(update);
  double worst = 0;
  for (int k = 80; k < 84; ++k) {
    output = step(0.05 * k);
    worst = std::max(worst, std::abs(off() - before));
  }
  EXPECT_LT(worst, 0.002);
}

// Readings already include the offset of the sensor file when they arrive; the estimated offset comes on top.
TEST_F(FrontEndTest, TheDepthOffsetIsTheConfiguredOneAndWhatWasFound) {
  SensorConfig known = sensor();
  known.depth_offset = -0.03;
  FrontEnd front_end(options(), known);
  EXPECT_EQ(front_end.givenCalibration().depth_offset, -0.03);
  EXPECT_TRUE(calibrationDifferences(front_end.givenCalibration(), front_end.calibration()).empty());
  double imu_t = 0;
  for (int k = 0; k < 400 && !(front_end_.calibration().depth_offset < -0.001); ++k) {
    const double t = 0.05 * k;
    for (; imu_t < t + 0.05; imu_t += 0.005) {
      front_end.addImu(World::imu(imu_t));
      front_end_.addImu(World::imu(imu_t));
    }
    front_end.process({t, world_.image(t), World::depth(t) + 0.015});
    front_end_.process({t, world_.image(t), World::depth(t) + 0.015});
  }
  EXPECT_LT(front_end_.calibration().depth_offset, -0.001);
  EXPECT_NEAR(front_end.calibration().depth_offset, front_end_.calibration().depth_offset - 0.03, 1e-9);
}

// Likewise for the gyro's rates.
TEST_F(FrontEndTest, TheGyroCorrectionIsTheConfiguredOneAndWhatWasFound) {
  SensorConfig known = sensor();
  known.gyro_correction << 0.05, 0.01, 0, -0.02, -0.1, 0.03, 0.01, 0, 0.08;
  const Eigen::Matrix3d measures = (Eigen::Matrix3d::Identity() + known.gyro_correction).inverse();
  FrontEnd front_end(options(), known);
  EXPECT_EQ(front_end.givenCalibration().gyro_correction, known.gyro_correction);
  EXPECT_TRUE(calibrationDifferences(front_end.givenCalibration(), front_end.calibration()).empty());
  double imu_t = 0;
  int keyframes = 0;
  for (int k = 0; k < 120; ++k) {
    const double t = 0.05 * k;
    for (; imu_t < t + 0.05; imu_t += 0.005) {
      ImuSample sample = World::imu(imu_t);
      front_end_.addImu(sample);
      sample.gyro = measures * sample.gyro;
      front_end.addImu(sample);
    }
    const FrameOutput a = front_end_.process({t, world_.image(t), World::depth(t)});
    const FrameOutput b = front_end.process({t, world_.image(t), World::depth(t)});
    EXPECT_LT(a.frame->state.T_W_I.boxminus(b.frame->state.T_W_I).norm(), 1e-6);
    ASSERT_EQ(a.keyframe != nullptr, b.keyframe != nullptr);
    if (!a.keyframe || a.keyframe->imu.empty()) continue;
    EXPECT_LT((a.keyframe->imu.back().gyro - b.keyframe->imu.back().gyro).norm(), 1e-12);
    ++keyframes;
  }
  EXPECT_GT(keyframes, 0);
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d both = (I + front_end_.calibration().gyro_correction) * (I + known.gyro_correction) - I;
  EXPECT_LT((front_end.calibration().gyro_correction - both).norm(), 1e-6);
}

TEST_F(FrontEndTest, TwoRunsAgreeBitByBit) {
  const FrameOutput a = run(0.0, 3.0);
  FrontEnd other(options(), sensor());
  double imu_t = 0;
  FrameOutput b;
  for (int k = 0; k < 60; ++k) {
    for (; imu_t < 0.05 * k + 0.02; imu_t += 0.005) other.addImu(World::imu(imu_t));
    b = other.process({0.05 * k, world_.image(0.05 * k), World::depth(0.05 * k)});
  }
  EXPECT_EQ(a.frame->state.T_W_I.t(), b.frame->state.T_W_I.t());
  EXPECT_EQ(a.frame->covariance, b.frame->covariance);
}

TEST_F(FrontEndTest, ALaterStartOfItHasNumbersOfItsOwn) {
  const SessionNumbers first = firstNumbers(1), next = firstNumbers(2);
  FrontEnd second(options(), sensor(), nullptr, 1.0, 1);
  double imu_t = 0;
  std::size_t features = 0;
  std::vector<KeyframePtr> keyframes;
  for (int k = 0; k < 60; ++k) {
    for (; imu_t < 0.05 * k + 0.02; imu_t += 0.005) second.addImu(World::imu(imu_t));
    const FrameOutput output = second.process({0.05 * k, world_.image(0.05 * k), World::depth(0.05 * k)});
    EXPECT_EQ(output.frame->epoch, first.epoch);
    features += output.frame->features.size();
    for (const Feature& f : output.frame->features) EXPECT_TRUE(f.id >= first.landmark && f.id < next.landmark) << f.id;
    if (output.keyframe) keyframes.push_back(output.keyframe);
  }
  EXPECT_GT(features, 0u);
  ASSERT_FALSE(keyframes.empty());
  EXPECT_EQ(keyframes.front()->id, first.keyframe);
  EXPECT_EQ(keyframes.front()->previous, 0u);
}

TEST_F(FrontEndTest, StandsStillForAMinuteUnderNoise) {
  const cv::Mat clean = world_.image(0.0);
  cv::RNG random(3);
  std::mt19937 engine(4);
  std::normal_distribution<double> normal(0.0, 1.0);
  FrameOutput output;
  std::size_t keyframes = 0;
  for (int k = 0; k < 600; ++k) {
    const double t = 0.1 * k;
    for (; imu_t_ < t + 0.02; imu_t_ += 0.005) {
      ImuSample sample = World::imu(0.0);
      sample.t = imu_t_;
      sample.accel += Eigen::Vector3d(0.02, -0.03, 0.01);
      for (int i = 0; i < 3; ++i) {
        sample.gyro(i) += 0.014 * normal(engine);
        sample.accel(i) += 0.14 * normal(engine);
      }
      front_end_.addImu(sample);
    }
    cv::Mat noise(clean.size(), CV_16S), sum;
    random.fill(noise, cv::RNG::NORMAL, 0, 3.0);
    cv::add(clean, noise, sum, cv::noArray(), CV_8U);
    output = front_end_.process({t, sum, World::depth(0.0)});
    keyframes += output.keyframe != nullptr;
  }
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking);
  EXPECT_TRUE(output.frame->zero_velocity);
  EXPECT_LT(output.frame->state.T_W_I.t().norm(), 0.005);
  EXPECT_LT(std::abs(yawOf(output.frame->state.T_W_I.rotation())), 0.2 * kDegree);
  EXPECT_LE(keyframes, 3u);
}

TEST_F(FrontEndTest, MapUpdateBringsLandmarksBackWithoutMovingOdom) {
  FrameOutput output = run(0.0, 4.0);
  // A map as a back end would have it, in a frame rotated and shifted against odom.
  MapUpdate update;
  update.T_map_odom = SE3(expQuaternion(Eigen::Vector3d(0, 0, 0.5)), Eigen::Vector3d(3, -1, 0.5));
  update.newest_keyframe = keyframes_.back()->id;
  std::map<LandmarkId, bool> known;
  for (const KeyframePtr& keyframe : keyframes_) {
    const SE3 T_map_C = update.T_map_odom * keyframe->frame.state.T_W_I * keyframe->frame.T_I_C;
    for (const Feature& f : keyframe->frame.features) {
      if (f.id == kNoLandmark || known[f.id]) continue;
      known[f.id] = true;
      LandmarkEstimate landmark;
      landmark.id = f.id;
      landmark.p_W = T_map_C * (f.xy.homogeneous().cast<double>() * f.depth);
      landmark.observations = 5;
      landmark.descriptor = f.descriptor;
      update.landmarks.push_back(landmark);
    }
  }
  const std::optional<NavState> before = front_end_.predict(4.0);
  front_end_.applyMapUpdate(update);
  ASSERT_TRUE(before);
  EXPECT_EQ(front_end_.predict(4.0)->T_W_I.t(), before->T_W_I.t());
  // Darkness ends all tracks; afterwards some are found again under their old ids.
  run(4.0, 4.3, true, false);
  output = run(4.3, 6.0);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking);
  EXPECT_GT(front_end_.counters().landmarks_reacquired, 10u);
  // ... at the right places: each is on the wall point of the map's landmark.
  std::map<LandmarkId, Eigen::Vector3d> map;
  for (const LandmarkEstimate& landmark : update.landmarks) map[landmark.id] = landmark.p_W;
  const SE3 T_C_map = (update.T_map_odom * output.frame->state.T_W_I * output.frame->T_I_C).inverse();
  int back = 0;
  for (const Feature& f : output.frame->features) {
    if (!map.count(f.id)) continue;
    const Eigen::Vector3d p = T_C_map * map[f.id];
    EXPECT_LT((p.head<2>() / p.z() - f.xy.cast<double>()).norm() * kFocal, 6.0);
    ++back;
  }
  EXPECT_GT(back, 5);

  // After a reset of the odometry they are found too, once the back end reports its pose in the map.
  const std::uint64_t reacquired = front_end_.counters().landmarks_reacquired;
  front_end_.reset("of the test");
  output = run(6.0, 9.0);
  ASSERT_EQ(output.frame->status.state, TrackingState::kTracking);
  update.epoch = output.frame->epoch;
  const SE3 T_world_odom(Eigen::Quaterniond::Identity(),
                         World::position(output.frame->t) - output.frame->state.T_W_I.t());
  update.T_map_odom = update.T_map_odom * T_world_odom;
  front_end_.applyMapUpdate(update);
  run(9.0, 9.3, true, false);
  run(9.3, 10.5);
  EXPECT_GT(front_end_.counters().landmarks_reacquired, reacquired + 10);

  // A loaded map replaces it: no landmark of it is searched for before the back end knows the odometry's pose in it ...
  MapUpdate loaded = update;
  loaded.epoch = 1u << 31;
  loaded.global = true;
  front_end_.applyMapUpdate(loaded);
  const std::uint64_t until = front_end_.counters().landmarks_reacquired;
  run(10.5, 10.8, true, false);
  run(10.8, 12.0);
  EXPECT_EQ(front_end_.counters().landmarks_reacquired, until);
  // ... and none of the old map afterwards.
  loaded.epoch = update.epoch;
  loaded.landmarks.clear();
  front_end_.applyMapUpdate(loaded);
  run(12.0, 12.3, true, false);
  run(12.3, 13.5);
  EXPECT_EQ(front_end_.counters().landmarks_reacquired, until);
  front_end_.forgetMap();
}

TEST(FrontEndConstruction, RefusesAnUnusableCamera) {
  SensorConfig config = sensor();
  config.camera.fx = 0;
  EXPECT_THROW(FrontEnd(options(), config), std::invalid_argument);
}

}  // namespace
}  // namespace vip_slam
