// The facade on rendered images of a textured wall: a whole run, bad input, missing depth, darkness, gaps, clock jumps,
// and feedback from a map.
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "vip_slam_frontend/front_end.h"

namespace vip_slam {
namespace {

constexpr double kFocal = 200, kCx = 159.5, kCy = 119.5, kWall = 2.5, kStill = 1.2;

/// The body stands for a while, then sways in front of a wall at x = kWall without turning.
struct World {
  cv::Mat texture;
  World() : texture(1200, 2000, CV_8U) {
    cv::RNG random(5);
    random.fill(texture, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(texture, texture, cv::Size(), 4.0);
    cv::normalize(texture, texture, 0, 255, cv::NORM_MINMAX);
  }
  static Eigen::Vector3d position(double t) {
    const double s = std::max(0.0, t - kStill), ramp = 1.0 - std::exp(-s * s);
    return ramp * Eigen::Vector3d(0.3 * std::sin(1.1 * s), 0.6 * std::sin(0.9 * s), 0.25 * std::sin(1.6 * s));
  }
  static ImuSample imu(double t) {
    const double h = 1e-3;
    ImuSample sample;
    sample.t = t;
    sample.gyro = Eigen::Vector3d(1e-3, -2e-3, 1e-3);
    sample.accel = (position(t - h) - 2 * position(t) + position(t + h)) / (h * h) + gravityVector();
    return sample;
  }
  cv::Mat image(double t) const {
    const Eigen::Vector3d p = position(t);
    const double z = kWall - p.x();
    cv::Mat_<float> mx(240, 320), my(240, 320);
    for (int v = 0; v < 240; ++v) {
      for (int u = 0; u < 320; ++u) {
        const double y = p.y() - (u - kCx) / kFocal * z, up = p.z() - (v - kCy) / kFocal * z;
        mx(v, u) = static_cast<float>(1000 - 180 * y);
        my(v, u) = static_cast<float>(600 - 180 * up);
      }
    }
    cv::Mat result;
    cv::remap(texture, result, mx, my, cv::INTER_LINEAR, cv::BORDER_REFLECT);
    return result;
  }
  static cv::Mat depth(double t) {
    return cv::Mat(240, 320, CV_32FC1, cv::Scalar(kWall - position(t).x()));
  }
  /// The same wall with a floor 0.9 m below and another wall 1.1 m to the left: three directions that depth alone
  /// holds.
  static cv::Mat cornerDepth(double t) {
    const Eigen::Vector3d p = position(t);
    cv::Mat_<float> depth(240, 320);
    for (int v = 0; v < 240; ++v) {
      for (int u = 0; u < 320; ++u) {
        const double left = -(u - kCx) / kFocal, down = (v - kCy) / kFocal;
        double z = kWall - p.x();
        if (left > 0) z = std::min(z, (1.1 - p.y()) / left);
        if (down > 0) z = std::min(z, (0.9 + p.z()) / down);
        depth(v, u) = static_cast<float>(z);
      }
    }
    return depth;
  }
};

SensorConfig sensor() {
  SensorConfig config;
  config.camera.width = 320;
  config.camera.height = 240;
  config.camera.fx = config.camera.fy = kFocal;
  config.camera.cx = kCx;
  config.camera.cy = kCy;
  Eigen::Matrix3d R_I_C;
  R_I_C << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  config.T_imu_cam = SE3(R_I_C, Eigen::Vector3d::Zero());
  config.imu_noise = {1e-3, 1e-5, 1e-2, 1e-4};
  return config;
}

FrontEndOptions options() {
  FrontEndOptions o;
  o.tracking.max_features = 120;
  o.tracking.min_distance = 10;
  o.tracking.keyframe_corners = 60;
  return o;
}

class FrontEndTest : public ::testing::Test {
 protected:
  FrontEndTest() : front_end_(options(), sensor()) {}

  void feedImu(double until) {
    for (; imu_t_ < until + 0.02; imu_t_ += 0.005) front_end_.addImu(World::imu(imu_t_));
  }
  FrameOutput step(double t, bool dark = false, bool with_depth = true) {
    feedImu(t);
    FrameInput input{t + shift_, dark ? cv::Mat(240, 320, CV_8U, cv::Scalar(3)) : world_.image(t),
                     with_depth ? World::depth(t) : cv::Mat()};
    return front_end_.process(input);
  }
  FrameOutput run(double from, double to, bool dark = false, bool with_depth = true) {
    FrameOutput last;
    for (int k = static_cast<int>(std::lround(from * 20)); k < std::lround(to * 20); ++k) {
      last = step(0.05 * k, dark, with_depth);
      if (last.keyframe) keyframes_.push_back(last.keyframe);
    }
    return last;
  }
  static double error(const FrameOutput& output) {
    return (output.frame->state.T_W_I.t() - World::position(output.frame->t)).norm();
  }

