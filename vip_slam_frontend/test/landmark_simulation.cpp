// SPDX-License-Identifier: BSD-3-Clause
#include "landmark_simulation.h"

#include <algorithm>
#include <cmath>

namespace vip_slam::testing {

namespace {

Eigen::Vector3d gaussian(std::mt19937& random, double sigma) {
  std::normal_distribution<double> normal(0.0, 1.0);
  const double x = normal(random), y = normal(random), z = normal(random);
  return sigma * Eigen::Vector3d(x, y, z);
}

}  // namespace

LandmarkSimulation::LandmarkSimulation(const SimulationOptions& options) : options_(options), random_(options.seed) {
  Eigen::Matrix3d R_I_C;
  R_I_C << 0, 0, 1, -1, 0, 0, 0, -1, 0;  // camera looks along the body's x
  T_I_C_ = SE3(Eigen::Matrix3d(R_I_C * expSO3(Eigen::Vector3d(0.02, -0.03, 0.01))), Eigen::Vector3d(0.05, 0.02, -0.01));
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const Eigen::Vector3d half(4.5, 3.5, 1.6);
  for (int i = 0; i < options.points; ++i) {
    // As arguments of one call they would be drawn in the compiler's order, not the same on every processor.
    const double z = unit(random_), y = unit(random_), x = unit(random_);
    Eigen::Vector3d p(half.x() * x, half.y() * y, half.z() * z);
    const int axis = i % 3;
    p(axis) = unit(random_) > 0 ? half(axis) : -half(axis);
    // Clutter in front of the walls.
    if (i % 5 == 0) p *= 0.8;
    points_.push_back(p);
  }
  track_.assign(points_.size(), kNoLandmark);
  creep_.assign(points_.size(), Eigen::Vector2d::Zero());
  crept_ = creep_;
  generateImu(0.0);
}

SE3 LandmarkSimulation::poseAt(double t) const {
  const double s = t * options_.speed;
  const Eigen::Vector3d p(1.6 * std::sin(0.5 * s), 1.2 * std::sin(0.7 * s + 0.3) - 1.2 * std::sin(0.3),
                          0.4 * std::sin(0.9 * s));
  const double yaw = 1.2 * std::sin(0.45 * s) + 0.3 * std::sin(1.3 * s), pitch = 0.25 * std::sin(0.8 * s + 1.0),
               roll = 0.2 * std::sin(1.1 * s + 2.0);
  const Eigen::Quaterniond q = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                               Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
  return SE3(q, p);
}

NavState LandmarkSimulation::stateAt(double t) const {
  NavState state;
  state.t = t;
  state.T_W_I = poseAt(t);
  const double h = 1e-4;
  state.v_W = (poseAt(t + h).t() - poseAt(t - h).t()) / (2 * h);
  const auto index = std::min<std::size_t>(bias_gyro_.size() - 1,
                                           static_cast<std::size_t>(std::max(0.0, t * options_.imu_rate + 0.5)));
  state.bias_gyro = bias_gyro_[index];
  state.bias_accel = bias_accel_[index];
  return state;
}

void LandmarkSimulation::generateImu(double until) {
  const double dt = 1.0 / options_.imu_rate, h = 1e-4;
  const double on = options_.imu_noise ? 1.0 : 0.0;
  if (bias_gyro_.empty()) {
    bias_gyro_.push_back(gaussian(random_, 0.005 * on));
    bias_accel_.push_back(gaussian(random_, 0.04 * on));
  }
  while (imu_.empty() || imu_.back().t < until + 0.1) {
    const double t = static_cast<double>(imu_.size()) * dt;
    const SE3 a = poseAt(t - h), b = poseAt(t), c = poseAt(t + h);
    ImuSample sample;
    sample.t = t;
    sample.gyro = logSO3(Eigen::Matrix3d(a.R().transpose() * c.R())) / (2 * h);
    sample.gyro += options_.gyro_error * sample.gyro;
    const Eigen::Vector3d acceleration = (a.t() - 2 * b.t() + c.t()) / (h * h);
    sample.accel = b.R().transpose() * (acceleration + gravityVector());
    sample.gyro += bias_gyro_.back() + gaussian(random_, on * options_.noise.gyro_noise_density / std::sqrt(dt));
    sample.accel += bias_accel_.back() + gaussian(random_, on * options_.noise.accel_noise_density / std::sqrt(dt));
    imu_.push_back(sample);
    bias_gyro_.push_back(bias_gyro_.back() + gaussian(random_, on * options_.noise.gyro_random_walk * std::sqrt(dt)));
    bias_accel_.push_back(bias_accel_.back() +
                          gaussian(random_, on * options_.noise.accel_random_walk * std::sqrt(dt)));
  }
}

std::vector<ImuSample> LandmarkSimulation::imuBetween(double t0, double t1) const {
  std::vector<ImuSample> samples;
  const auto first = static_cast<std::size_t>(std::max(0.0, std::floor(t0 * options_.imu_rate)));
  for (std::size_t i = first; i + 1 < imu_.size() && imu_[i].t < t1; ++i) {
    const ImuSample &a = imu_[i], &b = imu_[i + 1];
    const auto at = [&](double t) {
      const double s = (t - a.t) / (b.t - a.t);
      return ImuSample{t, (1 - s) * a.gyro + s * b.gyro, (1 - s) * a.accel + s * b.accel};
    };
    if (samples.empty() && b.t > t0) samples.push_back(at(std::max(a.t, t0)));
    if (!samples.empty() && b.t > t0 && std::min(b.t, t1) > samples.back().t + 1e-9) {
      samples.push_back(at(std::min(b.t, t1)));
    }
  }
  return samples;
}

std::vector<FilterMeasurement> LandmarkSimulation::sight(double t, std::size_t most) {
  const Eigen::Matrix3d given = options_.bearing.matrix().inverse();
  std::vector<FilterMeasurement> seen;
  if (t > options_.blind_from && t < options_.blind_until) {
    std::fill(track_.begin(), track_.end(), kNoLandmark);
    return seen;
  }
  const SE3 T_C_W = (poseAt(t) * T_I_C_).inverse();
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  // Running tracks come first, as in a tracker.
  for (const bool running : {true, false}) {
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if ((track_[i] != kNoLandmark) != running) continue;
      const Eigen::Vector3d p = T_C_W * points_[i];
      const bool visible = p.z() > 0.4 && std::abs(p.x() / p.z()) < 0.62 && std::abs(p.y() / p.z()) < 0.46;
      // Some tracks end at random.
      const bool survives = !running || unit(random_) > 0.02;
      if (!visible || !survives || seen.size() >= most) {
        if (running) track_[i] = kNoLandmark;
        continue;
      }
      if (!running) {
        track_[i] = next_++;
        if (options_.creep_ratio > 0) {
          const bool creeps = unit(random_) < options_.creep_ratio;
          creep_[i] = gaussian(random_, creeps ? options_.creep_px : 0.0).head<2>();
          crept_[i].setZero();
        }
      }
      crept_[i] += creep_[i];
      FilterMeasurement m;
      m.id = track_[i];
      const Eigen::Vector3d noise = gaussian(random_, 1.0);
      // The row is read a moment before or after the stamp; what the tracker knows of it is taken back.
      constexpr double kHeight = 0.92;  // of the image, as a bearing
      const double row = p.y() / p.z() / kHeight;
      const auto bearingAt = [&](double moment) {
        const Eigen::Vector3d then = (poseAt(moment) * T_I_C_).inverse() * points_[i];
        return Eigen::Vector2d((given * then).head<2>() / then.z());
      };
      const double late = row * (options_.readout - read_within_);
      m.by_readout = -row * (bearingAt(t + 1e-4) - bearingAt(t - 1e-4)) / 2e-4;
      m.xy = (late == 0 ? Eigen::Vector2d((given * p).head<2>() / p.z()) : bearingAt(t + late)) +
             (noise.head<2>() * options_.sigma_px + crept_[i]) / options_.focal;
      if (unit(random_) < options_.outlier_ratio) m.xy += Eigen::Vector2d(0.05, -0.04);
      m.by_intrinsics = bearingJacobian(m.xy);
      if (options_.depth) {
        m.depth_sigma = options_.depth_a + options_.depth_c * p.z() * p.z();
        // All points lie on surfaces along the room's axes.
        const Eigen::Vector3d n = T_C_W.R().col(static_cast<int>(i % 3));
        const Eigen::Vector3d ray = p / p.z();
        const Eigen::Vector2d beside = options_.depth_shift - read_with_;
        const double read = p.z() * n.dot(ray) / (n.dot(ray) - n.head<2>().dot(beside));
        m.depth_slope = -p.z() / n.dot(ray) * n.head<2>();
        // The same ray of the camera of another moment meets the wall elsewhere.
        const auto at = [&](double moment) {
          const SE3 T_W_then = poseAt(moment) * T_I_C_;
          const Eigen::Vector3d n_W = Eigen::Vector3d::Unit(static_cast<int>(i % 3));
          return n_W.dot(points_[i] - T_W_then.t()) / n_W.dot(T_W_then.R() * ray);
        };
        m.depth_rate = (at(t + 1e-4) - at(t - 1e-4)) / 2e-4;
        const double late = options_.depth_delay - read_late_;
        const double older = late == 0 ? 0.0 : at(t - late) - p.z();
        m.depth = options_.depth_scale * (read + older) + options_.depth_offset + noise.z() * m.depth_sigma;
        m.depth_sigma *= options_.depth_told;
      }
      seen.push_back(m);
    }
  }
  return seen;
}

