// SPDX-License-Identifier: BSD-3-Clause
// Depth images as they come, turned into readings as they are meant: missing readings, unit, shift, curve, mask.
#pragma once

#include <memory>
#include <optional>

#include <opencv2/core.hpp>

#include "vip_slam_core/depth/depth_curve.h"
#include "vip_slam_core/depth/depth_shift.h"
#include "vip_slam_core/depth/missing_reading.h"
#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/types/map_update.h"
#include "vip_slam_frontend/tracking/depth_rows.h"
#include "vip_slam_frontend/tracking/depth_unit.h"
#include "vip_slam_frontend/tracking/frozen_depth.h"

namespace vip_slam::frontend {

/// A depth image at its own moment; empty when there is none.
struct DepthReading {
  cv::Mat image;   ///< 32FC1, m, 0 or NaN: no reading
  double lag = 0;  ///< the moment that it shows minus that of the colour image, seconds
};

class DepthInput {
 public:
  DepthInput(const SensorConfig& sensor, std::shared_ptr<const CameraModel> camera);

  /// The corrected and masked readings of an image, which stays unchanged; `lag`: its stamp minus the colour image's,
  /// s.
  DepthReading read(const cv::Mat& depth, double lag);

  /// Whether the image, before read(), repeats the one before. `T_odom_last`: camera pose at the image before; empty:
  /// not tracking.
  bool repeats(const cv::Mat& depth, const std::optional<SE3>& T_odom_last);
  /// Camera pose when the depth image that is repeated was new.
  const SE3& repeatedPose() const { return *T_odom_new_; }

  /// Brings the readings of an image, taken at t (s) from about T_odom_C together with `gray`, to the unit of the first
  /// ones; true when the unit changes with it.
  bool followUnit(const cv::Mat& gray, const SE3& T_odom_C, double t, DepthReading* depth);
  /// The image at its final pose, to compare the next one's unit with.
  void remember(const cv::Mat& depth, const cv::Mat& gray, const SE3& T_odom_C, double t) {
    unit_.remember(depth, gray, T_odom_C, t);
  }

  /// Seconds by which depth shows an earlier moment than its stamp says, as estimated by the filter, for the images to
  /// come; true when it changes.
  bool followDelay(double seconds);
  /// Shift of the depth image as estimated by the filter, in bearings, for the images to come; true when it changes.
  bool followShift(const Eigen::Vector2d& bearing);
  /// What an update makes different for the images to come.
  struct Change {
    bool curve = false;         ///< readings are corrected differently
    bool voids_offset = false;  ///< so much that an estimated depth offset does not hold any more
  };
  /// Curve of the readings as estimated by the back end.
  Change followCurve(const MapUpdate& update);

  /// The depth image as seen at the stamp of the colour image; `rows`: poses of the camera during its readout.
  cv::Mat atStamp(const cv::Mat& depth, const RowPoses& rows);

  const DepthShift& shift() const { return shift_; }  ///< estimated, in addition to the sensor configuration's
  const DepthCurve& curve() const { return curve_; }  ///< estimated, applied after the sensor configuration's
  double disparityError() const { return disparity_error_; }
  double unit() const { return unit_.factor(); }  ///< factor that brings readings to the unit of the first ones
  float missingReading() const { return missing_.value(); }

  /// A new epoch: poses have another frame. What was learnt of the sensor stays.
  void reset();

 private:
  std::shared_ptr<const CameraModel> camera_;
  DepthCurve given_curve_;          ///< by the sensor's configuration
  double given_delay_, delay_ = 0;  ///< s, by the sensor's configuration and estimated
  Eigen::Vector2d given_shift_, focal_;
  cv::Mat masked_;  ///< not zero where depth is to be left out; empty: nowhere
  MissingReading missing_;
  DepthUnit unit_;
  FrozenDepth frozen_;
  bool same_ = false;              ///< the newest depth image repeats the one before
  std::optional<SE3> T_odom_new_;  ///< camera pose at the last image that brought new depth
  DepthShift shift_;
  DepthCurve curve_;
  double disparity_error_ = 0;       ///< 1/m, part of the curve when the present estimate of the depth offset began
  std::unique_ptr<DepthRows> rows_;  ///< null until a depth image has to be warped to the stamp
};

}  // namespace vip_slam::frontend
