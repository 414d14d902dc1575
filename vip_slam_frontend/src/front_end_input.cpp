// SPDX-License-Identifier: BSD-3-Clause
// Input side of the front end: IMU, checks of images, clock jumps, feedback from the back end.
#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "vip_slam_core/depth/grid_spacing.h"
#include "vip_slam_core/imu/gyro_correction.h"
#include "vip_slam_core/imu/preintegration.h"

#include "front_end_impl.h"

namespace vip_slam {

namespace {

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
  filter.calibration.depth_scale = filter.calibration.depth_scale && sensor.hasGyro() && sensor.hasAccel();
  filter.calibration.depth_delay = filter.calibration.depth_delay && sensor.hasGyro() && sensor.hasAccel();
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
  options.tracking.min_distance = spacingOn(width, height, options.tracking.min_distance);
  const int border = options.tracking.border, window = FeatureTracker::flowWindow().width / 2 + 1;  // with gradients
  const int scaled = static_cast<int>(std::ceil(spacingOn(width, height, border)));
  options.tracking.border = std::max(std::min(border, window), scaled);
  return options;
}

}  // namespace

FrontEnd::Impl::Impl(const FrontEndOptions& options, const SensorConfig& sensor, TimingLog* timing, double clock_jump,
                     const SessionNumbers& first)
    : options_(forSize(options, sensor.camera.width, sensor.camera.height)),
      sensor_(checked(sensor)),
      timing_(timing),
      camera_(makeCamera(sensor_.camera)),
      checks_({camera_->width(), camera_->height()}, clock_jump, &counters_),
      inertial_(sensor_, options.recovery.max_imu_gap),
      depth_input_(sensor_, camera_),
      tracker_(options_.tracking, camera_, sensor_.depth_noise, timing,
               featureMask(sensor_.mask, options_.tracking.border), first.landmark),
      surfaces_(camera_, sensor_.depth_noise, options.filter.window),
      map_(options_.tracking, camera_),
      orb_(options.tracking.keyframe_corners),
      filter_(filterOptions(options, sensor_), sensor_.imu_noise, sensor_.T_imu_cam, sensor_.time_offset,
              camera_->focal(), sensor_.gravity),
      sources_(sensor_, camera_, &filter_, &inertial_),
      initialiser_(options.initialisation, options.filter, sensor_.imu_noise, sensor_.T_imu_cam, sensor_.gravity),
      rest_(options.filter.zupt, sensor_.imu_noise),
      keyframes_(options.keyframes, first.keyframe),
      health_(options.recovery, &counters_),
      epoch_(first.epoch) {
  counters_.sigma_px = filter_.sigmaPx();
}

void FrontEnd::Impl::noticeTimeJump(const std::string& jump) {
  if (!jump.empty()) clockRanBack(jump);
}

void FrontEnd::Impl::clockRanBack(const std::string& reason) {
  inertial_.clear();
  checks_.reset();
  // Stamps are ordered only within an epoch, so the clock's jump back needs a new one.
  if (health_.waiting()) ++epoch_;
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
  if (std::isfinite(sample.t)) noticeTimeJump(checks_.clockJump(sample.t, inertial_.newestMeasured(), "IMU"));
  const bool accepted = inertial_.addImu(sample);
  countImu();
  return accepted;
}

bool FrontEnd::Impl::addGyro(double t, const Eigen::Vector3d& gyro) {
  if (std::isfinite(t)) noticeTimeJump(checks_.clockJump(t, inertial_.newestMeasured(), "gyro"));
  const bool accepted = inertial_.addGyro(t, gyro);
  countImu();
  return accepted;
}

bool FrontEnd::Impl::addAccel(double t, const Eigen::Vector3d& accel) {
  const bool accepted = inertial_.addAccel(t, accel);
  countImu();
  return accepted;
}

void FrontEnd::Impl::followDepthUnit(ImageStep* step) {
  // A pose that images and IMU contradict says nothing of distances.
  if (imuIsContradicted() || sources_.suspectImu(step->t_imu)) return;
  const std::optional<NavState> predicted = inertial_.complete() ? predict(step->t_imu) : std::nullopt;
  const SE3 T_odom_C =
      predicted ? predicted->T_W_I * extrinsics() : filter_.nav().T_W_I * extrinsics() * sources_.last().inverse();
  if (!depth_input_.followUnit(step->gray, T_odom_C, step->t, &step->read)) return;
  ++counters_.depth_unit_changes;
  counters_.depth_unit = depth_input_.unit();
}

void FrontEnd::Impl::followDepth() {
  const bool shift = depth_input_.followShift(filter_.takeDepthShift());
  const bool delay = depth_input_.followDelay(filter_.depthDelay());
  if (shift || delay) surfaces_.clear();  // their readings have the old ones
}

void FrontEnd::Impl::applyMapUpdate(const MapUpdate& update) {
  map_.apply(update, epoch_);
  keyframes_.continueAfter(update.newest_keyframe);
  const frontend::DepthInput::Change depth = depth_input_.followCurve(update);
  // The surfaces' readings have the old curve: the difference would pass for motion.
  if (depth.curve) surfaces_.clear();
  // A disparity error replaces the depth offset: what was estimated as an offset was this error.
  if (depth.voids_offset) filter_.restartDepthOffset(depth_input_.disparityError() != 0);
}

std::optional<NavState> FrontEnd::Impl::predict(double t) const {
  if (!filter_.started()) return std::nullopt;
  NavState state = filter_.nav();
  if (!std::isfinite(t)) return state;
  const double until = std::min({t, inertial_.newest(), state.t + options_.recovery.coast_seconds});
  const std::vector<ImuSample> samples = inertial_.between(state.t, until);
  if (samples.size() < 2) return state;
  const Preintegration pre(withGyroCorrection(samples, filter_.window().gyro_correction), state.bias_gyro,
                           state.bias_accel, sensor_.imu_noise);
  NavState predicted = pre.predict(state, gravityVector(sensor_.gravity));
  predicted.t = until;
  return predicted;
}

void FrontEnd::Impl::reset(const std::string& reason) {
  if (!health_.waiting()) {
    ++counters_.restarts;
    ++epoch_;
  }
  health_.reset(reason);
  tracker_.clear();
  map_.reset();
  surfaces_.clear();
  depth_input_.reset();
  bodies_.reset();
  filter_.stop();
  sources_.reset();
  initialiser_.reset();
  rest_.reset();
  keyframes_.reset();
}

}  // namespace vip_slam