FilterOptions singlePixels() {
  FilterOptions options;
  options.depth_inflation = 1.0;
  options.pixel_inflation = 1.0;
  options.own_noise = false;
  options.pull_huber = 1000.0;
  return options;
}

RunResult runFilter(const SimulationOptions& options, const FilterOptions& filter_options, double seconds,
                    bool standing, const SE3& extrinsic_error, double time_offset_guess) {
  LandmarkSimulation simulation(options);
  simulation.generateImu(seconds + 1.0);
  std::mt19937 random(options.seed + 1000);
  ImuNoise noise = options.noise;
  noise.gyro_noise_density *= options.noise_told;
  noise.accel_noise_density *= options.noise_told;
  VioFilter filter(filter_options, noise, simulation.T_I_C() * extrinsic_error, time_offset_guess, options.focal, 9.81);
  FilterPrior prior;
  const NavState truth0 = simulation.stateAt(0.2);
  prior.state = truth0;
  prior.sigma_tilt = 0.01;
  prior.sigma_velocity = 0.03;
  prior.sigma_bias_gyro = 0.003;
  prior.sigma_bias_accel = 0.04;
  if (options.imu_noise) {
    const Eigen::Vector3d tilt = gaussian(random, prior.sigma_tilt);
    prior.state.T_W_I.setRotation(expQuaternion(Eigen::Vector3d(tilt.x(), tilt.y(), 0)) * truth0.T_W_I.rotation());
    prior.state.v_W += gaussian(random, prior.sigma_velocity);
    prior.state.bias_gyro += gaussian(random, prior.sigma_bias_gyro);
    prior.state.bias_accel += gaussian(random, prior.sigma_bias_accel);
  }
  CloneId id = 1;
  filter.start(prior, id++, simulation.imuBetween(0.15, 0.2).back().gyro - prior.state.bias_gyro);

  RunResult result;
  double nis = 0;
  int rows = 0, count = 0;
  Eigen::Vector3d last = truth0.T_W_I.t();
  const double step = 1.0 / options.image_rate;
  int marked = 0, motions = 0;
  NavState marked_truth, marked_estimate;
  for (int k = 1; 0.2 + k * step < seconds; ++k) {
    const double t_imu_true = 0.2 + k * step;  // the image stamp is this minus the true delay
    const double delay = t_imu_true < options.later ? options.time_offset : options.later_time_offset;
    const double t_imu = t_imu_true - delay + filter.window().time_offset;
    const Propagation propagation = filter.predict(simulation.imuBetween(filter.nav().t, t_imu));
    const StepReport report = filter.step(propagation, id++, simulation.sight(t_imu_true, options.most_points),
                                          standing ? std::optional<ResidualMotion>({0.002, 0.005}) : std::nullopt);
    if (std::abs(filter.depthCorrection()) > std::abs(result.most_depth_correction))
      result.most_depth_correction = filter.depthCorrection();
    result.depth_shift = filter.takeDepthShift();
    simulation.readDepthWith(result.depth_shift, filter.depthDelay());
    simulation.readRowsWithin(filter.readout());
    result.most_bearing_correction =
        std::max(result.most_bearing_correction, filter.bearingCorrection().value.cwiseAbs().maxCoeff());
    result.gyro_correction = filter.gyroCorrection();
    result.most_gyro_correction = std::max(result.most_gyro_correction, result.gyro_correction.cwiseAbs().maxCoeff());
    nis += report.nis;
    rows += report.rows;
    result.gated += report.features_gated;
    result.used += report.features_used;
    const NavState truth = simulation.stateAt(t_imu), estimate = filter.nav();
    result.length += (truth.T_W_I.t() - last).norm();
    last = truth.T_W_I.t();
    const Vector6d error = truth.T_W_I.boxminus(estimate.T_W_I);
    result.covariance_of_scale = filter.covarianceOfScale();
    result.covariance = filter.covariance();
    if (k * step > 1.0) {
      const Matrix6d P = result.covariance.topLeftCorner<6, 6>();
      result.nees += error.dot(P.ldlt().solve(error));
      ++count;
    }
    if (k - marked == (motions % 2 == 0 ? 8 : 20)) {
      const RelativeMotion motion = filter.motionSinceMark();
      if (marked > 0) {
        const SE3 T_true = marked_truth.T_W_I.inverse() * truth.T_W_I;
        const Vector6d off = T_true.boxminus(motion.T_a_b);
        result.motion_nees += off.dot(motion.covariance.ldlt().solve(off));
        result.motion_error += off.tail<3>().norm();
        result.newest_error += T_true.boxminus(marked_estimate.T_W_I.inverse() * estimate.T_W_I).tail<3>().norm();
        ++motions;
      }
      filter.markNewest();
      marked = k;
      marked_truth = truth;
      marked_estimate = estimate;
    }
    result.final_position = error.tail<3>().norm();
    result.final_rotation = error.head<3>().norm();
    result.final_velocity = (truth.v_W - estimate.v_W).norm();
  }
  result.nees /= std::max(1, count);
  result.motion_nees /= std::max(1, motions);
  result.nis_per_dof = rows > 0 ? nis / rows : 0;
  result.window = filter.window();
  result.calibration = filter.calibration();
  result.depth_noise_scale = filter.depthNoiseScale();
  return result;
}

}  // namespace vip_slam::testing
