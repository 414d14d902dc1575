// SPDX-License-Identifier: BSD-3-Clause
// Trajectories: exact derivatives, IMU integration, sensible motions.
#include <gtest/gtest.h>

#include <fstream>

#include "test_support.h"
#include "vip_slam_sim/motion/motion_generator.h"

namespace vip_slam {
namespace {

SplineTrajectory motionOf(const std::string& name) {
  const SequenceSpec spec = loadSequence(name, libraryPath());
  return makeMotion(spec.motion, spec.T_imu_cam(), spec.seed);
}

TEST(Spline, DerivativesMatchDifferences) {
  const SplineTrajectory s = motionOf("10");
  const double h = 1e-5;
  double worst = 0;
  for (double t = 3.01; t < 40; t += 0.37) {
    const MotionState m = s.at(t), a = s.at(t - h), b = s.at(t + h);
    const Eigen::Vector3d v = (b.T_W_I.t() - a.T_W_I.t()) / (2 * h);
    const Eigen::Vector3d acc = (b.v_W - a.v_W) / (2 * h);
    const Eigen::Vector3d w = logSO3(a.T_W_I.rotation().conjugate() * b.T_W_I.rotation()) / (2 * h);
    const Eigen::Vector3d alpha = (b.omega_I - a.omega_I) / (2 * h);
    worst =
        std::max({worst, (v - m.v_W).norm(), (acc - m.a_W).norm(), (w - m.omega_I).norm(), (alpha - m.alpha_I).norm()});
  }
  EXPECT_LT(worst, 2e-5);
}

TEST(Spline, AccelerationIsContinuousAcrossKnots) {
  const SplineTrajectory s = motionOf("09");
  for (double knot = 4; knot < 30; knot += 0.1) {
    const MotionState a = s.at(knot - 1e-7), b = s.at(knot + 1e-7);
    EXPECT_LT((a.a_W - b.a_W).norm(), 1e-4);
    EXPECT_LT((a.alpha_I - b.alpha_I).norm(), 1e-3);
  }
}

/// Integrates the IMU alone, from the true start, with an independent integrator (Simpson on the interpolated samples,
/// no core code but the exponential map).
TEST(Imu, NoiseFreeIntegrationStaysWithinMillimetres) {
  for (const std::string name : {"01", "10"}) {
    SequenceSpec spec = cleanSequence(name);
    spec.imu.rate = 1000;
    const SplineTrajectory s = makeMotion(spec.motion, spec.T_imu_cam(), spec.seed);
    const ImuLog log = synthesiseImu(s, spec.imu, spec.seed);
    const std::size_t begin = 5000, end = begin + 10000;  // 10 s in full motion
    const MotionState start = s.at(log.samples[begin].t);
    Eigen::Quaterniond q = start.T_W_I.rotation();
    Eigen::Vector3d p = start.T_W_I.t(), v = start.v_W;
    for (std::size_t k = begin; k + 2 <= end; k += 2) {
      const ImuSample &a = log.samples[k], &b = log.samples[k + 1], &c = log.samples[k + 2];
      const double h = c.t - a.t;
      // Rotation: Simpson plus the commutator of the linear part (4th-order Magnus).
      const Eigen::Vector3d mean = (a.gyro + 4 * b.gyro + c.gyro) / 6, slope = (c.gyro - a.gyro) / h;
      const Eigen::Vector3d magnus = mean * h + h * h * h / 12 * mean.cross(slope);
      const Eigen::Vector3d to_middle = (5 * a.gyro + 8 * b.gyro - c.gyro) * (h / 24);
      const Eigen::Quaterniond q1 = q * expQuaternion(to_middle), q2 = q * expQuaternion(magnus);
      const Eigen::Vector3d g(0, 0, -9.81);
      const Eigen::Vector3d fa = q * a.accel + g, fb = q1 * b.accel + g, fc = q2 * c.accel + g;
      p += v * h + h * h / 6 * (fa + 2 * fb);
      v += h / 6 * (fa + 4 * fb + fc);
      q = q2.normalized();
    }
    const MotionState truth = s.at(log.samples[end].t);
    const double error = (p - truth.T_W_I.t()).norm();
    const double angle = logSO3(q.conjugate() * truth.T_W_I.rotation()).norm();
    RecordProperty("error_mm_" + name, std::to_string(1000 * error));
    std::printf("  %s: %.4f mm, %.2e rad after 10 s\n", name.c_str(), 1000 * error, angle);
    EXPECT_LT(error, 1e-3) << name;
    EXPECT_LT(angle, 1e-5) << name;
  }
}

TEST(Imu, NoiseMatchesTheConfiguredDensities) {
  MotionOptions still;
  still.type = "still";
  still.duration = 400;
  const SequenceSpec rig;
  const SplineTrajectory s = makeMotion(still, rig.T_imu_cam(), 1);
  ImuOptions o;
  o.gyro_random_walk = o.accel_random_walk = 0;
  const ImuLog white = synthesiseImu(s, o, 4);
  Eigen::Vector3d mean_g = Eigen::Vector3d::Zero(), mean_a = mean_g, sq_g = mean_g, sq_a = mean_g;
  const double n = static_cast<double>(white.samples.size());
  for (const ImuSample& m : white.samples) mean_g += m.gyro / n, mean_a += m.accel / n;
  for (const ImuSample& m : white.samples) {
    sq_g += (m.gyro - mean_g).cwiseAbs2() / n;
    sq_a += (m.accel - mean_a).cwiseAbs2() / n;
  }
  const double want_g = o.gyro_noise_density * std::sqrt(o.rate), want_a = o.accel_noise_density * std::sqrt(o.rate);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(std::sqrt(sq_g[k]) / want_g, 1, 0.02);
    EXPECT_NEAR(std::sqrt(sq_a[k]) / want_a, 1, 0.02);
    EXPECT_NEAR(mean_g[k], white.biases[0].gyro[k], 4 * want_g / std::sqrt(n));
  }
  // Bias walk: increments over a second have sigma = walk * sqrt(1 s).
  o.gyro_random_walk = 2e-5;
  o.accel_random_walk = 3e-3;
  double walk_g = 0, walk_a = 0;
  int count = 0;
  for (int seed = 0; seed < 3; ++seed) {
    const ImuLog log = synthesiseImu(s, o, 10 + seed);
    for (std::size_t k = 200; k < log.biases.size(); k += 200, count += 3) {
      walk_g += (log.biases[k].gyro - log.biases[k - 200].gyro).squaredNorm();
      walk_a += (log.biases[k].accel - log.biases[k - 200].accel).squaredNorm();
    }
  }
  EXPECT_NEAR(std::sqrt(walk_g / count) / o.gyro_random_walk, 1, 0.05);
  EXPECT_NEAR(std::sqrt(walk_a / count) / o.accel_random_walk, 1, 0.05);
}

TEST(Motion, NamedSequencesMoveLikePeopleAndDrones) {
  for (const std::string& name : sequenceNames(libraryPath())) {
    SequenceSpec spec = loadSequence(name, libraryPath());
    const bool shakes = spec.motion.vibration != "none";  // from the first image on
    spec.motion.vibration = "none";
    if (spec.motion.type == "path" && spec.motion.waypoints.empty()) continue;  // only a base of other sequences
    const SplineTrajectory s = makeMotion(spec.motion, spec.T_imu_cam(), spec.seed);
    double v = 0, a = 0, w = 0, still = 0;
    for (double t = 0; t < s.end(); t += 0.01) {
      const MotionState m = s.at(t);
      v = std::max(v, m.v_W.norm());
      a = std::max(a, m.a_W.norm());
      w = std::max(w, m.omega_I.norm());
      if (still == 0 && (m.v_W.norm() > 2e-3 || m.omega_I.norm() > 2e-3)) still = t;
    }
    EXPECT_LT(v, 2.3) << name;
    EXPECT_LT(a, 5.0) << name;
    EXPECT_LT(w, 2.4) << name;
    if (spec.motion.start_at == 0 && spec.motion.type != "still" && !shakes) {
      EXPECT_GE(still, 1.5) << name;
    }
  }
  EXPECT_GT(motionOf("moving_start").at(0).v_W.norm(), 0.2);
}

TEST(Motion, FliesPosesOfFiles) {
  const SplineTrajectory s = motionOf("07");
  const std::string tum = testing::TempDir() + "vip_slam_sim_poses.tum",
                    euroc = testing::TempDir() + "vip_slam_sim_poses.csv";
  Trajectory poses;
  std::ofstream csv(euroc);
  csv << "#timestamp,p,q,v\n";
  csv.precision(15);
  for (double t = 0; t < 12; t += 0.05) {
    const SE3 T = s.at(t).T_W_I;
    poses.push_back({100 + t, T});
    csv << static_cast<long long>((100 + t) * 1e9) << ',' << T.t().x() << ',' << T.t().y() << ',' << T.t().z() << ','
        << T.rotation().w() << ',' << T.rotation().x() << ',' << T.rotation().y() << ',' << T.rotation().z()
        << ",0,0,0\n";
  }
  csv.close();
  writeTum(tum, poses);
  for (const std::string& file : {tum, euroc}) {
    MotionOptions o;
    o.type = "file";
    o.file = file;
    const SplineTrajectory flown = makeMotion(o, SE3(), 1);
    for (double t = 3; t < 11; t += 0.21) {
      EXPECT_LT((flown.at(t).T_W_I.t() - s.at(t).T_W_I.t()).norm(), 0.004) << file << " at " << t;
      EXPECT_LT(logSO3(flown.at(t).T_W_I.rotation().conjugate() * s.at(t).T_W_I.rotation()).norm(), 0.004);
    }
  }
}

TEST(Motion, RefusesBadInput) {
  const auto messageOf = [](const MotionOptions& o) -> std::string {
    try {
      makeMotion(o, SE3(), 1);
    } catch (const std::exception& e) {
      return e.what();
    }
    return "";
  };
  MotionOptions o;
  o.waypoints = "1,2; turn";
  EXPECT_NE(messageOf(o).find("motion/waypoints"), std::string::npos);
  o.type = "file";
  o.file = "/nowhere/poses.tum";
  EXPECT_NE(messageOf(o).find("/nowhere/poses.tum"), std::string::npos);
  const std::string path = testing::TempDir() + "vip_slam_sim_repeated.csv";
  std::ofstream(path) << "1000,0,0,0,1,0,0,0\n1000,0,0,0,1,0,0,0\n";
  o.file = path;
  EXPECT_NE(messageOf(o).find(path + ":2"), std::string::npos) << messageOf(o);
}

}  // namespace
}  // namespace vip_slam
