// SPDX-License-Identifier: BSD-3-Clause
// Jacobians of the measurement rows and of the propagation against central differences.
#include <gtest/gtest.h>

#include <set>
#include <utility>

#include <Eigen/Dense>

#include "landmark_simulation.h"
#include "vip_slam_frontend/filter/feature_rows.h"
#include "vip_slam_frontend/filter/triangulation.h"
#include "vip_slam_frontend/filter/zero_velocity.h"

namespace vip_slam {
namespace {

/// A window of four true poses with sightings of one point.
struct Scene {
  WindowState window;
  std::vector<Observation> observations;
  Eigen::Vector3d f_W;
};

Scene makeScene() {
  Scene scene;
  testing::SimulationOptions options;
  testing::LandmarkSimulation simulation(options);
  simulation.generateImu(3.0);
  scene.window.T_I_C = simulation.T_I_C();
  scene.window.calibration = {true, true, true, true, true, true, true, true, true};
  scene.window.depth_delay = 0.01;
  scene.window.readout = 0.001;
  scene.window.depth_shift << 0.004, -0.003;
  scene.window.bearing.value << 0.003, -0.002, 0.001, -0.0015;
  scene.window.time_offset = 0.003;
  scene.f_W = simulation.stateAt(0.5).T_W_I * (simulation.T_I_C() * Eigen::Vector3d(0.3, -0.2, 2.5));
  for (int i = 0; i < 4; ++i) {
    const NavState state = simulation.stateAt(0.4 + 0.1 * i);
    Clone clone;
    clone.id = static_cast<CloneId>(i + 1);
    clone.t = state.t;
    clone.T_W_I = clone.T_W_I_fej = state.T_W_I;
    clone.omega_I = Eigen::Vector3d(0.4, -0.3, 0.5);
    clone.v_W = state.v_W;
    clone.time_offset = 0.003;
    scene.window.clones.push_back(clone);
    const Eigen::Vector3d p_C = (clone.T_W_I * scene.window.T_I_C).inverse() * scene.f_W;
    const Eigen::Vector2d xy = p_C.head<2>() / p_C.z() + Eigen::Vector2d(1e-3, -2e-3);
    Eigen::Matrix2d whitening;
    whitening << 0.9, 0.0, -0.2 * i, 0.4;
    scene.observations.push_back({clone.id,
                                  xy,
                                  p_C.z() + 0.01,
                                  0.01,
                                  {1.5 - i, 0.4 * i},
                                  0.7 - 0.3 * i,
                                  bearingJacobian(xy),
                                  {0.4 - 0.3 * i, 0.1 * i},
                                  whitening,
                                  0.008 + 0.002 * i});
  }
  scene.window.v_W = scene.window.v_W_fej = scene.window.clones.back().v_W;
  return scene;
}

TEST(FeatureRows, JacobiansMatchCentralDifferences) {
  const Scene scene = makeScene();
  const MeasurementNoise noise;
  Eigen::MatrixXd H_x, H_f, unused_x, unused_f;
  Eigen::VectorXd r, plus, minus;
  stackFeature(scene.window, scene.observations, scene.f_W, noise, &H_x, &H_f, &r);
  ASSERT_EQ(r.size(), 12);
  const double h = 1e-6;
  // r = z - h(x): the rows are the derivative of the prediction, so minus that of r.
  const auto difference = [&](const WindowState& a, const Eigen::Vector3d& fa, const WindowState& b,
                              const Eigen::Vector3d& fb) {
    stackFeature(a, scene.observations, fa, noise, &unused_x, &unused_f, &plus);
    stackFeature(b, scene.observations, fb, noise, &unused_x, &unused_f, &minus);
    return Eigen::VectorXd(-(plus - minus) / (2 * h));
  };
  // The columns of the focal lengths are evaluated at the predicted bearing, not at the measured one, and that of the
  // depth's scale at the predicted depth.
  const int focal = scene.window.intrinsicsColumn(), scale = scene.window.depthScaleColumn();
  for (int c = 0; c < scene.window.dimension(); ++c) {
    if (c == focal || c == focal + 1 || c == scale) continue;
    Eigen::VectorXd delta = Eigen::VectorXd::Zero(scene.window.dimension());
    delta(c) = h;
    WindowState a = scene.window, b = scene.window;
    a.boxplus(delta);
    b.boxplus(-delta);
    EXPECT_LT((difference(a, scene.f_W, b, scene.f_W) - H_x.col(c)).norm(), 1e-6 * (1.0 + H_x.col(c).norm()))
        << "column " << c;
  }
  for (int c = 0; c < 3; ++c) {
    const Eigen::Vector3d step = h * Eigen::Vector3d::Unit(c);
    EXPECT_LT((difference(scene.window, scene.f_W + step, scene.window, scene.f_W - step) - H_f.col(c)).norm(),
              1e-6 * H_f.col(c).norm());
  }
}

// A reading's own noise would shrink the scale: with it the column is that of a reading without noise.
TEST(FeatureRows, TheScaleOfDepthIsAskedWhereDepthIsExpected) {
  const Scene scene = makeScene();
  const MeasurementNoise noise;
  const auto beside = [&](const Observation& o) {
    return o.depth_slope.dot(scene.window.depth_shift) + o.depth_rate * scene.window.depth_delay;
  };
  const auto column = [&](double error) {
    std::vector<Observation> seen = scene.observations;
    for (Observation& o : seen) o.depth += error - 0.01 - beside(o);
    Eigen::MatrixXd H_x, H_f;
    Eigen::VectorXd r;
    stackFeature(scene.window, seen, scene.f_W, noise, &H_x, &H_f, &r);
    return Eigen::VectorXd(H_x.col(scene.window.depthScaleColumn()));
  };
  std::vector<Observation> exact = scene.observations;
  for (Observation& o : exact) o.depth -= 0.01 + beside(o);
  const auto residual = [&](double scale) {
    WindowState window = scene.window;
    window.depth_scale = scale;
    Eigen::MatrixXd H_x, H_f;
    Eigen::VectorXd r;
    stackFeature(window, exact, scene.f_W, noise, &H_x, &H_f, &r);
    return r;
  };
  const Eigen::VectorXd numeric = -(residual(1 + 1e-6) - residual(1 - 1e-6)) / 2e-6;
  EXPECT_GT(numeric.norm(), 100.0);
  EXPECT_LT((column(0) - numeric).norm(),
            1e-2 * numeric.norm());  // the shift's and the delay's part of a reading are not scaled
  EXPECT_EQ(column(0.2), column(0));
}

// What one pixel reads of a slanted wall a moment before and after, from a camera that moves and turns.
TEST(FeatureRows, RateOfDepthMatchesCentralDifferences) {
  const Eigen::Vector3d n = Eigen::Vector3d(0.5, -0.3, 0.8).normalized(), omega(0.7, -0.4, 0.9), v(0.5, -0.8, 0.3);
  const Eigen::Vector2d xy(0.3, -0.2);
  constexpr double kDistance = 2.0, h = 1e-6;
  const auto reading = [&](double t, const Eigen::Vector2d& pixel) {
    const SE3 T_W_C(expSO3(Eigen::Vector3d(omega * t)), v * t);  // v: along the axes at t = 0
    const Eigen::Vector3d ray = T_W_C.R() * pixel.homogeneous();
    return (kDistance - n.dot(T_W_C.t())) / n.dot(ray);
  };
  Eigen::Vector2d slope;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d step = h * Eigen::Vector2d::Unit(k);
    slope(k) = (reading(0, xy + step) - reading(0, xy - step)) / (2 * h);
  }
  const double numeric = (reading(h, xy) - reading(-h, xy)) / (2 * h);
  EXPECT_GT(std::abs(numeric), 0.1);
  EXPECT_NEAR(depthRate(xy, reading(0, xy), slope, omega, v), numeric, 1e-6);
}

TEST(FeatureRows, RateOfABearingMatchesCentralDifferences) {
  const Eigen::Vector3d omega(0.7, -0.4, 0.9), v(0.5, -0.8, 0.3), p(0.6, -0.4, 2.0);
  constexpr double h = 1e-6;
  const auto bearing = [&](double t) {
    const Eigen::Vector3d seen = expSO3(Eigen::Vector3d(omega * t)).transpose() * (p - v * t);
    return Eigen::Vector2d(seen.head<2>() / seen.z());
  };
  const Eigen::Vector2d numeric = (bearing(h) - bearing(-h)) / (2 * h);
  EXPECT_GT(numeric.norm(), 0.1);
  EXPECT_LT((bearingRate(bearing(0), p.z(), omega, v) - numeric).norm(), 1e-6);
}

TEST(FeatureRows, FocalLengthsAreAskedWhereTheBearingIsExpected) {
  Scene scene = makeScene();
  const MeasurementNoise noise;
  Eigen::MatrixXd measured, H_x, H_f, unused_x, unused_f;
  Eigen::VectorXd r, plus, minus;
  stackFeature(scene.window, scene.observations, scene.f_W, noise, &measured, &H_f, &r);
  for (Observation& o : scene.observations) {
    const Eigen::Vector3d p_C =
        cameraPose(scene.window, scene.window.clones[scene.window.indexOf(o.clone)]).inverse() * scene.f_W;
    const Eigen::Vector3d given = scene.window.bearing.matrix().inverse() * p_C;
    o.xy = given.head<2>() / given.z();
    o.by_intrinsics = bearingJacobian(o.xy);
    o.xy -= o.by_readout * scene.window.readout;
  }
  stackFeature(scene.window, scene.observations, scene.f_W, noise, &H_x, &H_f, &r);
  const double h = 1e-6;
  for (int c = scene.window.intrinsicsColumn(); c < scene.window.intrinsicsColumn() + 2; ++c) {
    EXPECT_LT((measured.col(c) - H_x.col(c)).norm(), 1e-2 * H_x.col(c).norm()) << "the measurement's noise is in it";
    Eigen::VectorXd delta = Eigen::VectorXd::Zero(scene.window.dimension());
    delta(c) = h;
    WindowState a = scene.window, b = scene.window;
    a.boxplus(delta);
    b.boxplus(-delta);
    stackFeature(a, scene.observations, scene.f_W, noise, &unused_x, &unused_f, &plus);
    stackFeature(b, scene.observations, scene.f_W, noise, &unused_x, &unused_f, &minus);
    EXPECT_LT((-(plus - minus) / (2 * h) - H_x.col(c)).norm(), 1e-6 * (1.0 + H_x.col(c).norm())) << "column " << c;
  }
}

// Change of a pixel's bearing under other intrinsics.
TEST(FeatureRows, ALensBendsWhatTheIntrinsicsGetWrong) {
  CameraIntrinsics given;
  given.width = 640, given.height = 480, given.fx = 481, given.fy = 478, given.cx = 320, given.cy = 241;
  given.model = DistortionModel::kRadTan;
  given.distortion = {0.06, -0.09, 0.0004, -0.0003};
  const BearingCorrection bearing{{0.002, -0.001, 0.0015, 0.0005}};
  const Eigen::Vector4d right = correctedIntrinsics({given.fx, given.fy, given.cx, given.cy}, bearing);
  CameraIntrinsics truth = given;
  truth.fx = right(0), truth.fy = right(1), truth.cx = right(2), truth.cy = right(3);
  const auto camera = makeCamera(given), true_camera = makeCamera(truth);
  for (const Eigen::Vector2d& uv : {Eigen::Vector2d(10, 20), Eigen::Vector2d(600, 460), Eigen::Vector2d(350, 100)}) {
    Eigen::Vector2d xy, expected;
    ASSERT_TRUE(camera->undistort(uv, &xy));
    ASSERT_TRUE(true_camera->undistort(uv, &expected));
    EXPECT_LT((xy + bearingJacobian(*camera, xy) * bearing.value - expected).norm(), 1e-5);
    EXPECT_GT((bearing(xy) - expected).norm(), 3e-6);
  }
}

TEST(FeatureRows, ProjectionRemovesTheFeature) {
  const Scene scene = makeScene();
  const FeatureRows rows = featureRows(scene.window, scene.observations, scene.f_W, MeasurementNoise());
  EXPECT_EQ(rows.r.size(), 2 * 4 + 4 - 3);
  // Moving the point alone must not change the projected residual to first order.
  Eigen::MatrixXd H_x, H_f;
  Eigen::VectorXd r;
  stackFeature(scene.window, scene.observations, scene.f_W, MeasurementNoise(), &H_x, &H_f, &r);
  const Eigen::VectorXd best = H_f.colPivHouseholderQr().solve(r);
  EXPECT_NEAR(rows.r.squaredNorm(), (r - H_f * best).squaredNorm(), 1e-9 * r.squaredNorm());
}

TEST(FeatureRows, WithoutDepthOnlyPixels) {
  const Scene scene = makeScene();
  MeasurementNoise noise;
  noise.use_depth = false;
  EXPECT_EQ(featureRows(scene.window, scene.observations, scene.f_W, noise).r.size(), 2 * 4 - 3);
}

TEST(Triangulation, FindsThePointWithAndWithoutDepth) {
  Scene scene = makeScene();
  for (Observation& o : scene.observations) {
    const Eigen::Vector3d p_C =
        cameraPose(scene.window, scene.window.clones[scene.window.indexOf(o.clone)]).inverse() * scene.f_W;
    const Eigen::Vector3d given = scene.window.bearing.matrix().inverse() * p_C;
    o.xy = given.head<2>() / given.z();
    o.by_intrinsics = bearingJacobian(o.xy);
    o.xy -= o.by_readout * scene.window.readout;
    o.depth = p_C.z() - o.depth_slope.dot(scene.window.depth_shift) - o.depth_rate * scene.window.depth_delay;
  }
  MeasurementNoise noise;
  Triangulation point = triangulate(scene.window, scene.observations, noise);
  ASSERT_TRUE(point.ok);
  EXPECT_EQ(point.depth_rows, 4);
  EXPECT_LT((point.p_W - scene.f_W).norm(), 1e-6);
  noise.use_depth = false;
  point = triangulate(scene.window, scene.observations, noise);
  ASSERT_TRUE(point.ok);
  EXPECT_LT((point.p_W - scene.f_W).norm(), 1e-4);
  // One depth reading from across an edge does not shift the point.
  noise.use_depth = true;
  scene.observations[1].depth += 1.5;
  point = triangulate(scene.window, scene.observations, noise);
  ASSERT_TRUE(point.ok);
  EXPECT_LT((point.p_W - scene.f_W).norm(), 0.05);
}

/// A window with only this pose.
WindowState windowOfOne(const NavState& state) {
  WindowState window;
  Clone clone;
  clone.t = state.t;
  clone.T_W_I = clone.T_W_I_fej = state.T_W_I;
  window.clones.push_back(clone);
  window.v_W = window.v_W_fej = state.v_W;
  return window;
}

TEST(Propagation, TransitionMatchesCentralDifferences) {
  testing::SimulationOptions options;
  testing::LandmarkSimulation simulation(options);
  simulation.generateImu(3.0);
  const WindowState window = windowOfOne(simulation.stateAt(0.5));
  const auto samples = simulation.imuBetween(0.5, 0.56);
  const auto predicted = [&](const Eigen::Matrix<double, 15, 1>& d) {
    WindowState moved = window;
    moved.boxplus(d);
    return propagate(moved, samples, options.noise, gravityVector()).predicted;
  };
  const Propagation nominal = propagate(window, samples, options.noise, gravityVector());
  EXPECT_LT((nominal.W.transpose() * nominal.W * nominal.Q - Matrix15d::Identity()).norm(), 1e-6);
  const double h = 1e-5;
  for (int c = 0; c < 15; ++c) {
    const NavState a = predicted(h * Eigen::Matrix<double, 15, 1>::Unit(c));
    const NavState b = predicted(-h * Eigen::Matrix<double, 15, 1>::Unit(c));
    Eigen::Matrix<double, 15, 1> column;
    column << (a.T_W_I.boxminus(nominal.predicted.T_W_I) - b.T_W_I.boxminus(nominal.predicted.T_W_I)), a.v_W - b.v_W,
        a.bias_gyro - b.bias_gyro, a.bias_accel - b.bias_accel;
    column /= 2 * h;
    EXPECT_LT((column - nominal.Phi.col(c)).norm(), 1e-5 * (1.0 + column.norm())) << "column " << c;
  }
}

TEST(Propagation, GyroCorrectionMatchesCentralDifferences) {
  testing::SimulationOptions options;
  testing::LandmarkSimulation simulation(options);
  simulation.generateImu(3.0);
  WindowState window = windowOfOne(simulation.stateAt(0.5));
  window.gyro_correction << 0.01, -0.02, 0.005, 0.003, -0.015, 0.01, -0.01, 0.02, 0.008;
  const auto samples = simulation.imuBetween(0.5, 0.56);
  for (const bool misalignment : {true, false}) {
    window.calibration.gyro_scale = true;
    window.calibration.gyro_misalignment = misalignment;
    const Propagation nominal = propagate(window, samples, options.noise, gravityVector());
    const double h = 1e-4;
    const auto moved = [&](int k, double by) {
      WindowState other = window;
      other.boxplus(by * Eigen::VectorXd::Unit(window.dimension(), window.gyroColumn() + k));
      EXPECT_NEAR((other.gyro_correction - window.gyro_correction).cwiseAbs().sum(), h, 1e-12) << "one entry";
      return propagate(other, samples, options.noise, gravityVector()).predicted;
    };
    std::set<std::pair<int, int>> entries;
    for (int k = 0; k < window.calibration.gyro(); ++k) {
      const auto [row, column] = gyroEntry(window.calibration, k);
      entries.insert({row, column});
      const NavState a = moved(k, h), b = moved(k, -h);
      Eigen::Matrix<double, 9, 1> change;
      change << a.T_W_I.boxminus(nominal.predicted.T_W_I) - b.T_W_I.boxminus(nominal.predicted.T_W_I), a.v_W - b.v_W;
      const Eigen::Matrix<double, 9, 1> expected = nominal.Phi_gyro.col(3 * column + row).head<9>();
      // The Jacobians assume constant rates over the image interval.
      EXPECT_LT((change / (2 * h) - expected).norm(), 0.02 * expected.norm() + 1e-6) << row << column;
    }
    EXPECT_EQ(entries.size(), misalignment ? 9u : 3u);
    EXPECT_EQ(nominal.Phi_gyro.bottomRows<6>().norm(), 0.0);
  }
}

TEST(ZeroVelocity, RowsMatchCentralDifferences) {
  Scene scene = makeScene();
  Eigen::MatrixXd H, unused;
  Eigen::VectorXd r, plus, minus;
  // Near rest, where the rows are used: the rotation's logarithm is linearised about zero.
  scene.window.clones[3].T_W_I = scene.window.clones[3].T_W_I_fej =
      scene.window.clones[1].T_W_I.boxplus((Vector6d() << 1e-5, 2e-5, -1e-5, 1e-4, 2e-4, -1e-4).finished());
  zeroVelocityRows(scene.window, 1, 0.05, {0.002, 0.005}, &H, &r);
  ASSERT_EQ(r.size(), 9);
  const double h = 1e-6;
  for (int c = 0; c < scene.window.dimension(); ++c) {
    Eigen::VectorXd delta = Eigen::VectorXd::Zero(scene.window.dimension());
    delta(c) = h;
    WindowState a = scene.window, b = scene.window;
    a.boxplus(delta);
    b.boxplus(-delta);
    zeroVelocityRows(a, 1, 0.05, {0.002, 0.005}, &unused, &plus);
    zeroVelocityRows(b, 1, 0.05, {0.002, 0.005}, &unused, &minus);
    EXPECT_LT((-(plus - minus) / (2 * h) - H.col(c)).norm(), 1e-3 * (1.0 + H.col(c).norm())) << "column " << c;
  }
}

}  // namespace
}  // namespace vip_slam
