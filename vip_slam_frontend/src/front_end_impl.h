// The front end's implementation: what it owns and the steps of one image.
#pragma once

#include <deque>
#include <optional>
#include <utility>

#include "vip_slam_core/depth/missing_reading.h"
#include "vip_slam_core/types/session_numbers.h"
#include "vip_slam_frontend/filter/vio_filter.h"
#include "vip_slam_frontend/filter/zero_velocity.h"
#include "vip_slam_frontend/front_end.h"
#include "vip_slam_frontend/inertial/fault_detection.h"
#include "vip_slam_frontend/inertial/inertial_input.h"
#include "vip_slam_frontend/initialisation/initialiser.h"
#include "vip_slam_frontend/keyframes/keyframe_selector.h"
#include "vip_slam_frontend/tracking/dense_alignment.h"
#include "vip_slam_frontend/tracking/depth_rows.h"
#include "vip_slam_frontend/tracking/depth_unit.h"
#include "vip_slam_frontend/tracking/feature_tracker.h"
#include "vip_slam_frontend/tracking/frozen_depth.h"
#include "vip_slam_frontend/tracking/landmark_matcher.h"
#include "vip_slam_frontend/tracking/orb_extractor.h"
#include "vip_slam_frontend/tracking/row_camera.h"
#include "vip_slam_frontend/tracking/surface_tracker.h"

namespace vip_slam {

class FrontEnd::Impl {
 public:
  Impl(const FrontEndOptions& options, const SensorConfig& sensor, TimingLog* timing, double clock_jump,
       const SessionNumbers& first);

  bool addImu(const ImuSample& sample);
  bool addGyro(double t, const Eigen::Vector3d& gyro);
  bool addAccel(double t, const Eigen::Vector3d& accel);
  bool ready(double t_image, double depth_lag) const {
    const double last = std::max(0.5 * sensor_.rolling_shutter, depth_lag + 0.5 * sensor_.depth_rolling_shutter);
    return inertial_.covers(t_image + timeOffset() + last);
  }
  FrameOutput process(const FrameInput& input, const FrontEnd::PoseReady& on_pose);
  void applyMapUpdate(const MapUpdate& update);
  std::optional<NavState> predict(double t) const;
  Eigen::Vector3d gyro(double t) const;
  CalibrationEstimate calibration() const;
  CalibrationEstimate givenCalibration() const;
  double timeOffset() const {
    return filter_.started() ? filter_.window().time_offset : filter_.calibration().time_offset;
  }
  void reset(const std::string& reason);
  void clockRanBack(const std::string& reason);
  void forgetMap() { landmarks_.clear(); }

  FrontEndCounters counters_;
  FrontEndOptions options_;

 private:
  /// Longest time without depth that is normal, s: a depth camera slower than the colour camera leaves images without.
  static constexpr double kBetweenDepths = 0.5;

  enum class Phase { kWaiting, kInitialising, kTracking, kLost };

  /// TrackedFrame::T_chain_C for the body pose T_odom_I, at the newest image or a little later.
  SE3 chainedCamera(const SE3& T_odom_I) const;
  SE3 extrinsics() const { return filter_.started() ? filter_.window().T_I_C : filter_.calibration().T_I_C; }
  /// A depth image at its own stamp; empty when there is none.
  struct DepthReading {
    cv::Mat image;
    double lag = 0;  ///< its stamp minus that of the colour image, seconds
  };

  /// Applies the filter's estimate of the depth image's shift to the depth images to come.
  void followDepthShift();
  /// Brings the readings to the unit of the first ones when it changes with this image.
  void followDepthUnit(double t, double t_imu, DepthReading* depth);
  /// Empty when the input is usable, else what is wrong. Fills `depth` with the corrected and masked depth image.
  std::string checkInput(const FrameInput& input, DepthReading* depth);
  bool noticeTimeJump(double t, double newest, const char* what);
  void countImu();

