#include "vip_slam_frontend/initialisation/initialiser.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/statistics.h"
#include "vip_slam_frontend/filter/zero_velocity.h"
#include "vip_slam_frontend/initialisation/moving_start.h"
#include "vip_slam_frontend/tracking/outlier_rejection.h"

namespace vip_slam {

namespace {
constexpr double kWatched = 0.5;            // share of the standing time that images have to cover
constexpr double kMaxTurn = 0.3;            // rad/s, mean rate at rest that may be gyro bias
constexpr double kMaxOffGravity = 1.5;      // m/s^2, deviation from gravity at rest that may be accelerometer bias
constexpr int kFewestCommon = 5;            // features
constexpr std::size_t kFewestSamples = 10;  // of the IMU in the standing time
constexpr double kDepthMoved = 2.0;         // sigmas, and factor on the change between consecutive images
constexpr double kBetweenTries = 0.2;       // s, between attempts of a start in motion
constexpr double kBetweenPoses = 0.03;      // s, between the poses that a start in motion uses

// Calls f(xy in a, xy in b) for the features common to both; returns their number.
template <class F>
int forCommon(const std::vector<FilterMeasurement>& a, const std::vector<FilterMeasurement>& b, F f) {
  // Both lists are small; ids ascend within neither, so look each one up.
  std::map<LandmarkId, Eigen::Vector2d> first;
  for (const FilterMeasurement& m : a) first[m.id] = m.xy;
  int count = 0;
  for (const FilterMeasurement& m : b) {
    const auto it = first.find(m.id);
    if (it == first.end()) continue;
    f(it->second, m.xy);
    ++count;
  }
  return count;
}

/// Points with depth in `a` that `b` shows as well.
std::vector<PointPair> commonPoints(const InitialisationInput& a, const InitialisationInput& b) {
  std::map<LandmarkId, const FilterMeasurement*> first;
  for (const FilterMeasurement& m : a.features) {
    if (m.depth > 0) first[m.id] = &m;
  }
  std::vector<PointPair> pairs;
  for (const FilterMeasurement& m : b.features) {
    const auto it = first.find(m.id);
    if (it != first.end()) pairs.push_back({it->second->xy, m.xy, it->second->depth});
  }
  return pairs;
}

}  // namespace

double meanDisparity(const std::vector<FilterMeasurement>& a, const std::vector<FilterMeasurement>& b,
                     double focal_px) {
  double sum = 0;
  const int count =
      forCommon(a, b, [&](const Eigen::Vector2d& p, const Eigen::Vector2d& q) { sum += (p - q).norm() * focal_px; });
  return count < kFewestCommon ? -1.0 : sum / count;
}

double meanShift(const std::vector<FilterMeasurement>& a, const std::vector<FilterMeasurement>& b, double focal_px) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  const int count = forCommon(a, b, [&](const Eigen::Vector2d& p, const Eigen::Vector2d& q) { sum += q - p; });
  return count < kFewestCommon ? -1.0 : sum.norm() * focal_px / count;
}

double depthChange(const DepthGrid& a, const DepthGrid& b, const DepthNoise& noise) {
  if (a.z.size() != b.z.size()) return -1.0;
  std::vector<double> changes;
  for (std::size_t i = 0; i < a.z.size(); ++i) {
    if (a.z[i] > 0 && b.z[i] > 0) changes.push_back(std::abs(b.z[i] - a.z[i]) / noise.sigma(a.z[i]));
  }
  if (changes.size() < 30) return -1.0;
  return upperMedian(std::move(changes));
}

FilterPrior standingPrior(const std::vector<ImuSample>& samples, const FilterOptions& options, const ImuNoise& noise,
                          double gravity) {
  FilterPrior prior;
  const ImuSpread spread = imuSpread(samples);
  const double seconds = std::max(0.1, samples.back().t - samples.front().t);
  const Eigen::Vector3d up = spread.mean_accel.normalized();
  prior.standing = true;
  prior.state.t = samples.back().t;
  prior.state.T_W_I = SE3(gravityAlignedRotation(spread.mean_accel), Eigen::Vector3d::Zero());
  prior.state.bias_gyro = spread.mean_gyro;
  // At rest only the accelerometer bias along gravity is observable.
  prior.state.bias_accel = (spread.mean_accel.norm() - gravity) * up;
  prior.sigma_tilt = 0.3;
  prior.sigma_velocity = 0.02;
  prior.sigma_bias_accel = options.sigma_bias_accel;
  const double inflation = 2.0 * options.imu_noise_inflation;
  const double root = std::sqrt(seconds);
  prior.sigma_bias_gyro = std::min(
      options.sigma_bias_gyro, 2e-4 + inflation * (noise.gyro_noise_density / root + noise.gyro_random_walk * root));
  prior.sigma_mean_accel = 0.005 + inflation * (noise.accel_noise_density / root + noise.accel_random_walk * root);
  return prior;
}

