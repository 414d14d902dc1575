// SPDX-License-Identifier: BSD-3-Clause
// Inertial channels with stand-ins, fault detection, and the propagation by another source's motion.
#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <random>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "vip_slam_frontend/filter/gating.h"
#include "vip_slam_frontend/filter/propagation.h"
#include "vip_slam_frontend/inertial/fault_detection.h"
#include "vip_slam_frontend/inertial/imu_trial.h"
#include "vip_slam_frontend/inertial/inertial_input.h"
#include "vip_slam_frontend/inertial/motion_difference.h"

namespace vip_slam::frontend {
namespace {

SensorConfig sensorWith(bool gyro, bool accel) {
  SensorConfig sensor;
  sensor.topics.imu = gyro && accel ? "imu" : "";
  sensor.topics.gyro = gyro && !accel ? "gyro" : "";
  sensor.topics.accel = accel && !gyro ? "accel" : "";
  return sensor;
}

const Eigen::Vector3d kRate(0.1, -0.2, 0.3), kForce(0.5, 9.7, 1.0), kOther(1, 2, 3);

TEST(InertialInput, ACompleteImuIsHandedOnAsMeasured) {
  InertialInput input(sensorWith(true, true), 0.1);
  EXPECT_FALSE(input.covers(0));
  for (int k = 0; k <= 100; ++k) EXPECT_TRUE(input.addImu({0.01 * k, kRate, kForce}));
  EXPECT_TRUE(input.covers(0.5));
  EXPECT_FALSE(input.covers(1.5));
  EXPECT_TRUE(input.measured(0.1, 0.2));
  EXPECT_EQ(input.noise(0.1, 0.2).gyro, 1);
  for (const ImuSample& s : input.between(0.105, 0.195))
    EXPECT_LT((s.gyro - kRate).norm() + (s.accel - kForce).norm(), 1e-12);
}

TEST(InertialInput, WithoutAnyChannelStandInsAreAllThereIs) {
  InertialInput input(sensorWith(false, false), 0.1);
  EXPECT_TRUE(input.covers(1e9));
  input.substitute({1.0, 1.1, kRate, kForce});
  input.substitute({1.1, 1.2, kOther, kForce});
  const auto first = input.between(1.0, 1.1), second = input.between(1.1, 1.2), beyond = input.between(1.15, 1.4);
  ASSERT_GT(first.size(), 10u);
  EXPECT_EQ(first.front().t, 1.0);
  EXPECT_EQ(first.back().t, 1.1);
  for (const ImuSample& s : first) EXPECT_EQ(s.gyro, kRate);
  for (const ImuSample& s : second) EXPECT_EQ(s.gyro, kOther);
  for (const ImuSample& s : beyond) EXPECT_EQ(s.gyro, kOther);  // goes on as it was
  EXPECT_FALSE(input.measured(1.0, 1.1));
  EXPECT_GT(input.noise(1.0, 1.1).gyro, 100);
  EXPECT_GT(input.noise(1.0, 1.1).accel, 100);
}

TEST(InertialInput, ALoneChannelIsMeasuredTheOtherStoodInFor) {
  for (const bool gyro : {true, false}) {
    InertialInput input(sensorWith(gyro, !gyro), 0.1);
    for (int k = 0; k <= 100; ++k) {
      EXPECT_TRUE(gyro ? input.addGyro(0.01 * k, kRate) : input.addAccel(0.01 * k, kForce));
    }
    EXPECT_FALSE(gyro ? input.addGyro(0.5, kRate) : input.addAccel(0.5, kForce));  // runs back
    EXPECT_TRUE(input.covers(0.9));
    EXPECT_FALSE(input.covers(1.1));
    Substitute s{0.4, 0.5, std::nullopt, std::nullopt};
    (gyro ? s.accel : s.gyro) = kOther;
    input.substitute(s);
    for (const ImuSample& sample : input.between(0.4, 0.5)) {
      EXPECT_LT((sample.gyro - (gyro ? kRate : kOther)).norm(), 1e-12);
      EXPECT_LT((sample.accel - (gyro ? kOther : kForce)).norm(), 1e-12);
    }
    EXPECT_EQ(input.noise(0.4, 0.5).gyro > 1, !gyro);
    EXPECT_EQ(input.noise(0.4, 0.5).accel > 1, gyro);
  }
}

TEST(InertialInput, AStandInReplacesAFaultyIntervalAndNoOther) {
  InertialInput input(sensorWith(true, true), 0.1);
  for (int k = 0; k <= 100; ++k) input.addImu({0.01 * k, kRate, kForce});
  input.substitute({0.4, 0.5, kOther, kForce});
  for (const ImuSample& s : input.between(0.3, 0.4)) EXPECT_LT((s.gyro - kRate).norm(), 1e-12);
  for (const ImuSample& s : input.between(0.4, 0.5)) EXPECT_EQ(s.gyro, kOther);
  for (const ImuSample& s : input.between(0.5, 0.6)) EXPECT_LT((s.gyro - kRate).norm(), 1e-12);
  EXPECT_FALSE(input.measured(0.35, 0.45));
  EXPECT_TRUE(input.measured(0.5, 0.6));
  EXPECT_EQ(input.noise(0.5, 0.6).gyro, 1);
}

constexpr double kInterval = 1 / 30.0;

/// Evidence of 30 images a second; a trial differs as its intervals do in the mean.
class Evidence {
 public:
  MotionEvidence next(double t, bool agree, double sigmas) {
    MotionEvidence evidence{t, kInterval, agree, sigmas};
    if (!agree) {
      squares_.clear();
      return evidence;
    }
    squares_.push_back(sigmas * sigmas);
    while (squares_.size() > kMoment / kInterval + 0.5) squares_.pop_front();
    double sum = 0;
    for (double square : squares_) sum += square;
    evidence.trial = TrialResult{squares_.size() * kInterval + 1e-9, std::sqrt(sum / squares_.size())};
    return evidence;
  }

