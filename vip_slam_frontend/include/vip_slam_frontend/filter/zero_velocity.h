// SPDX-License-Identifier: BSD-3-Clause
// Zero-velocity updates: detection of standing still, and its measurement rows.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_frontend/filter/filter_options.h"
#include "vip_slam_frontend/filter/window_state.h"

namespace vip_slam {

/// Largest image motion of a camera that stands, px.
constexpr double kStillPixels = 0.5;
/// Time over which IMU and images are looked at for stillness, s.
constexpr double kRestWindow = 0.25;
/// Time over which the IMU is averaged at a start, s.
constexpr double kStandingSeconds = 0.5;

struct ImuSpread {
  Eigen::Vector3d mean_gyro = Eigen::Vector3d::Zero(), mean_accel = Eigen::Vector3d::Zero();
  double gyro_std = 0, accel_std = 0;      ///< norm of the per-axis standard deviations
  double gyro_floor = 0, accel_floor = 0;  ///< what sensor noise alone would give, 0 when unknown
  std::size_t count = 0;

  /// Whether the deviations are below the limits, or below what sensor noise explains.
  bool quiet(double max_gyro_std, double max_accel_std) const;
};
/// `noise` may be null: then the floors stay 0.
ImuSpread imuSpread(const std::vector<ImuSample>& samples, const ImuNoise* noise = nullptr);

/// Evidence of one image and the IMU samples before it about motion.
struct StillnessCues {
  ImuSpread imu;                    ///< over kRestWindow
  double disparity_px = -1;         ///< median image motion over the same time; < 0: unknown
  double anchor_disparity_px = -1;  ///< since standing still began; < 0: unknown
  int tracks = 0;
  double speed = 0, sigma_velocity = 0;  ///< estimated, m/s
  double sigma_px = 0;                   ///< of a track's pixel
  double px_per_radian = 0;
  double px_per_metre = 0;  ///< image motion of a translation in the direction that shows least; 0: unknown
};

/// Motion within kRestWindow that a standing body may still have, one sigma: rad and m.
struct ResidualMotion {
  double rotation, translation;
};

/// Still only when the IMU is quiet (later on: or its means are those of before), the image does not move and the
/// estimated velocity agrees with zero.
/// The image alone is never enough: a wall that moves along with the camera would deceive it. A body that stands and
/// sees nothing (darkness, a bare wall) stays still while the IMU's means stay unchanged: no motion begins without an
/// acceleration or a rotation.
class StillnessDetector {
 public:
  explicit StillnessDetector(const ZuptOptions& options) : options_(options) {}
  bool update(const StillnessCues& cues);
  /// A start at rest: still from here on. `rest`: the IMU while it stood.
  void begin(const ImuSpread& rest);
  /// By the image motion; while that is unknown, what the limits of the IMU may hide.
  const ResidualMotion& residualMotion() const { return residual_motion_; }
  /// Whether the body stood still and by the IMU alone has not moved since.
  bool imuRests() const { return imu_rests_; }
  void reset() { *this = StillnessDetector(options_); }

 private:
  ZuptOptions options_;
  bool still_ = false, imu_rests_ = false;
  ResidualMotion residual_motion_ = {};
  ImuSpread rest_;  ///< the IMU's means at rest
};

/// Root-mean-square image motion, px per metre, of a translation in the least visible direction (mostly along the
/// optical axis). `points`: in the camera frame, metres. 0 without points.
double leastImageMotion(const std::vector<Eigen::Vector3d>& points, double focal);

/// Whitened rows on the newest clone and the nav state: v = 0, and no rotation or translation against the clone at
/// `anchor` (index in the window; -1: velocity only). `dt`: since the image before, s. Images within kRestWindow show
/// the same motion, so that the variances are multiplied by their number.
void zeroVelocityRows(const WindowState& window, int anchor, double dt, const ResidualMotion& residual_motion,
                      Eigen::MatrixXd* H, Eigen::VectorXd* h);

}  // namespace vip_slam