void startAtBase(const SE3& T_base_imu, FilterPrior* prior) {
  if (T_base_imu.boxminus(SE3()).norm() < 1e-9) return;
  const SE3 T_W_base = prior->state.T_W_I * T_base_imu.inverse();
  const Eigen::Vector3d up_base = T_W_base.rotation().conjugate() * Eigen::Vector3d::UnitZ();
  const SE3 turn = alignLevelled(SE3(gravityAlignedRotation(up_base), Eigen::Vector3d::Zero()), T_W_base);
  prior->state.T_W_I = turn * prior->state.T_W_I;
  prior->state.v_W = turn.rotation() * prior->state.v_W;
}

Initialiser::Initialiser(const InitialisationOptions& options, const FilterOptions& filter, const ImuNoise& noise,
                         const SE3& T_I_C, double focal_px, double gravity, const DepthNoise& depth_noise)
    : options_(options),
      filter_(filter),
      noise_(noise),
      T_I_C_(T_I_C),
      focal_(focal_px),
      gravity_(gravity),
      depth_noise_(depth_noise) {}

void Initialiser::setCalibration(const SE3& T_I_C, const Eigen::Matrix3d& gyro_correction) {
  T_I_C_ = T_I_C;
  gyro_correction_ = gyro_correction;
}

void Initialiser::reset() {
  images_.clear();
  replaced_in_a_row_ = 0;
  next_try_t_ = -1e300;
  reason_ = "waiting for images and IMU";
}

std::optional<FilterPrior> Initialiser::add(const InitialisationInput& image, const ImuBuffer& imu) {
  images_.push_back(image);
  const double keep = std::max(options_.standing_seconds, options_.moving_seconds) + 0.5;
  while (images_.size() > 2 && images_.back().t_imu - images_.front().t_imu > keep) images_.pop_front();
  if (auto prior = standing(imu)) return prior;
  if (weighs_wrong_ || watches_rest_) return std::nullopt;
  if (image.t_imu < next_try_t_) {
    reason_ = refusal_;
    return std::nullopt;
  }
  auto prior = moving(imu);
  // A rejected attempt hardly improves with the next image, and costs tens of milliseconds.
  if (!prior) {
    next_try_t_ = image.t_imu + kBetweenTries;
    refusal_ = reason_;
  }
  return prior;
}

std::optional<FilterPrior> Initialiser::standing(const ImuBuffer& imu) {
  const double now = images_.back().t_imu;
  const double from = now - options_.standing_seconds;
  weighs_wrong_ = watches_rest_ = false;
  if (imu.empty() || imu.oldest() > from) {
    watches_rest_ =
        !imu.empty() &&
        imuSpread(imu.between(imu.oldest(), now), &noise_).quiet(options_.max_gyro_std, options_.max_accel_std);
    reason_ = formatted("gathering %.1f s of IMU", options_.standing_seconds);
    return std::nullopt;
  }
  const std::vector<ImuSample> samples = imu.between(from, now);
  const ImuSpread spread = imuSpread(samples, &noise_);
  if (samples.size() < kFewestSamples) {
    reason_ =
        formatted("%zu IMU samples in %.1f s, needs %zu", samples.size(), options_.standing_seconds, kFewestSamples);
    return std::nullopt;
  }
  const bool quiet = spread.quiet(options_.max_gyro_std, options_.max_accel_std);
  const double weight = spread.mean_accel.norm();
  weighs_wrong_ = quiet && std::abs(weight - gravity_) > kMaxOffGravity;
  if (weighs_wrong_) {
    reason_ =
        formatted("the accelerometer reads %.2f at rest, expected %.2f m/s^2: is its unit right?", weight, gravity_);
    return std::nullopt;
  }
  if (!quiet || spread.mean_gyro.norm() > kMaxTurn) {
    reason_ = "moving: gathering images for a start in motion";
    return std::nullopt;
  }
  // The oldest image inside the standing time shows whether the camera stood: for the IMU a uniform motion is quiet as
  // well. After a restart the IMU reaches back further than the images.
  std::size_t oldest = 0;
  while (oldest < images_.size() && images_[oldest].t_imu < from - 1e-9) ++oldest;
  if (oldest == images_.size() || now - images_[oldest].t_imu < kWatched * options_.standing_seconds) {
    watches_rest_ = true;
    reason_ = "IMU is quiet: watching whether the image moves";
    return std::nullopt;
  }
  const double disparity = meanDisparity(images_[oldest].features, images_.back().features, focal_);
  const bool turns_over = disparity < 0 && turnsOver(oldest);
  if (turns_over && replaced_in_a_row_ > 0) {
    reason_ = "IMU is quiet, all that is seen is new: watching whether the image moves";
    return std::nullopt;
  }
  if (turns_over || disparity > options_.max_disparity_px) {
    reason_ = "IMU is quiet but the image moves: gathering images for a start in motion";
    return std::nullopt;
  }
  if (disparity < 0 && depthMoved(images_[oldest])) {
    reason_ = "IMU is quiet but the depth moves: gathering images for a start in motion";
    return std::nullopt;
  }
  return standingPrior(samples, filter_, noise_, gravity_);
}