  World world_;
  FrontEnd front_end_;
  std::vector<KeyframePtr> keyframes_;
  double imu_t_ = 0, shift_ = 0;
};

TEST_F(FrontEndTest, WholeRunFollowsAndHandsOnKeyframes) {
  EXPECT_FALSE(front_end_.ready(0.5));
  FrameOutput output = run(0.0, 0.5);
  EXPECT_EQ(output.frame->status.state, TrackingState::kInitialising);
  EXPECT_FALSE(output.frame->status.reason.empty());
  EXPECT_FALSE(front_end_.predict(0.5));
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
    EXPECT_EQ(keyframe.frame.depth_grid.stride, options().keyframe_grid_stride);
    if (i > 0) {
      ASSERT_GT(keyframe.imu.size(), 2u);
      EXPECT_NEAR(keyframe.imu.front().t, keyframes_[i - 1]->frame.t, 1e-9);
      EXPECT_NEAR(keyframe.imu.back().t, keyframe.frame.t, 1e-9);
      ASSERT_TRUE(keyframe.motion.isUsable());
      const double way = (World::position(keyframe.frame.t) - World::position(keyframes_[i - 1]->frame.t)).norm();
      EXPECT_NEAR(keyframe.motion.T_a_b.t().norm(), way, 4e-3);
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
  // Prediction runs ahead of the last image with the IMU.
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

TEST_F(FrontEndTest, BadInputIsCountedNamedAndSurvived) {
  run(0.0, 3.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  feedImu(3.1);
  const auto reason = [&](const FrameInput& input) {
    const FrameOutput output = front_end_.process(input);
    EXPECT_EQ(output.keyframe, nullptr);
    EXPECT_NE(output.frame->status.state, TrackingState::kTracking);
    return output.frame->status.reason;
  };
  EXPECT_NE(reason({3.0, cv::Mat(), World::depth(3.0)}).find("empty"), std::string::npos);
  EXPECT_NE(reason({3.0, cv::Mat(240, 320, CV_8UC3), World::depth(3.0)}).find("8-bit grey"), std::string::npos);
  EXPECT_NE(reason({3.0, cv::Mat(120, 160, CV_8UC1), World::depth(3.0)}).find("160x120"), std::string::npos);
  EXPECT_NE(reason({2.95, world_.image(2.95), World::depth(2.95)}).find("repeats"), std::string::npos);
  EXPECT_NE(reason({2.5, world_.image(2.5), World::depth(2.5)}).find("backward"), std::string::npos);
  EXPECT_NE(reason({nan, world_.image(3.0), World::depth(3.0)}).find("finite"), std::string::npos);
  EXPECT_NE(reason({3.5, world_.image(3.5), World::depth(3.5)}).find("IMU"), std::string::npos);
  EXPECT_EQ(front_end_.counters().bad_image, 3u);
  EXPECT_EQ(front_end_.counters().bad_stamp, 3u);
  EXPECT_EQ(front_end_.counters().imu_missing, 1u);
  EXPECT_FALSE(front_end_.addImu({3.2, Eigen::Vector3d(nan, 0, 0), gravityVector()}));
  EXPECT_FALSE(front_end_.addImu(World::imu(3.0)));
  EXPECT_GE(front_end_.counters().imu_rejected, 2u);

  // Depth of another size, and depth of NaN and zero, count as none; the pose goes on.
  FrameOutput output = front_end_.process({3.0, world_.image(3.0), cv::Mat(120, 160, CV_32FC1, cv::Scalar(1))});
  EXPECT_EQ(front_end_.counters().bad_depth, 1u);
  EXPECT_EQ(output.frame->status.state, TrackingState::kDegraded);
  cv::Mat holes(240, 320, CV_32FC1, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  holes.rowRange(0, 100).setTo(0);
  feedImu(3.05);
  output = front_end_.process({3.05, world_.image(3.05), holes});
  EXPECT_EQ(output.frame->status.state, TrackingState::kDegraded);
  output = run(3.1, 5.0);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking);
  EXPECT_EQ(output.frame->epoch, 0u);
  EXPECT_LT(error(output), 0.02);
}

TEST_F(FrontEndTest, WithoutDepthItGoesOnDegraded) {
  run(0.0, 3.0);
  const FrameOutput output = run(3.0, 6.0, false, false);
  EXPECT_EQ(output.frame->status.state, TrackingState::kDegraded);
  EXPECT_NE(output.frame->status.reason.find("no depth"), std::string::npos);
  EXPECT_LT(error(output), 0.06);
}

TEST_F(FrontEndTest, DarknessWithoutDepthCoastsWithGrowingCovarianceAndRecovers) {
  FrameOutput output = run(0.0, 3.0);
  const double before = output.frame->covariance(3, 3);
  output = run(3.0, 4.0, true, false);
  EXPECT_EQ(output.frame->status.state, TrackingState::kDegraded);
  EXPECT_NE(output.frame->status.reason.find("coasting"), std::string::npos);
  EXPECT_GT(output.frame->covariance(3, 3), 2.0 * before);
  EXPECT_LT(error(output), 0.15);
  EXPECT_GT(front_end_.counters().coasting, 10u);
  output = run(4.0, 5.0);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking);
  EXPECT_EQ(output.frame->epoch, 0u);
  EXPECT_LT(error(output), 0.15);
}

TEST_F(FrontEndTest, DarknessBeforeACornerIsHeldByDepth) {
  FrameOutput output = run(0.0, 3.0);
  const double before = output.frame->covariance(4, 4);
  for (int k = 60; k < 260; ++k) {
    const double t = 0.05 * k;
    feedImu(t);
    output = front_end_.process({t, cv::Mat(240, 320, CV_8U, cv::Scalar(3)), World::cornerDepth(t)});
    EXPECT_EQ(output.frame->status.state, TrackingState::kDegraded);
  }
  EXPECT_NE(output.frame->status.reason.find("held by depth surfaces"), std::string::npos);
  EXPECT_EQ(front_end_.counters().lost, 0u);
  EXPECT_GT(front_end_.counters().surfaces_used, 200u * 20u);
  EXPECT_LT(error(output), 0.02);  // after ten seconds; the IMU alone is off by metres then
  EXPECT_LT(output.frame->covariance(4, 4), before + 0.02 * 0.02);
  output = run(13.0, 14.0);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking);
  EXPECT_EQ(output.frame->epoch, 0u);
  EXPECT_LT(error(output), 0.02);
}

TEST_F(FrontEndTest, ExposureJumpsDoNotEndTheTracks) {
  run(0.0, 3.0);
  FrameOutput output;
  std::size_t old = 0;
  for (int k = 60; k < 120; ++k) {
    const double t = 0.05 * k;
    feedImu(t);
    cv::Mat image;
    world_.image(t).convertTo(image, CV_8U, k % 10 < 5 ? 1.0 : 0.45);  // twice a second
    output = front_end_.process({t, image, World::depth(t)});
    EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << output.frame->status.reason;
    old = 0;
    for (const Feature& f : output.frame->features) old += f.age >= 12;
  }
  EXPECT_LT(error(output), 0.015);
  EXPECT_GT(old, 20u);  // tracks that came through at least two jumps
}

TEST_F(FrontEndTest, LowLightAndBlurAreFollowed) {
  run(0.0, 3.0);
  cv::RNG random(11);
  FrameOutput output;
  for (int k = 60; k < 160; ++k) {
    const double t = 0.05 * k;
    feedImu(t);
    cv::Mat image = world_.image(t), noise(image.size(), CV_16S), dim;
    if (k < 110) {
      cv::blur(image, image, cv::Size(9, 3));  // a smear of nine pixels
    } else {
      image.convertTo(dim, CV_16S, 0.06, 2);  // fifteen grey levels are left, under noise of 1.5
      random.fill(noise, cv::RNG::NORMAL, 0, 1.5);
      dim += noise;
      dim.convertTo(image, CV_8U);
    }
    output = front_end_.process({t, image, World::depth(t)});
    EXPECT_NE(output.frame->status.state, TrackingState::kLost) << t;
  }
  EXPECT_EQ(output.frame->epoch, 0u);
  EXPECT_LT(error(output), 0.05);
}

TEST_F(FrontEndTest, AfterLostTheOdometryGoesOnWhileTheImuStillTellsWhere) {
  run(0.0, 3.0);
  FrameOutput output = run(3.0, 9.0, true, false);
  EXPECT_EQ(output.frame->status.state, TrackingState::kLost);
  EXPECT_EQ(front_end_.counters().lost, 1u);
  const double lost_sigma = std::sqrt(output.frame->covariance(4, 4));
  EXPECT_LT(error(output), 4 * lost_sigma);
  const std::size_t before = keyframes_.size();
  output = run(9.0, 11.0);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << output.frame->status.reason;
  EXPECT_EQ(output.frame->epoch, 0u);
  EXPECT_LT(error(output), 4 * lost_sigma);
  ASSERT_GT(keyframes_.size(), before);
  EXPECT_EQ(keyframes_[before]->previous, before);  // tied by six seconds of IMU
  EXPECT_FALSE(keyframes_[before]->imu.empty());
}

TEST_F(FrontEndTest, WhenTheImuNoLongerTellsWhereANewEpochBegins) {
  FrontEndOptions strict = options();
  strict.recovery.max_position_sigma = 0.05;
  FrontEnd front_end(strict, sensor());
  const auto feed = [&](double from, double to, bool dark) {
    FrameOutput last;
    for (int k = static_cast<int>(std::lround(from * 20)); k < std::lround(to * 20); ++k) {
      const double t = 0.05 * k;
      for (; imu_t_ < t + 0.02; imu_t_ += 0.005) front_end.addImu(World::imu(imu_t_));
      last = front_end.process({t, dark ? cv::Mat(240, 320, CV_8U, cv::Scalar(3)) : world_.image(t),
                                dark ? cv::Mat() : World::depth(t)});
      if (last.keyframe) keyframes_.push_back(last.keyframe);
    }
    return last;
  };
  feed(0.0, 3.0, false);
  FrameOutput output = feed(3.0, 9.0, true);
  EXPECT_EQ(output.frame->status.state, TrackingState::kLost);
  EXPECT_EQ(front_end.counters().lost, 1u);
  const std::size_t before = keyframes_.size();
  output = feed(9.0, 13.0, false);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << output.frame->status.reason;
  EXPECT_GE(output.frame->epoch, 1u);
  ASSERT_GT(keyframes_.size(), before);
  EXPECT_EQ(keyframes_[before]->id, before + 1);  // ids go on
  EXPECT_EQ(keyframes_[before]->previous, 0u);    // nothing ties it to the old epoch
}

TEST_F(FrontEndTest, ClockRunningBackStartsAnew) {
  run(0.0, 3.0);
  imu_t_ = 0.0;
  const FrameOutput first = step(0.1);
  EXPECT_EQ(first.frame->epoch, 1u);
  EXPECT_NE(first.frame->status.state, TrackingState::kTracking);
  const FrameOutput output = run(0.15, 4.0);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking);
  EXPECT_EQ(output.frame->epoch, 1u);
  EXPECT_LT(error(output), 0.02);
}

TEST_F(FrontEndTest, LongImuGapRestartsWithItsReason) {
  run(0.0, 3.0);
  imu_t_ = 3.8;
  const FrameOutput output = step(3.9);
  EXPECT_EQ(output.frame->status.state, TrackingState::kInitialising);
  EXPECT_NE(output.frame->status.reason.find("gap"), std::string::npos) << output.frame->status.reason;
  EXPECT_EQ(front_end_.counters().restarts, 1u);
}

TEST_F(FrontEndTest, ImagesWithinAnImuGapStopNothing) {
  // Between them the IMU is a straight line from the sample before the gap to the one after it.
  for (const double gap : {0.3, 1.0}) {
    FrontEnd front_end(options(), sensor());
    FrameOutput output;
    for (int k = 0; k <= 120; ++k) {
      const double t = 0.05 * k;
      if (k == 0) imu_t_ = 0;
      for (; imu_t_ < t + 0.02; imu_t_ += 0.005) front_end.addImu(World::imu(imu_t_));
      if (k == 60) {
        imu_t_ += gap;
        front_end.addImu(World::imu(imu_t_));
        imu_t_ += 0.005;
      }
      ASSERT_NO_THROW(output = front_end.process({t, world_.image(t), World::depth(t)})) << t;
    }
    EXPECT_EQ(output.frame->status.state, TrackingState::kTracking) << gap << ' ' << output.frame->status.reason;
    EXPECT_EQ(front_end.counters().imu_gaps, 1u);
    EXPECT_EQ(front_end.counters().restarts, gap < 0.5 ? 0u : 1u);
  }
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
  EXPECT_LT(std::abs(yawOf(output.frame->state.T_W_I.rotation())), 0.2 * M_PI / 180);
  EXPECT_LE(keyframes, 3u);
}

TEST_F(FrontEndTest, MapUpdateBringsLandmarksBackWithoutMovingOdom) {
  FrameOutput output = run(0.0, 4.0);
  // A map as a back end would hold it, in a frame turned and shifted against odom.
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
  // Darkness ends all tracks; afterwards some come back under their old ids.
  run(4.0, 4.3, true, false);
  output = run(4.3, 6.0);
  EXPECT_EQ(output.frame->status.state, TrackingState::kTracking);
  EXPECT_GT(front_end_.counters().landmarks_reacquired, 10u);
  // ... and where they say they are: each lies on the wall point the map has.
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
}

TEST(FrontEndConstruction, RefusesAnUnusableCamera) {
  SensorConfig config = sensor();
  config.camera.fx = 0;
  EXPECT_THROW(FrontEnd(options(), config), std::invalid_argument);
}

}  // namespace
}  // namespace vip_slam
