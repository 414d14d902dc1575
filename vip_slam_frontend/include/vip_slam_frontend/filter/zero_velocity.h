// Zero-velocity updates: when is the body still, and what does stillness say.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_frontend/filter/filter_options.h"
#include "vip_slam_frontend/filter/window_state.h"

namespace vip_slam {

struct ImuSpread {
  Eigen::Vector3d mean_gyro = Eigen::Vector3d::Zero(), mean_accel = Eigen::Vector3d::Zero();
  double gyro_std = 0, accel_std = 0;      ///< norm of the per-axis standard deviations
  double gyro_floor = 0, accel_floor = 0;  ///< what sensor noise alone would give, 0 when unknown
  std::size_t count = 0;

  /// Deviations no larger than the limits, or than sensor noise explains.
  bool quiet(double max_gyro_std, double max_accel_std) const;
};
/// `noise` may be null: then the floors stay 0.
ImuSpread imuSpread(const std::vector<ImuSample>& samples, const ImuNoise* noise = nullptr);

/// What one image says about motion.
struct StillnessCues {
  ImuSpread imu;                    ///< over ZuptOptions::window
  double disparity_px = -1;         ///< mean image motion over the same time; < 0: unknown
  double anchor_disparity_px = -1;  ///< since standing still began; < 0: unknown
  int tracks = 0;
  double speed = 0;         ///< estimated, m/s
  double px_per_metre = 0;  ///< image motion of a translation in the direction that shows least; 0: unknown
};

/// How much the images moved while still, as a share of what standing still allows: factors on the sigmas of what it
/// says. A turn shows alike near and far, a step the less the farther all is.
struct Unrest {
  double rotation = 1.0, translation = 1.0;
};

/// Still only when the IMU is quiet and the image stands and the estimate is slow; with hysteresis both ways. The image
/// alone is never enough: a wall that moves along would fool it. Who stands and sees nothing (darkness, a bare wall)
/// goes on standing as long as the IMU's means stay where they were: no motion begins without an acceleration or a
/// turn.
class StillnessDetector {
 public:
  explicit StillnessDetector(const ZuptOptions& options) : options_(options) {}
  bool update(const StillnessCues& cues);
  /// A start at rest: still from here on. `rest`: the IMU while it stood.
  void begin(const ImuSpread& rest);
  bool still() const { return still_; }
  /// Ones when the images do not tell.
  const Unrest& unrest() const { return unrest_; }
  /// The IMU alone says that nothing has happened since it last stood still, not long ago.
  bool imuRests() const { return imu_rests_; }
  void reset();

 private:
  ZuptOptions options_;
  bool still_ = false, imu_rests_ = false;
  int in_a_row_ = 0;
  int since_still_ = 1 << 20;  ///< images
  Unrest unrest_;
  ImuSpread rest_;  ///< the IMU's means at rest
};

/// Image motion, px per metre in the mean square, of a translation in the direction that shows least (along the view,
/// mostly). `points`: in the camera, metres. 0 without points.
double leastImageMotion(const std::vector<Eigen::Vector3d>& points, double focal);

/// Whitened rows on the newest clone and the nav state: v = 0, and no rotation or translation against the clone at
/// `anchor` (index in the window; -1: velocity only). `repeats` counts the images since stopping: they repeat the same
/// statement, so the sigmas grow with its root, up to threefold. `unrest`: who sways a little is still, but not as
/// still as a tripod.
void zeroVelocityRows(const WindowState& window, int anchor, int repeats, const Unrest& unrest,
                      const ZuptOptions& options, Eigen::MatrixXd* H, Eigen::VectorXd* h);

}  // namespace vip_slam