// Whether the view has moved on, when no feature of a second ago is left. The oldest image with common features decides
// by their mean motion vector: tracks of noise in the dark end as quickly, but move in all directions.
bool Initialiser::turnsOver(std::size_t oldest) {
  constexpr int kMaxReplaced = 5;  // images; when no track ever survives to the next image tracks are no evidence
  const std::vector<FilterMeasurement>& now = images_.back().features;
  if (static_cast<int>(now.size()) < options_.min_tracks) return false;
  for (std::size_t k = oldest + 1; k + 1 < images_.size(); ++k) {
    const double shift = meanShift(images_[k].features, now, focal_);
    if (shift < 0) continue;
    replaced_in_a_row_ = 0;
    return shift > options_.max_disparity_px;
  }
  if (replaced_in_a_row_ >= kMaxReplaced) return false;
  ++replaced_in_a_row_;
  return true;
}

bool Initialiser::depthMoved(const InitialisationInput& since) const {
  // A motion accumulates over time, unmodelled noise does not.
  const double all = depthChange(since.depth, images_.back().depth, depth_noise_);
  const double last = depthChange(images_[images_.size() - 2].depth, images_.back().depth, depth_noise_);
  return all > kDepthMoved && all > kDepthMoved * last;
}

bool Initialiser::chainPoses(std::vector<TimedCameraPose>* poses, std::size_t* broken) {
  poses->assign(1, {images_.front().t_imu, SE3()});
  std::size_t base = 0;
  SE3 T_first_base, T_base_last;
  for (std::size_t k = 1; k < images_.size(); ++k) {
    *broken = k;
    std::vector<PointPair> pairs = commonPoints(images_[base], images_[k]);
    if (static_cast<int>(pairs.size()) < options_.min_tracks && base != k - 1) {
      T_first_base = T_first_base * T_base_last;
      T_base_last = SE3();
      base = k - 1;
      pairs = commonPoints(images_[base], images_[k]);
    }
    if (static_cast<int>(pairs.size()) < options_.min_tracks) {
      reason_ = formatted("start in motion needs %d features with depth, has %zu", options_.min_tracks, pairs.size());
      return false;
    }
    SE3 T_k_base = T_base_last.inverse();
    std::vector<char> use(pairs.size(), 1);
    if (!refinePose(pairs, use, 1.0 / focal_, &T_k_base)) {
      reason_ = "start in motion: camera pose failed";
      return false;
    }
    T_base_last = T_k_base.inverse();
    if (k + 1 == images_.size() || images_[k].t_imu - poses->back().t_imu > kBetweenPoses) {
      poses->push_back({images_[k].t_imu, T_first_base * T_base_last});
    }
  }
  return true;
}

std::optional<FilterPrior> Initialiser::moving(const ImuBuffer& imu) {
  const auto enough = [this] {
    return images_.size() >= 5 && images_.back().t_imu - images_.front().t_imu >= options_.moving_seconds;
  };
  if (!enough()) return std::nullopt;
  std::vector<TimedCameraPose> poses;
  for (std::size_t broken = 0; !chainPoses(&poses, &broken);) {
    // The images after the break may suffice.
    images_.erase(images_.begin(), images_.begin() + static_cast<long>(broken));
    if (!enough()) return std::nullopt;
  }
  MovingStart start = solveMovingStart(poses, imu, T_I_C_, noise_, filter_, gravity_, gyro_correction_);
  if (!start.ok || start.gravity_error > options_.max_gravity_error) {
    reason_ = start.ok ? formatted(
                             "start in motion: gravity off by %.2f m/s^2, at most %g "
                             "(initialisation/max_gravity_error)",
                             start.gravity_error, options_.max_gravity_error)
                       : "start in motion: " + start.reason;
    images_.pop_front();
    return std::nullopt;
  }
  return start.prior;
}

}  // namespace vip_slam