  FrameOutput initialise(double t, double t_imu, const cv::Mat& gray, const DepthReading& depth);
  FrameOutput trackImage(double t, double t_imu, const cv::Mat& gray, const DepthReading& depth,
                         const FrontEnd::PoseReady& on_pose);
  /// Widens the prediction over [from, t_imu] by what an IMU gap or a gyro at the limit of its range leaves unknown.
  /// True when there was such a thing.
  bool admitDoubts(double max_gap, double from, double t_imu, Propagation* propagation);
  /// Decides stillness, updates the filter with features and surfaces, and counts. Times of the last image on the IMU
  /// clock and of this one on its own, s.
  StepReport updateFilter(const Propagation& propagation, const cv::Mat& depth, const SurfaceMatches& surfaces,
                          double previous_t_imu, double t);
  /// Reason why the estimate can no longer be trusted; empty when it can.
  std::string divergence(const StepReport& report, const TrackingResult& tracking, double t) const;
  /// Judges the tracking state and ends LOST when features are back. False when the position is too uncertain by then.
  bool resume(const TrackingResult& tracking, bool surfaces_hold, double t);
  /// Why this image becomes a keyframe; empty when it does not.
  std::string keyframeReason(const TrackingResult& tracking, bool has_depth, bool surfaces_hold, double t);
  /// Rotation of the camera between two IMU times by the gyro alone.
  SE3 gyroRotation(double t0, double t1) const;
  /// Gives the interval between two images stand-ins for the inertial channels that there are not, or for `both`: the
  /// turn between the images, and a constant velocity of `state`.
  void substitute(double t0, double t1, const SE3& T_current_previous, const NavState& state, bool both);
  /// Tracked points in the camera frame, m; points without depth are put at the depth camera's maximum range.
  std::vector<Eigen::Vector3d> trackedPoints() const;
  /// Whether the body stands still at this image; times of the last image and of this one on the IMU clock, s.
  bool decideStillness(double previous_t_imu, double t_imu);
  /// Poses of the colour camera during a rolling-shutter readout, given the state at the stamp; null: global shutter.
  std::shared_ptr<const RowPoses> rows(const Readout& readout, const NavState& nav) const;
  std::shared_ptr<const RowPoses> colourRows(const NavState& nav) const {
    return rows(Readout::around(sensor_.rolling_shutter), nav);
  }
  /// The depth image as seen at the stamp of the colour image, when it has another stamp or a rolling shutter.
  cv::Mat depthAtStamp(const DepthReading& depth, const NavState& nav);
  std::vector<FilterMeasurement> measurements() const;
  /// `turned`: rotation during the depth image's lag behind the colour image, rad.
  SurfaceMatches matchSurfaces(const cv::Mat& depth, const SE3& T_odom_C, double turned, double t);
  /// The newest image becomes the reference when the old one is about to leave the window or to go out of view.
  void renewSurfaces(const cv::Mat& depth, std::size_t matched, double t);
  /// The camera's motion since the last image as predicted by the IMU. While the prediction is in doubt it does not
  /// judge the points.
  PredictedMotion predictMotion(const Propagation& propagation, const SE3& T_odom_C, bool doubtful) const;
  /// Longest IMU gap over which the IMU is believed, s; in a longer one images and depth carry the pose.
  double longestImuGap() const { return 5.0 * options_.recovery.max_imu_gap; }
  /// Whether the image after an IMU gap shows the motion during the gap. Images taken inside the gap follow each other
  /// closely; when they are missing as well, enough tracks must survive and the rotation must be near the predicted
  /// one. `unseen`: time since the last image, s.
  static bool bridgesGap(const TrackingResult& tracking, std::size_t tracks_before, const PredictedMotion& prediction,
                         double unseen);
  bool imuIsContradicted() const;
  bool movedLately(double t_imu) const;
  /// Whether the images have contradicted the IMU for so long that tracking must restart.
  bool contradictedForLong(const TrackingResult& tracking, double t) const;
  /// Records the time when static points last agreed with the IMU.
  void noteAgreement(const TrackingResult& tracking, double t);
  /// Whether the pixels equal those of the image before although the IMU says that the camera moved.
  bool repeatsLastImage(const cv::Mat& gray, double t_imu) const;
  /// Whether the IMU predicts visible image motion between the camera pose T_odom_C_then and the image at t_imu.
  bool movesByImu(double t_imu, const SE3& T_odom_C_then) const;
  FrameOutput repeatedImage(double t, double t_imu);
  /// Whether the IMU is at fault in the interval before this image (fault_detection.h).
  bool imuIsAtFault(const TrackingResult& tracking, const PredictedMotion& prediction, const Propagation& propagation);
  /// Stand-ins for the IMU over the interval since the last image by the motion of the camera that images show, and the
  /// prediction with them. `motion`: by points; `aligned`: by all pixels.
  Propagation predictByImages(double t_imu, const MotionFit& motion, const frontend::AlignedMotion& aligned);
  /// The motion since the tracker's images, `seconds` before this one, by all pixels.
  std::optional<frontend::AlignedMotion> align(const cv::Mat& gray, const DepthReading& depth, double seconds,
                                               double t);
  /// `metric`: depth took part, by features or surfaces.
  void judge(const TrackingResult& tracking, bool metric, bool surfaces_hold, double t);
  /// Growth of the position's one sigma since the last image with enough features, m.
  double coastedSigma() const;

