// The front end's inside: what it owns and the steps of one image.
#pragma once

#include <deque>
#include <optional>
#include <utility>

#include "vip_slam_core/imu/gyro_range.h"
#include "vip_slam_core/imu/imu_buffer.h"
#include "vip_slam_frontend/filter/vio_filter.h"
#include "vip_slam_frontend/filter/zero_velocity.h"
#include "vip_slam_frontend/front_end.h"
#include "vip_slam_frontend/initialisation/initialiser.h"
#include "vip_slam_frontend/keyframes/keyframe_selector.h"
#include "vip_slam_frontend/tracking/depth_rows.h"
#include "vip_slam_frontend/tracking/feature_tracker.h"
#include "vip_slam_frontend/tracking/frozen_depth.h"
#include "vip_slam_frontend/tracking/landmark_matcher.h"
#include "vip_slam_frontend/tracking/orb_extractor.h"
#include "vip_slam_frontend/tracking/row_camera.h"
#include "vip_slam_frontend/tracking/surface_tracker.h"

namespace vip_slam {

class FrontEnd::Impl {
 public:
  Impl(const FrontEndOptions& options, const SensorConfig& sensor, TimingLog* timing, double clock_jump);

  bool addImu(const ImuSample& sample);
  bool addGyro(double t, const Eigen::Vector3d& gyro);
  bool addAccel(double t, const Eigen::Vector3d& accel);
  bool ready(double t_image, double depth_lag) const {
    const double last = std::max(0.5 * sensor_.rolling_shutter, depth_lag + 0.5 * sensor_.depth_rolling_shutter);
    return imu_.covers(t_image + timeOffset() + last);
  }
  FrameOutput process(const FrameInput& input, const FrontEnd::PoseReady& on_pose);
  void applyMapUpdate(const MapUpdate& update);
  std::optional<NavState> predict(double t) const;
  Eigen::Vector3d gyro(double t) const;
  MountingEstimate mounting() const;
  MountingEstimate givenMounting() const;
  double timeOffset() const {
    return filter_.started() ? filter_.window().time_offset : filter_.mounting().time_offset;
  }
  void reset(const std::string& reason);
  void clockRanBack(const std::string& reason);
  void forgetMap() { landmarks_.clear(); }

  FrontEndCounters counters_;
  FrontEndOptions options_;

 private:
  /// Depth cameras that are slower than the colour camera leave images without depth in between, s.
  static constexpr double kBetweenDepths = 0.5;

  enum class Phase { kWaiting, kInitialising, kTracking, kLost };

  /// TrackedFrame::T_chain_C of a body at T_odom_I, which is the newest image's or a little later.
  SE3 chainedCamera(const SE3& T_odom_I) const;
  SE3 extrinsics() const { return filter_.started() ? filter_.window().T_I_C : filter_.mounting().T_I_C; }
  /// A depth image as it came; empty when there is none.
  struct DepthReading {
    cv::Mat image;
    double lag = 0;  ///< its stamp after that of the colour image, seconds
  };

  /// Empty when the input is usable; else what is wrong. Fixes up the depth.
  /// From now on depth is read with what the filter has found out of its shift.
  void followDepthShift();
  std::string checkInput(const FrameInput& input, DepthReading* depth);
  bool noticeTimeJump(double t, double newest, const char* what);
  void countImu();

  FrameOutput initialise(double t, double t_imu, const cv::Mat& gray, const DepthReading& depth);
  FrameOutput trackImage(double t, double t_imu, const cv::Mat& gray, const DepthReading& depth,
                         const FrontEnd::PoseReady& on_pose);
  SE3 gyroRotation(double t0, double t1) const;
  /// In the camera, m; those without depth lie beyond its reach, or might as well.
  std::vector<Eigen::Vector3d> trackedPoints() const;
  /// Both in IMU time: of the last image and of this one.
  bool decideStillness(double previous_t_imu, double t_imu);
  /// How the colour camera moves during a readout, given the state at the stamp; null: everything at the stamp.
  std::shared_ptr<const RowPoses> rows(const Readout& readout, const NavState& nav) const;
  std::shared_ptr<const RowPoses> colourRows(const NavState& nav) const {
    return rows(Readout::around(sensor_.rolling_shutter), nav);
  }
  /// A depth image that was not read at the stamp of the colour image, or row by row, as at that stamp.
  cv::Mat depthAtStamp(const DepthReading& depth, const NavState& nav);
  std::vector<FilterMeasurement> measurements() const;
  SurfaceMatches matchSurfaces(const cv::Mat& depth, const SE3& T_odom_C, double t) const;
  /// The newest image becomes the reference when the old one is about to leave the window or to go out of view.
  void renewSurfaces(const cv::Mat& depth, std::size_t matched, double t);
  /// The camera's motion since the last image as the IMU has it; not to be held against the points (interval 0) while
  /// that is in doubt.
  ForetoldMotion foretell(const Propagation& propagation, const SE3& T_odom_C, bool imu_gap) const;
  /// A longer one starts tracking anew, s.
  double longestImuGap() const { return 5.0 * options_.recovery.max_imu_gap; }
  /// Whether the image after a gap of the IMU tells what went on in it. Where images were taken within the gap, each
  /// follows the last one closely; where they are missing as well, it takes one that is known again. `unseen`: since
  /// the last image, s.
  static bool bridgesGap(const TrackingResult& tracking, std::size_t tracks_before, const ForetoldMotion& foretold,
                         double unseen);
  bool imuIsContradicted() const;
  bool movedLately(double t_imu) const;
  /// So long that it is time to begin anew.
  bool contradictedForLong(const TrackingResult& tracking, double t) const;
  /// Remembers when points that stand still last agreed with the IMU.
  void noteAgreement(const TrackingResult& tracking, double t);
  /// The pixels of the image before, where something ought to have moved.
  bool repeatsLastImage(const cv::Mat& gray, double t_imu) const;
  /// Whether the IMU foretells that an image shows more than standing still since the camera was there.
  bool movesByImu(double t_imu, const SE3& T_odom_C_then) const;
  FrameOutput repeatedImage(double t, double t_imu);
  /// A blow that clips the accelerometer or falls between its samples changes the velocity unseen, for good. All points
  /// together show it at once, each alone would be an outlier: then the velocity is what they say, not the IMU's.
  void admitShock(const TrackingResult& tracking, const ForetoldMotion& foretold, double dt, Propagation* propagation);
  /// `metric`: depth took part, by features or surfaces.
  void judge(const TrackingResult& tracking, bool metric, bool surfaces_hold, double t);
  /// What the position's one sigma has grown by since the last image with enough features, m.
  double coastedSigma() const;

