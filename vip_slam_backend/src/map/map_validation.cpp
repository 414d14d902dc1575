// SPDX-License-Identifier: BSD-3-Clause
#include "map_validation.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/map/map_limits.h"
#include "vip_slam_core/types/camera_correction.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {

bool isFinite(const NavState& s) {
  return std::isfinite(s.t) && s.T_W_I.isFinite() && s.v_W.allFinite() && s.bias_gyro.allFinite() &&
         s.bias_accel.allFinite();
}

bool isFinite(const Preintegration& factor) {
  return factor.deltaR().allFinite() && factor.alpha().allFinite() && factor.beta().allFinite() &&
         factor.sqrtInformation().allFinite();
}

bool isGyroCorrection(const Eigen::Matrix3d& correction) { return correction.allFinite() && correction.norm() < 1; }

bool isImuNoiseScale(const ImuNoiseScale& scale) {
  const auto usable = [](double factor) { return factor > 0 && factor <= map_limits::kLargest; };
  return usable(scale.density) && usable(scale.gyro_walk) && usable(scale.accel_walk);
}

std::string validateImu(const std::vector<ImuSample>& imu) {
  for (std::size_t k = 0; k < imu.size(); ++k) {
    const ImuSample& s = imu[k];
    if (!std::isfinite(s.t) || !s.gyro.allFinite() || !s.accel.allFinite())
      return formatted("IMU sample %zu is not finite", k);
    if (k > 0 && !(s.t > imu[k - 1].t))
      return formatted("IMU sample %zu at %.6f s is not after the one before, at %.6f s", k, s.t, imu[k - 1].t);
    if (s.gyro.norm() > map_limits::kLargest)
      return formatted("IMU sample %zu turns by %g rad/s, at most %g", k, s.gyro.norm(), map_limits::kLargest);
    if (s.accel.norm() > map_limits::kLargest)
      return formatted("IMU sample %zu reads %g m/s^2, at most %g", k, s.accel.norm(), map_limits::kLargest);
  }
  const double span = imu.empty() ? 0.0 : imu.back().t - imu.front().t;
  if (span > map_limits::kLargest)
    return formatted("IMU samples span %.0f s, at most %.0f", span, map_limits::kLargest);
  return "";
}

bool agreeInDuration(const std::vector<ImuSample>& imu, const TrackedFrame& from, const TrackedFrame& to) {
  const double duration = (to.t + to.time_offset) - (from.t + from.time_offset);
  return std::abs(imu.back().t - imu.front().t - duration) <= map_limits::kImuDuration;
}

bool continues(const std::vector<ImuSample>& imu, const std::vector<ImuSample>& before) {
  const double end = before.back().t;
  return std::abs(imu.front().t - end) <= map_limits::kRounding && imu.at(1).t > end;
}

bool isAreaFinite(const PlaneEstimate& plane) {
  const auto finite = [](const Ring& ring) {
    return std::all_of(ring.begin(), ring.end(), [](const Eigen::Vector3d& p) { return p.allFinite(); });
  };
  return std::isfinite(plane.area) && std::all_of(plane.polygons.begin(), plane.polygons.end(), [&](const auto& piece) {
           return finite(piece.outer) && std::all_of(piece.holes.begin(), piece.holes.end(), finite);
         });
}

std::string validateKeyframe(const Keyframe& keyframe) {
  const std::string name = "keyframe " + std::to_string(keyframe.id) + ": ";
  if (keyframe.id == 0) return "keyframe without an id (0)";
  if (!std::isfinite(keyframe.frame.t)) return name + "stamp is not finite";
  if (!isFinite(keyframe.frame.state)) return name + "state is not finite";
  if (!keyframe.frame.T_I_C.isFinite()) return name + "extrinsics are not finite";
  if (!keyframe.frame.T_chain_C.isFinite()) return name + "chained pose is not finite";
  if (!std::isfinite(keyframe.frame.time_offset)) return name + "the camera's delay is not finite";
  const DepthGrid& grid = keyframe.frame.depth_grid;
  if (!grid.empty() && grid.stride <= 0) return name + "depth grid without a stride";
  if (grid.cols < 0 || grid.rows < 0 || grid.z.size() != std::size_t(grid.cols) * std::size_t(grid.rows))
    return name + "depth grid of " + std::to_string(grid.z.size()) + " nodes, expected " + std::to_string(grid.cols) +
           " x " + std::to_string(grid.rows);
  const auto& features = keyframe.frame.features;
  for (std::size_t k = 0; k < features.size(); ++k) {
    const Feature& f = features[k];
    if (!f.pixel.allFinite() || !f.xy.allFinite() || !std::isfinite(f.depth) || !std::isfinite(f.depth_sigma) ||
        !std::isfinite(f.pixel_sigma) || !std::isfinite(f.angle))
      return name + "feature " + std::to_string(k) + " is not finite";
    if (f.depth < 0 || (f.depth > 0 && !(f.depth_sigma > 0)))
      return name + formatted("feature %zu has depth %g with sigma %g", k, f.depth, f.depth_sigma);
  }
  if (const std::string imu = validateImu(keyframe.imu); !imu.empty()) return name + imu;
  // The newest keyframe's camera correction is applied to all keyframes.
  const std::string camera = validateCameraCorrection(keyframe.frame.camera_correction);
  if (!camera.empty()) return name + "the camera's correction: " + camera;
  if (!isGyroCorrection(keyframe.gyro_correction))
    return name + "the gyro's correction is not finite, or could turn rates round";
  if (!isImuNoiseScale(keyframe.imu_noise_scale))
    return name + formatted(
                      "the scale of the IMU's noise is %g, of its random walks %g (gyroscope) and %g "
                      "(accelerometer), expected more than 0, at most %g",
                      keyframe.imu_noise_scale.density, keyframe.imu_noise_scale.gyro_walk,
                      keyframe.imu_noise_scale.accel_walk, map_limits::kLargest);
  if (!keyframe.depth_noise.isUsable())
    return name + formatted("the parts of the depth noise are %g (white) and %g (shared), expected variances",
                            keyframe.depth_noise.white, keyframe.depth_noise.shared);
  if (keyframe.motion.known() && !keyframe.motion.isUsable())
    return name + "the odometry's motion is not finite, or its covariance is none";
  return "";
}

}  // namespace vip_slam