  FrameOutput makeOutput(double t, double t_imu, const std::string& keyframe_reason);
  std::shared_ptr<TrackedFrame> makeFrame(double t, bool with_features) const;
  /// Planes and back end assume a global shutter: moves rolling-shutter pixels to where the camera at the stamp sees
  /// them.
  void placeAtStamp(std::vector<Feature>* features) const;
  /// Removes the features that lie in regions which move independently of the camera.
  void dropMoving(std::vector<Feature>* features) const;
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
  const double clock_jump_;
  std::shared_ptr<const CameraModel> camera_;
  frontend::InertialInput inertial_;
  frontend::DenseAlignment dense_;  ///< where no gyro tells the turn, and at the start
  frontend::FaultDetection faults_;
  frontend::DepthUnit depth_unit_;
  MissingReading missing_reading_;
  FrozenDepth frozen_depth_;
  bool same_depth_ = false;                   ///< the newest depth image repeats the one before
  SE3 T_odom_depth_;                          ///< camera pose at the last image that brought new depth ...
  std::optional<std::uint32_t> depth_epoch_;  ///< ... and its epoch
  cv::Mat masked_;                            ///< not zero where depth is to be left out; empty: nowhere
  std::unique_ptr<DepthRows> depth_rows_;     ///< null until a depth image has to be warped to the stamp
  FeatureTracker tracker_;
  SE3 last_motion_;               ///< camera motion between the last two images, T_current_previous
  MovingRegions moving_;          ///< of the newest image
  double moving_imu_t_ = -1e300;  ///< IMU time of the last image with moving regions
  SurfaceTracker surfaces_;
  LandmarkMatcher landmarks_;
  OrbExtractor orb_;
  VioFilter filter_;
  Initialiser initialiser_;
  StillnessDetector stillness_;
  KeyframeSelector selector_;

  Phase phase_ = Phase::kWaiting;
  TrackingStatus status_{TrackingState::kWaiting, "waiting for the first image"};
  std::uint32_t epoch_;
  double last_image_t_ = -1e300;  ///< image clock
  double last_imu_t_ = -1e300;    ///< IMU time of the newest image
  CloneId next_clone_ = 1;
  KeyframeId next_keyframe_, last_keyframe_ = 0, newest_keyframe_ = 0;
  SE3 T_odom_keyframe_, T_chain_keyframe_;  ///< body and camera pose of the last keyframe
  double last_keyframe_imu_t_ = 0;
  bool keyframe_imu_broken_ = false;  ///< IMU gap or gyro saturation since the last keyframe
  double started_imu_t_ = 0;          ///< IMU time of this epoch's first state
  double last_good_t_ = 0;            ///< last image with enough features
  double last_good_variance_ = 0;     ///< position variance there, m^2
  double last_held_t_ = 0;            ///< last image with enough features or matched depth surfaces
  double last_depth_t_ = -1e300;      ///< last image with a depth image
  double last_metric_t_ = 0;          ///< last image in which depth took part
  double last_points_t_ = 0;          ///< last image with enough points that have depth
  double last_agreed_t_ = 0;          ///< last image whose points agreed with the IMU
  double cut_off_imu_t_ = -1e300;     ///< last image before which the gyro reached the limit of its range
  double silent_imu_t_ = -1e300;      ///< last image before which there were no IMU samples
  double fault_t_ = -1e300;           ///< last image before which the IMU was at fault
  int gated_in_a_row_ = 0;
  bool still_ = false;
  SE3 T_map_odom_;
  bool have_map_ = false;
  DepthShift depth_shift_;      ///< estimated by the filter, in addition to the sensor configuration's
  DepthCurve depth_curve_;      ///< estimated by the back end, applied after the sensor configuration's
  double disparity_error_ = 0;  ///< 1/m, part of the curve when the present estimate of the depth offset began
  using PixelList = std::vector<std::pair<LandmarkId, Eigen::Vector2f>>;
  std::deque<std::pair<double, PixelList>> recent_pixels_;  ///< over the stillness window
  PixelList still_anchor_;
};

}  // namespace vip_slam