  FrameOutput makeOutput(double t, double t_imu, const std::string& keyframe_reason);
  std::shared_ptr<TrackedFrame> makeFrame(double t, bool with_features) const;
  /// Those who take features from here know of no rows: pixels become what a global shutter would have seen.
  void placeAtStamp(std::vector<Feature>* features) const;
  /// Without those features that lie where something moves by itself.
  void dropMoving(std::vector<Feature>* features) const;
  /// Depth leaves as what it means, where tracker and filter have what the camera read; 0 stays 0.
  float trueDepth(float reading) const;
  void correctDepth(std::vector<Feature>* features) const;
  /// Of the newest depth image; nothing where something moves by itself.
  DepthGrid depthGrid(int stride) const;
  KeyframePtr makeKeyframe(const TrackedFrame& frame, double t_imu);
  FrameOutput statusOnly(double t, TrackingState state, const std::string& reason) const;
  /// An image that cannot be used, and why. LOST once the IMU alone has carried the pose for too long, or has ended.
  FrameOutput unusable(double t, const std::string& why);

  SensorConfig sensor_;
  TimingLog* timing_;
  const double clock_jump_;
  std::shared_ptr<const CameraModel> camera_;
  ImuBuffer imu_;
  GyroRange gyro_range_;
  FrozenDepth frozen_depth_;
  bool same_depth_ = false;                   ///< the newest depth image is the one before
  SE3 T_odom_depth_;                          ///< camera of the last image whose depth was its own ...
  std::optional<std::uint32_t> depth_epoch_;  ///< ... in this epoch
  cv::Mat masked_;                            ///< not zero where depth is to be left out; empty: nowhere
  std::unique_ptr<DepthRows> depth_rows_;     ///< null until a depth image of other times than the stamp came
  FeatureTracker tracker_;
  MovingRegions moving_;          ///< of the newest image
  double moving_imu_t_ = -1e300;  ///< of the last image with such
  SurfaceTracker surfaces_;
  LandmarkMatcher landmarks_;
  OrbExtractor orb_;
  VioFilter filter_;
  Initialiser initialiser_;
  StillnessDetector stillness_;
  KeyframeSelector selector_;

  Phase phase_ = Phase::kWaiting;
  TrackingStatus status_{TrackingState::kWaiting, "waiting for the first image"};
  std::uint32_t epoch_ = 0;
  double last_image_t_ = -1e300;  ///< image clock
  double last_imu_t_ = -1e300;    ///< IMU time of the newest image
  CloneId next_clone_ = 1;
  KeyframeId next_keyframe_ = 1, last_keyframe_ = 0, newest_keyframe_ = 0;
  SE3 T_odom_keyframe_, T_chain_keyframe_;  ///< of the last keyframe, body and camera
  double last_keyframe_imu_t_ = 0;
  bool keyframe_imu_broken_ = false;  ///< a gap since the last keyframe
  double started_imu_t_ = 0;          ///< of this epoch's first state
  double last_good_t_ = 0;            ///< image with enough features
  double last_good_variance_ = 0;     ///< of the position there, m^2
  double last_held_t_ = 0;            ///< image with enough features or matched depth surfaces
  double last_depth_t_ = -1e300;      ///< image with a depth image
  double last_metric_t_ = 0;          ///< image in which depth took part
  double last_points_t_ = 0;          ///< image with points that have depth
  double last_agreed_t_ = 0;          ///< image whose points agreed with the IMU
  double cut_off_imu_t_ = -1e300;     ///< image since the one before which the gyro was at the end of its range
  double doubt_imu_t_ = 0;            ///< image whose points were somewhat off the IMU, or could not tell
  double shock_imu_t_ = -1e300;       ///< first such after a while without
  int gated_in_a_row_ = 0;
  bool still_ = false;
  SE3 T_map_odom_;
  bool have_map_ = false;
  DepthShift depth_shift_;      ///< that the filter has found out, beside the sensor's own
  DepthCurve depth_curve_;      ///< that the map has found out, after the sensor's own
  double disparity_error_ = 0;  ///< 1/m, that was part of the curve when what is known of depth's offset began
  using PixelList = std::vector<std::pair<LandmarkId, Eigen::Vector2f>>;
  std::deque<std::pair<double, PixelList>> recent_pixels_;  ///< over the stillness window
  PixelList still_anchor_;
};

}  // namespace vip_slam