 private:
  std::deque<double> squares_;
};

/// Runs a detector over 30 images a second; `sigmas` and `agree` by time. Images at fault.
template <class Sigmas, class Agree>
std::vector<double> faults(double seconds, Sigmas sigmas, Agree agree) {
  FaultDetection detection;
  detection.reset(0);
  Evidence evidence;
  std::vector<double> result;
  for (int k = 1; k * kInterval < seconds; ++k) {
    const double t = k * kInterval;
    if (detection.add(evidence.next(t, agree(t), sigmas(t)))) result.push_back(t);
  }
  return result;
}

const auto kAlways = [](double) { return true; };

TEST(FaultDetection, ASoundImuIsNeverAtFault) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  EXPECT_TRUE(faults(
                  600,
                  [&](double) {
                    double squared = 0;
                    for (int d = 0; d < 6; ++d) squared += std::pow(normal(random), 2);
                    return std::sqrt(squared);
                  },
                  kAlways)
                  .empty());
}

// A minute has 120 of them: at a fixed 99.9 % one in nine such recordings would have an isolated IMU.
TEST(FaultDetection, OfManyTrialsOfASoundImuNoneFails) {
  std::mt19937 random(1);
  std::chi_squared_distribution<double> square(6);
  int isolated = 0;
  for (int recording = 0; recording < 1000; ++recording) {
    FaultDetection detection;
    detection.reset(0);
    bool at_fault = false;
    for (int k = 1; k <= 120; ++k) {
      MotionEvidence evidence{0.5 * k, 0.5, true, 2.0};
      evidence.trial = TrialResult{kMoment, std::sqrt(square(random))};
      at_fault = detection.add(evidence) || at_fault;
    }
    isolated += at_fault;
  }
  EXPECT_LE(isolated, 15);  // 5.4 expected
}

// Believed again once it has agreed for as long as it was at fault.
TEST(FaultDetection, ShakingIsFoundFromItsFirstImageOn) {
  const auto shaken = [](double t) { return t > 5 && t < 6 ? 40.0 : 2.0; };
  const std::vector<double> found = faults(20, shaken, kAlways);
  ASSERT_FALSE(found.empty());
  EXPECT_LT(found.front(), 5.05);
  EXPECT_GT(found.back(), 6.9);
  EXPECT_LT(found.back(), 8.1);
  EXPECT_EQ(found.size(), std::round((found.back() - found.front()) / kInterval) + 1) << "without a hole";
}

TEST(FaultDetection, AWrongImuIsFoundWithinTwoSecondsOfMotion) {
  const std::vector<double> found = faults(
      10, [](double) { return 30.0; }, kAlways);
  ASSERT_FALSE(found.empty());
  EXPECT_LT(found.front(), 2);
  EXPECT_GT(found.size(), 230u);
}

// An accelerometer in wrong axes contradicts in every second half second, when the camera is held aslant.
TEST(FaultDetection, AnImuWhoseFaultsComeBackIsIsolatedForLonger) {
  const auto wrong = [](double t) { return t > 5 && t < 12 && std::fmod(t, 1.0) < 0.5 ? 30.0 : 2.0; };
  const std::vector<double> found = faults(40, wrong, kAlways);
  const auto in = [&](double from, double to) {
    return std::count_if(found.begin(), found.end(), [&](double t) { return t > from && t < to; });
  };
  EXPECT_GT(in(8, 12), 115) << "of 120 images";
  EXPECT_EQ(in(20, 40), 0);
}

// Half a second without the shock has to agree.
TEST(FaultDetection, AShockIsolatesTheImuForHalfASecond) {
  const auto shock = [](double t) { return t > 4.99 && t < 5.01 ? 30.0 : 2.0; };
  const std::vector<double> found = faults(10, shock, kAlways);
  ASSERT_FALSE(found.empty());
  EXPECT_NEAR(found.back() - found.front(), 0.5, 0.1);
}

// A wrong IMU contradicts gradually once the images have carried the motion for a while.
TEST(FaultDetection, AnImuJustBelievedAgainIsAtFaultWithTheFirstContradiction) {
  const auto grows = [](double t) {
    return t > 5.18 && t < 5.22 ? 30.0 : t > 5.7 && t < 6.5 ? 2 + 20 * (t - 5.7) : 2.0;
  };
  const std::vector<double> found = faults(10, grows, kAlways);
  const auto again = std::find_if(found.begin(), found.end(), [](double t) { return t > 5.8; });
  ASSERT_NE(again, found.end());
  EXPECT_LT(*again, 6.05) << "a single interval's gate, eight sigmas, is passed at 6.0 s";
}

// A robot that bumps into something every three seconds has a sound IMU in between.
TEST(FaultDetection, BumpsThatComeBackDoNotIsolateTheImuForGood) {
  const auto bumps = [](double t) { return t > 5 && std::fmod(t, 3.0) < 0.2 ? 30.0 : 2.0; };
  EXPECT_LT(faults(300, bumps, kAlways).size(), 0.75 * 300 * 30);
}

// What fills the view moves: while it comes into view images do not agree among themselves, then they contradict.
TEST(FaultDetection, ABodyThatFillsTheViewForAMomentIsNoFaultOfTheImu) {
  const auto body = [](double t) { return t > 5 && t < 5.6 ? 30.0 : 2.0; };
  EXPECT_TRUE(faults(10, body, [](double t) { return t < 4.9 || t > 5.1; }).empty());
}

// Two seconds of rest, then turning by 0.3 rad/s.
TEST(FaultDetection, TheVerticalIsNotKnownWhereTheFirstTurnsContradict) {
  struct Unknown {
    bool at_3s, at_end;
  };
  const auto unknown = [](const std::function<double(double)>& sigmas, const std::function<bool(double)>& disputed) {
    FaultDetection detection;
    detection.reset(0);
    Evidence all;
    Unknown result{};
    for (int k = 1; k <= 300; ++k) {
      const double t = k * kInterval;
      MotionEvidence evidence = all.next(t, true, sigmas(t));
      evidence.disputed = disputed(t);
      evidence.turn = t > 2 ? 0.01 : 0.0;
      detection.add(evidence);
      (t < 3 ? result.at_3s : result.at_end) = detection.verticalUnknown();
    }
    return result;
  };
  const auto never = [](double) { return false; };
  const auto between = [](double from, double to) { return [=](double t) { return t > from && t < to ? 30.0 : 2.0; }; };
  const Unknown axes = unknown(between(2, 10), never);
  EXPECT_TRUE(axes.at_3s && axes.at_end) << "wrong axes";
  const Unknown some = unknown([](double t) { return t > 2 && std::fmod(t, 0.2) < 0.05 ? 12.0 : 3.0; }, never);
  EXPECT_TRUE(some.at_3s && some.at_end) << "between its faults an IMU that is not believed confirms nothing";
  const Unknown disputed = unknown(between(20, 20), [](double t) { return t > 2.1; });
  EXPECT_TRUE(disputed.at_3s && disputed.at_end) << "gradually";
  const Unknown bump = unknown(between(2, 2.2), never);
  EXPECT_TRUE(bump.at_3s && !bump.at_end) << "a bump at the start";
  const Unknown later = unknown(between(5, 10), never);
  EXPECT_FALSE(later.at_3s || later.at_end) << "a gyro whose unit is set anew";
  const Unknown sound = unknown(between(20, 20), never);
  EXPECT_FALSE(sound.at_3s || sound.at_end);
}

// A camera that stands level; its velocity is known to a few centimetres a second.
TEST(ImuTrial, HalfASecondShowsAnAccelerometerInOtherAxes) {
  const double gravity = 9.81;
  for (const bool wrong : {false, true}) {
    ImuTrial trial;
    WindowState window;
    window.clones.resize(1);
    Matrix15d P = 1e-6 * Matrix15d::Identity();
    P.block<2, 2>(0, 0).diagonal().setConstant(0.02 * 0.02);
    P.block<3, 3>(6, 6).diagonal().setConstant(0.05 * 0.05);
    P.block<3, 3>(12, 12).diagonal().setConstant(0.05 * 0.05);
    MotionFit still;
    still.ok = true;
    still.covariance = 1e-8 * Matrix6d::Identity();
    // Turned by 0.3 rad against what the accelerometer has said.
    const double tilt = wrong ? 0.3 : 0.0;
    const Eigen::Vector3d force(gravity * std::sin(tilt), 0, gravity * std::cos(tilt));
    double single = -1;
    std::optional<TrialResult> last;
    for (int k = 0; k < 30; ++k) {
      std::vector<ImuSample> samples;
      for (int i = 0; i <= 5; ++i) samples.push_back({(5 * k + i) / 150.0, Eigen::Vector3d::Zero(), force});
      window.clones[0].t = samples.front().t;
      last = trial.add(window, P, samples, still, ImuNoise(), gravity);
      ASSERT_TRUE(last);
      if (k == 0) single = last->sigmas;
    }
    EXPECT_GE(last->duration, kMoment);
    EXPECT_LT(last->duration, kMoment + 2 * kInterval);
    EXPECT_LT(single, 2) << "too little to be seen between two images";
    EXPECT_TRUE(wrong ? last->sigmas > kGateSigmas : last->sigmas < 0.1) << last->sigmas;
    EXPECT_FALSE(trial.add(window, P, {}, still, ImuNoise(), gravity)) << "no samples";
  }
}

TEST(MotionDifference, CountsSigmas) {
  const Matrix6d covariance = 1e-4 * Matrix6d::Identity();
  Vector6d d = Vector6d::Zero();
  d(4) = 0.03;
  const SE3 a(expSO3(Eigen::Vector3d(0.1, 0.2, -0.1)), {1, 2, 3});
  EXPECT_NEAR(motionDifference(a.boxplus(d), a, covariance), 3, 1e-9);
  d.setZero();
  d(0) = -0.05;
  EXPECT_NEAR(motionDifference(a.boxplus(d), a, covariance), 5, 1e-9);
}

TEST(PropagateByMotion, PhiAndNoiseAreTheDerivativesOfThePrediction) {
  WindowState window;
  Clone clone;
  clone.id = 1;
  clone.t = 3;
  clone.T_W_I = clone.T_W_I_fej = SE3(expSO3(Eigen::Vector3d(0.3, -0.2, 0.8)), {1, -2, 0.5});
  window.clones.push_back(clone);
  window.v_W = window.v_W_fej = Eigen::Vector3d(0.4, 0.1, -0.2);
  const SE3 motion(expSO3(Eigen::Vector3d(0.02, 0.05, -0.01)), {0.03, -0.01, 0.02});
  const double dt = 0.05;
  const ImuNoise noise;
  const Matrix6d covariance = 1e-4 * Matrix6d::Identity();
  const Propagation p = propagateByMotion(window, motion, covariance, dt, noise);
  const auto state = [](const NavState& s, const NavState& nominal) {
    Eigen::Matrix<double, 9, 1> x;
    x << s.T_W_I.boxminus(nominal.T_W_I), s.v_W - nominal.v_W;
    return x;
  };
  const double h = 1e-6;
  for (int c = 0; c < 9; ++c) {
    WindowState plus = window, minus = window;
    Vector6d pose = Vector6d::Zero();
    if (c < 6) pose(c) = h;
    plus.clones[0].T_W_I = window.clones[0].T_W_I.boxplus(pose);
    minus.clones[0].T_W_I = window.clones[0].T_W_I.boxplus(-pose);
    if (c >= 6) plus.v_W(c - 6) += h, minus.v_W(c - 6) -= h;
    const Eigen::Matrix<double, 9, 1> numeric =
        (state(propagateByMotion(plus, motion, covariance, dt, noise).predicted, p.predicted) -
         state(propagateByMotion(minus, motion, covariance, dt, noise).predicted, p.predicted)) /
        (2 * h);
    EXPECT_LT((p.Phi.block<9, 1>(0, c) - numeric).norm(), 1e-6) << "column " << c;
  }
  Eigen::Matrix<double, 9, 6> G;
  for (int c = 0; c < 6; ++c) {
    // The motion's error: theta at its end, p at its beginning.
    Vector6d e = Vector6d::Zero();
    e(c) = h;
    G.col(c) = (state(propagateByMotion(window, motion.boxplus(e), covariance, dt, noise).predicted, p.predicted) -
                state(propagateByMotion(window, motion.boxplus(-e), covariance, dt, noise).predicted, p.predicted)) /
               (2 * h);
  }
  const Eigen::Matrix<double, 9, 9> Q = G * covariance * G.transpose();
  EXPECT_LT((p.Q.topLeftCorner<6, 6>() - Q.topLeftCorner<6, 6>()).norm(), 1e-8);
  EXPECT_LT((p.Q.block<6, 3>(0, 6) - Q.topRightCorner<6, 3>()).norm(), 1e-7);
  EXPECT_LT((p.W.transpose() * p.W * p.Q - Matrix15d::Identity()).norm(), 1e-5);
}

}  // namespace
}  // namespace vip_slam::frontend
