// SPDX-License-Identifier: BSD-3-Clause
// The front end's implementation: what it owns and the steps of one image.
#pragma once

#include <cmath>
#include <optional>

#include "vip_slam_core/types/session_numbers.h"
#include "vip_slam_frontend/filter/vio_filter.h"
#include "vip_slam_frontend/front_end.h"
#include "vip_slam_frontend/inertial/inertial_input.h"
#include "vip_slam_frontend/initialisation/initialiser.h"
#include "vip_slam_frontend/tracking/feature_tracker.h"
#include "vip_slam_frontend/tracking/orb_extractor.h"
#include "vip_slam_frontend/tracking/row_camera.h"
#include "vip_slam_frontend/tracking/surface_tracker.h"

#include "parts/depth_input.h"
#include "parts/health.h"
#include "parts/image_step.h"
#include "parts/input_checks.h"
#include "parts/keyframes.h"
#include "parts/map_link.h"
#include "parts/motion_sources.h"
#include "parts/rest.h"
#include "parts/seen_bodies.h"

namespace vip_slam {

class FrontEnd::Impl {
 public:
  Impl(const FrontEndOptions& options, const SensorConfig& sensor, TimingLog* timing, double clock_jump,
       const SessionNumbers& first);

  bool addImu(const ImuSample& sample);
  bool addGyro(double t, const Eigen::Vector3d& gyro);
  bool addAccel(double t, const Eigen::Vector3d& accel);
  bool ready(double t_image, double depth_lag) const {
    const double last = std::max(0.5 * std::abs(readout()), depth_lag + 0.5 * sensor_.depth_rolling_shutter);
    return inertial_.covers(t_image + timeOffset() + last);
  }
  FrameOutput process(const FrameInput& input, const FrontEnd::PoseReady& on_pose);
  void applyMapUpdate(const MapUpdate& update);
  std::optional<NavState> predict(double t) const;
  Eigen::Vector3d gyro(double t) const { return sources_.rate(t); }
  CalibrationEstimate calibration() const;
  CalibrationEstimate givenCalibration() const;
  double timeOffset() const { return filter_.timeOffset(); }
  void reset(const std::string& reason);
  void clockRanBack(const std::string& reason);
  void forgetMap() { map_.forgetMap(); }

  FrontEndCounters counters_;
  FrontEndOptions options_;

 private:
  using DepthReading = frontend::DepthReading;
  using ImageStep = frontend::ImageStep;

  SE3 extrinsics() const { return filter_.extrinsics(); }
  /// Seconds from the first to the last row of a colour image.
  double readout() const { return sensor_.rolling_shutter + filter_.readout(); }
  /// Applies the filter's estimate of the depth image's shift and delay to the depth images to come.
  void followDepth();
  /// Brings the readings to the unit of the first ones when it changes with this image.
  void followDepthUnit(ImageStep* step);
  /// Starts anew when there is one.
  void noticeTimeJump(const std::string& jump);
  void countImu();

  FrameOutput initialise(const ImageStep& step);
  FrameOutput trackImage(ImageStep step, const FrontEnd::PoseReady& on_pose);
  // The steps of trackImage() in their order. Those that may end the image give its output then.
  /// Motion sources before tracking: the IMU, or images and depth where no sound gyro tells the turn.
  std::optional<FrameOutput> predictMotion(ImageStep* step);
  /// Prediction by the IMU's samples and stand-ins, widened by gaps and a gyro at the limit of its range.
  std::optional<FrameOutput> propagate(ImageStep* step);
  std::optional<FrameOutput> trackPoints(ImageStep* step);
  /// Prediction by images where there is no IMU, or where it is at fault.
  void isolateFaults(ImageStep* step);
  /// Decides stillness, updates the filter with features and surfaces, and counts.
  void updateFilter(ImageStep* step);
  FrameOutput startAnew(const ImageStep& step, const std::string& reason);
  /// What this image says about its pose.
  frontend::Sight sight(const ImageStep& step) const;
  /// Why this image becomes a keyframe; empty when it does not.
  std::string keyframeReason(const ImageStep& step);
  /// Tracked points in the camera frame, m; points without depth are put at the depth camera's maximum range.
  std::vector<Eigen::Vector3d> trackedPoints() const;
  /// Poses of the colour camera during a rolling-shutter readout, given the state at the stamp; null: global shutter.
  std::shared_ptr<const RowPoses> rows(const Readout& readout, const NavState& nav) const;
  std::shared_ptr<const RowPoses> colourRows(const NavState& nav) const {
    return rows(Readout::around(readout()), nav);
  }
  /// The depth image as seen at the stamp of the colour image, when it has another stamp or a rolling shutter.
  cv::Mat depthAtStamp(const DepthReading& depth, const NavState& nav);
  std::vector<FilterMeasurement> measurements(const Propagation& propagation) const;
  SurfaceMatches matchSurfaces(const ImageStep& step);
  /// The newest image becomes the reference when the old one is about to leave the window or to go out of view.
  void renewSurfaces(const cv::Mat& depth, std::size_t matched, double t);
  bool imuIsContradicted() const;
  /// Whether the pixels equal those of the image before although the IMU says that the camera moved.
  bool repeatsLastImage(const cv::Mat& gray, double t_imu) const;
  /// Whether the IMU predicts visible image motion between the camera pose T_odom_C_then and the image at t_imu.
  bool movesByImu(double t_imu, const SE3& T_odom_C_then) const;
  FrameOutput repeatedImage(double t, double t_imu);
  /// The motion since the tracker's images, `seconds` before this one, by all pixels.
  std::optional<frontend::AlignedMotion> align(const ImageStep& step, double seconds);

  FrameOutput makeOutput(double t, double t_imu, const std::string& keyframe_reason);
  std::shared_ptr<TrackedFrame> makeFrame(double t, bool with_features) const;
  /// Planes and back end assume a global shutter: moves rolling-shutter pixels to where the camera at the stamp sees
  /// them.
  void placeAtStamp(std::vector<Feature>* features) const;
  /// Adds the estimated depth offset, m, for output; tracker and filter keep the raw readings. 0 stays 0.
  float trueDepth(float reading) const;
  void correctDepth(std::vector<Feature>* features) const;
  /// Depth grid of the newest depth image, without regions which move independently of the camera.
  DepthGrid depthGrid(int stride) const;
  KeyframePtr makeKeyframe(const TrackedFrame& frame, double t_imu);
  FrameOutput statusOnly(double t, TrackingState state, const std::string& reason) const;
  /// An image that cannot be used, and why. LOST once the IMU alone has carried the pose for too long, or has ended.
  FrameOutput unusable(double t, const std::string& why);

  SensorConfig sensor_;
  TimingLog* timing_;
  std::shared_ptr<const CameraModel> camera_;
  frontend::InputChecks checks_;
  frontend::InertialInput inertial_;
  frontend::DepthInput depth_input_;
  FeatureTracker tracker_;
  frontend::SeenBodies bodies_;
  SurfaceTracker surfaces_;
  frontend::MapLink map_;
  OrbExtractor orb_;
  VioFilter filter_;
  frontend::MotionSources sources_;
  Initialiser initialiser_;
  frontend::Rest rest_;
  frontend::Keyframes keyframes_;

  frontend::Health health_;
  std::uint32_t epoch_;
  double last_imu_t_ = -1e300;  ///< IMU time of the newest image
  CloneId next_clone_ = 1;
};

}  // namespace vip_slam
