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
/// IMU time that is looked at for stillness, s.
constexpr double kRestWindow = 0.25;
/// The same without usable images, and where an engine or fans shake the IMU, s: averaged over kRestWindow, a twentieth
/// of an engine's 1500 turns a minute (25 Hz) is left.
constexpr double kStandingSeconds = 1.0;

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

/// Means over `seconds` around each sample that has as much before and behind it: without what shakes faster.
std::vector<ImuSample> movingMeans(const std::vector<ImuSample>& samples, double seconds);

/// Evidence of one image and the IMU samples before it about motion.
struct StillnessCues {
  ImuSpread imu;                    ///< over kRestWindow
  ImuSpread unshaken;               ///< of moving means over kRestWindow, over kStandingSeconds
  double disparity_px = -1;         ///< mean image motion over the same time; < 0: unknown
  double anchor_disparity_px = -1;  ///< since standing still began; < 0: unknown
  int tracks = 0;
  double speed = 0;         ///< estimated, m/s
  double px_per_metre = 0;  ///< image motion of a translation in the direction that shows least; 0: unknown
};

/// Residual motion while still, from the image motion relative to its limit: factors on the sigmas of the zero-velocity
/// rows. A rotation shows equally near and far, a translation the less the farther the scene is.
struct ResidualMotion {
  double rotation = 1.0, translation = 1.0;
};

/// Still only when the IMU is quiet, the image does not move and the estimated speed is low; with hysteresis both ways.
/// An IMU that is shaken counts as quiet by its moving means, as long as the image is seen to stand still.
/// The image alone is never enough: a wall that moves along with the camera would deceive it. A body that stands and
/// sees nothing (darkness, a bare wall) stays still while the IMU's means stay unchanged: no motion begins without an
/// acceleration or a rotation.
class StillnessDetector {
 public:
  explicit StillnessDetector(const ZuptOptions& options) : options_(options) {}
  bool update(const StillnessCues& cues);
  /// A start at rest: still from here on. `rest`: the IMU while it stood.
  void begin(const ImuSpread& rest);
  bool still() const { return still_; }
  /// All ones when the image motion is unknown.
  const ResidualMotion& residualMotion() const { return residual_motion_; }
  /// Whether the body stood still not long ago and by the IMU alone has not moved since.
  bool imuRests() const { return imu_rests_; }
  void reset();

 private:
  ZuptOptions options_;
  bool still_ = false, imu_rests_ = false;
  int in_a_row_ = 0;
  int since_still_ = 1 << 20;  ///< images
  ResidualMotion residual_motion_;
  ImuSpread rest_;  ///< the IMU's means at rest
};

/// Root-mean-square image motion, px per metre, of a translation in the least visible direction (mostly along the
/// optical axis). `points`: in the camera frame, metres. 0 without points.
double leastImageMotion(const std::vector<Eigen::Vector3d>& points, double focal);

/// Whitened rows on the newest clone and the nav state: v = 0, and no rotation or translation against the clone at
/// `anchor` (index in the window; -1: velocity only). `repeats` counts the images since stopping: they repeat the same
/// measurement, so the sigmas grow with its root, up to threefold. `residual_motion`: larger for a camera held in the
/// hand than on a tripod.
void zeroVelocityRows(const WindowState& window, int anchor, int repeats, const ResidualMotion& residual_motion,
                      Eigen::MatrixXd* H, Eigen::VectorXd* h);

}  // namespace vip_slam
