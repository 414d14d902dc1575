// SPDX-License-Identifier: BSD-3-Clause
// Whether the body stands still: the IMU's spread and the motion of the tracks' pixels over a short time.
#pragma once

#include <deque>
#include <utility>
#include <vector>

#include "vip_slam_frontend/filter/zero_velocity.h"
#include "vip_slam_frontend/inertial/inertial_input.h"
#include "vip_slam_frontend/tracking/feature_tracker.h"

namespace vip_slam::frontend {

class Rest {
 public:
  Rest(const ZuptOptions& options, const ImuNoise& noise) : options_(options), noise_(noise), detector_(options) {}

  bool still() const { return still_; }
  /// What is left of the motion; empty when the body moves.
  std::optional<ResidualMotion> residualMotion() const;
  /// Whether the body stood still not long ago and by the IMU alone has not moved since.
  bool imuRests() const { return detector_.imuRests(); }
  /// Whether the IMU's spread until t_imu is that of a body at rest; from `since`, IMU clock, or earlier.
  bool imuIsQuiet(const InertialInput& inertial, double since, double t_imu) const;

  /// A start at rest: still from here on, as over `seconds` until t_imu.
  void begin(const InertialInput& inertial, double t_imu, double seconds);
  /// One image, t_imu, after the last one at `previous_t_imu`, IMU clock, s.
  struct View {
    const std::vector<Track>* tracks;
    bool counts;  ///< its motion is the camera's, not that of a body that may pause
    double speed, sigma_velocity, sigma_px, px_per_radian, px_per_metre;  ///< see StillnessCues
  };
  void decide(const InertialInput& inertial, double previous_t_imu, double t_imu, const View& view);
  void reset();

 private:
  using PixelList = std::vector<std::pair<LandmarkId, Eigen::Vector2f>>;

  /// Median motion of the common ones, px; < 0: too few.
  static double disparity(const PixelList& then, const PixelList& now);
  bool isStill(const InertialInput& inertial, double previous_t_imu, double t_imu, const View& view);

  ZuptOptions options_;
  ImuNoise noise_;
  StillnessDetector detector_;
  bool still_ = false;
  std::deque<std::pair<double, PixelList>> recent_pixels_;  ///< over the window of time
  PixelList anchor_;                                        ///< when standing still began
};

}  // namespace vip_slam::frontend
