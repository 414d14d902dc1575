// Input side of the front end: IMU, checks of images, clock jumps, feedback from the back end.
#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "vip_slam_core/depth/disparity_curve.h"
#include "vip_slam_core/depth/grid_spacing.h"
#include "vip_slam_core/imu/gyro_correction.h"
#include "vip_slam_core/imu/preintegration.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/size_text.h"

#include "front_end_impl.h"

namespace vip_slam {

namespace {

// Depth with a smaller lag than this counts as taken with the colour image, seconds: half a millimetre at 1 m/s.
constexpr double kSameInstant = 5e-4;
// Longest prediction beyond the newest image, s.
constexpr double kPredicted = 5.0;

SensorConfig checked(const SensorConfig& sensor) {
  const std::string problem = sensor.camera.validate();
  if (!problem.empty()) throw std::invalid_argument("front end: camera: " + problem);
  const std::string mask = maskProblem(sensor, sensor.camera.width, sensor.camera.height);
  if (!mask.empty()) throw std::invalid_argument("front end: " + mask);
  return sensor;
}

/// Intrinsics are estimated only with registered depth and no fisheye: a separate depth camera has intrinsics of its
/// own, and the error of a fisheye's focal length is not proportional to the bearing. Without a gyro, whose turns hold
/// the focal length, it would be depth's errors that decide.
FilterOptions filterOptions(const FrontEndOptions& options, const SensorConfig& sensor) {
  FilterOptions filter = options.filter;
  filter.calibration.intrinsics = filter.calibration.intrinsics && sensor.depth_registered && sensor.hasGyro() &&
                                  sensor.camera.model != DistortionModel::kEquidistant;
  // A camera's rotation, delay and scale of rates against an IMU need one.
  filter.calibration.rotation = filter.calibration.rotation && sensor.hasGyro();
  filter.calibration.time_offset = filter.calibration.time_offset && sensor.hasGyro();
  filter.calibration.gyro_scale = filter.calibration.gyro_scale && sensor.hasGyro();
  filter.calibration.gyro_misalignment = filter.calibration.gyro_misalignment && sensor.hasGyro();
  filter.calibration.depth_shift =
      filter.calibration.depth_shift && sensor.camera.model != DistortionModel::kEquidistant;
  return filter;
}

/// A feature's patch must not reach into the masked area, whose outline is a strong edge that moves with the camera. So
/// features keep the same distance from it as from the image border, `border` px.
cv::Mat featureMask(const cv::Mat& mask, int border) {
  if (mask.empty()) return mask;
  cv::Mat shrunk;
  cv::erode(mask, shrunk, cv::getStructuringElement(cv::MORPH_RECT, cv::Size(2 * border + 1, 2 * border + 1)));
  return shrunk;
}

/// Scales pixel distances, which the options give for images of 640 x 480, to smaller images with the same view.
FrontEndOptions forSize(FrontEndOptions options, int width, int height) {
  constexpr double kMinScale = 0.5;  // of the scale: smaller images than 320 x 240 were not measured
  constexpr int kMinBorder = 8;      // px, for patches and their gradients
  const double scale = std::clamp(std::max(width, height) / kReferenceSide, kMinScale, 1.0);
  options.tracking.min_distance *= scale;
  const int border = options.tracking.border;
  options.tracking.border = std::max(std::min(border, kMinBorder), static_cast<int>(std::ceil(scale * border)));
  return options;
}

}  // namespace

FrontEnd::Impl::Impl(const FrontEndOptions& options, const SensorConfig& sensor, TimingLog* timing, double clock_jump,
                     const SessionNumbers& first)
    : options_(forSize(options, sensor.camera.width, sensor.camera.height)),
      sensor_(checked(sensor)),
      timing_(timing),
      clock_jump_(clock_jump),
      camera_(makeCamera(sensor_.camera)),
      inertial_(sensor_, options.recovery.max_imu_gap),
      dense_(camera_, sensor_.depth_noise),
      depth_unit_(camera_, sensor_.depth_noise),
      masked_(sensor_.mask.empty() ? cv::Mat() : cv::Mat(sensor_.mask == 0)),
      tracker_(options_.tracking, camera_, sensor_.depth_noise, timing,
               featureMask(sensor_.mask, options_.tracking.border), first.landmark),
      surfaces_(camera_, sensor_.depth_noise, options.filter.window),
      landmarks_(options_.tracking, camera_),
      orb_(options.tracking.keyframe_corners),
      filter_(filterOptions(options, sensor_), sensor_.imu_noise, sensor_.T_imu_cam, sensor_.time_offset,
              camera_->focal(), sensor_.gravity),
      initialiser_(options.initialisation, options.filter, sensor_.imu_noise, sensor_.T_imu_cam, sensor_.gravity),
      stillness_(options.filter.zupt),
      selector_(options.keyframes),
      epoch_(first.epoch),
      next_keyframe_(first.keyframe) {
  counters_.sigma_px = filter_.sigmaPx();
}

bool FrontEnd::Impl::noticeTimeJump(double t, double newest, const char* what) {
  if (!(t < newest - clock_jump_)) return false;
  clockRanBack(formatted("%s clock ran back by %.3f s", what, newest - t));
  return true;
}

void FrontEnd::Impl::clockRanBack(const std::string& reason) {
  inertial_.clear();
  last_image_t_ = last_imu_t_ = -1e300;
  // Stamps are ordered only within an epoch, so the clock's jump back needs a new one.
  if (phase_ == Phase::kWaiting) ++epoch_;
  reset(reason);
}

void FrontEnd::Impl::countImu() {
  const ImuBufferCounters& c = inertial_.counters();
  counters_.imu_rejected = c.out_of_order + c.duplicate + c.not_finite;
  counters_.imu_gaps = c.gaps;
  counters_.imu_spikes = c.spikes;
  counters_.gyro_cut_off = inertial_.range().samples();
  counters_.gyro_range = inertial_.range().end();
}

bool FrontEnd::Impl::addImu(const ImuSample& sample) {
  if (std::isfinite(sample.t)) noticeTimeJump(sample.t, inertial_.newestMeasured(), "IMU");
  const bool accepted = inertial_.addImu(sample);
  countImu();
  return accepted;
}

bool FrontEnd::Impl::addGyro(double t, const Eigen::Vector3d& gyro) {
  if (std::isfinite(t)) noticeTimeJump(t, inertial_.newestMeasured(), "gyro");
  const bool accepted = inertial_.addGyro(t, gyro);
  countImu();
  return accepted;
}

bool FrontEnd::Impl::addAccel(double t, const Eigen::Vector3d& accel) {
  const bool accepted = inertial_.addAccel(t, accel);
  countImu();
  return accepted;
}

std::string FrontEnd::Impl::checkInput(const FrameInput& input, DepthReading* depth) {
  if (!std::isfinite(input.t)) {
    ++counters_.bad_stamp;
    return "image stamp is not finite";
  }
  noticeTimeJump(input.t, last_image_t_, "image");
  if (input.t <= last_image_t_) {
    ++counters_.bad_stamp;
    return formatted("image stamp %.3f s does not follow %.3f s", input.t, last_image_t_);
  }
  if (input.gray.empty() || input.gray.type() != CV_8UC1) {
    ++counters_.bad_image;
    return input.gray.empty() ? "image is empty"
                              : "image is " + cv::typeToString(input.gray.type()) + ", expected 8-bit grey";
  }
  if (input.gray.cols != camera_->width() || input.gray.rows != camera_->height()) {
    ++counters_.bad_image;
    return "image is " + sizeText(input.gray.size()) + ", the camera is " +
           sizeText(cv::Size(camera_->width(), camera_->height()));
  }
  if (input.depth.empty()) {
    ++counters_.no_depth;
  } else if (input.depth.type() != CV_32FC1 || input.depth.size() != input.gray.size()) {
    ++counters_.bad_depth;
  } else {
    depth->image = input.depth;
    missing_reading_.look(input.depth);
    if (missing_reading_.value() > 0) {
      depth->image = input.depth.clone();
      depth->image.setTo(0, input.depth == missing_reading_.value());
      counters_.missing_reading = missing_reading_.value();
    }
    if (depth_unit_.factor() != 1) depth->image = depth->image * depth_unit_.factor();
    const bool own = depth->image.data != input.depth.data;
    depth->lag = std::abs(input.depth_lag) >= kSameInstant ? input.depth_lag : 0.0;
    const DepthCurve curve = chained(sensor_.depth_curve, depth_curve_);
    const Eigen::Vector2d shift = sensor_.depth_shift + depth_shift_.px;
    const bool shifted = !shift.isZero();
    if (shifted) depth->image = shiftedDepth(depth->image, shift);
    // The caller's image must stay unchanged.
    if (!shifted && !own && (!masked_.empty() || !curve.empty())) depth->image = input.depth.clone();
    if (!masked_.empty()) depth->image.setTo(0, masked_);
    applyDepthCurve(curve, &depth->image);
  }
  return "";
}

void FrontEnd::Impl::followDepthUnit(double t, double t_imu, DepthReading* depth) {
  const std::optional<NavState> predicted = inertial_.complete() ? predict(t_imu) : std::nullopt;
  const SE3 T_odom_C = predicted ? predicted->T_W_I * extrinsics()
                                 : filter_.nav().T_W_I * extrinsics() * last_motion_.inverse();
  const double before = depth_unit_.factor();
  if (!depth_unit_.changes(depth->image, T_odom_C, t)) return;
  depth->image = depth->image * (depth_unit_.factor() / before);
  ++counters_.depth_unit_changes;
  counters_.depth_unit = depth_unit_.factor();
}

void FrontEnd::Impl::followDepthShift() {
  const Eigen::Vector2d& found = filter_.takeDepthShift();
  if (found == depth_shift_.bearing) return;
  depth_shift_ = {found.cwiseProduct(Eigen::Vector2d(sensor_.camera.fx, sensor_.camera.fy)), found};
  surfaces_.clear();  // their readings have the old shift
}

void FrontEnd::Impl::applyMapUpdate(const MapUpdate& update) {
  landmarks_.apply(update);
  if (update.depth_curve != depth_curve_ && validateDepthCurve(update.depth_curve).empty()) {
    depth_curve_ = update.depth_curve;
    surfaces_.clear();  // their readings have the old curve: the difference would pass for motion
    if (voidsDepthOffset(update.disparity_error - disparity_error_)) {
      disparity_error_ = update.disparity_error;
      // A disparity error replaces the depth offset: what was estimated as an offset was this error.
      filter_.restartDepthOffset(disparity_error_ != 0);
    }
  }
  // A loaded map has keyframes of its own: new ids continue after them.
  next_keyframe_ = std::max(next_keyframe_, update.newest_keyframe + 1);
  // T_map_odom of another epoch, or of a map without keyframes, is not valid for this odometry.
  have_map_ = update.epoch == epoch_ && update.newest_keyframe != 0;
  if (have_map_) T_map_odom_ = update.T_map_odom;
}

std::optional<NavState> FrontEnd::Impl::predict(double t) const {
  if (!filter_.started()) return std::nullopt;
  NavState state = filter_.nav();
  if (!std::isfinite(t)) return state;
  const double until = std::min({t, inertial_.newest(), state.t + kPredicted});
  const std::vector<ImuSample> samples = inertial_.between(state.t, until);
  if (samples.size() < 2) return state;
  const Preintegration pre(withGyroCorrection(samples, filter_.window().gyro_correction), state.bias_gyro,
                           state.bias_accel, sensor_.imu_noise);
  NavState predicted = pre.predict(state, gravityVector(sensor_.gravity));
  predicted.t = until;
  return predicted;
}

Eigen::Vector3d FrontEnd::Impl::gyro(double t) const {
  if (!(inertial_.oldest() <= inertial_.newest())) return Eigen::Vector3d::Zero();
  const auto sample = inertial_.at(std::clamp(t, inertial_.oldest(), inertial_.newest()));
  return sample ? correctedRate(sample->gyro, filter_.window().gyro_correction) : Eigen::Vector3d::Zero();
}

void FrontEnd::Impl::reset(const std::string& reason) {
  if (phase_ != Phase::kWaiting) {
    ++counters_.restarts;
    ++epoch_;
  }
  phase_ = Phase::kWaiting;
  status_ = {TrackingState::kInitialising, reason};
  tracker_.clear();
  landmarks_.forgetPatches();
  surfaces_.clear();
  depth_unit_.forget();
  moving_ = {};
  moving_imu_t_ = last_depth_t_ = cut_off_imu_t_ = silent_imu_t_ = fault_t_ = -1e300;  // the clock may have run back
  filter_.stop();
  initialiser_.reset();
  stillness_.reset();
  selector_.reset();
  recent_pixels_.clear();
  still_anchor_.clear();
  still_ = false;
  have_map_ = false;
  last_keyframe_ = 0;
  keyframe_imu_broken_ = false;
  gated_in_a_row_ = 0;
}

}  // namespace vip_slam
