// SPDX-License-Identifier: BSD-3-Clause
// Output side of the front end: tracked frames and keyframes.
#include <algorithm>
#include <cmath>

#include "front_end_impl.h"
#include "vip_slam_core/depth/grid_spacing.h"
#include "vip_slam_core/geometry/so3.h"

namespace vip_slam {

namespace {

/// Extrapolates with constant velocity for `dt` seconds after the last IMU sample; `omega`: rad/s in the body, bias
/// removed. The covariance grows as in a gap between two of them.
void carryOn(const Eigen::Vector3d& omega, double dt, NavState* state, Matrix15d* covariance) {
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity(), turn = expSO3(Eigen::Vector3d(omega * dt));
  Matrix15d F = Matrix15d::Identity();
  F.block<3, 3>(0, 0) = turn.transpose();
  F.block<3, 3>(0, 9) = -dt * I;
  F.block<3, 3>(3, 6) = dt * I;
  *covariance = (F * *covariance * F.transpose()).eval();
  *covariance += gapCovariance(dt, dt);
  state->T_W_I = SE3(Eigen::Matrix3d(state->T_W_I.R() * turn), state->T_W_I.t() + dt * state->v_W);
  state->t += dt;
}

}  // namespace

CalibrationEstimate FrontEnd::Impl::calibration() const {
  CalibrationEstimate calibration = filter_.calibration();
  // The filter sees readings and rates to which the configured corrections are already applied: add those back.
  calibration.depth_offset += sensor_.depth_offset;
  if (sensor_.depth_encoding != "32FC1") calibration.depth_unit = sensor_.depth_scale * calibration.depth_scale;
  calibration.depth_delay += sensor_.depth_delay;
  calibration.readout += sensor_.rolling_shutter;
  const CameraIntrinsics& camera = sensor_.camera;
  calibration.depth_shift_px =
      sensor_.depth_shift + calibration.depth_shift.cwiseProduct(Eigen::Vector2d(camera.fx, camera.fy));
  calibration.intrinsics = correctedIntrinsics({camera.fx, camera.fy, camera.cx, camera.cy}, calibration.bearing);
  calibration.gyro_correction += sensor_.gyro_correction + calibration.gyro_correction * sensor_.gyro_correction;
  return calibration;
}

CalibrationEstimate FrontEnd::Impl::givenCalibration() const {
  CalibrationEstimate given{sensor_.T_imu_cam, sensor_.time_offset};
  given.depth_offset = sensor_.depth_offset;
  given.depth_delay = sensor_.depth_delay;
  given.readout = sensor_.rolling_shutter;
  given.gyro_correction = sensor_.gyro_correction;
  const CalibrationOptions& believed = options_.filter.calibration;
  given.sigma_rotation.setConstant(believed.sigma_rotation);
  given.sigma_translation.setConstant(believed.sigma_translation);
  given.sigma_time_offset = believed.sigma_time_offset;
  given.sigma_depth_offset = believed.sigma_depth_offset;
  given.sigma_depth_scale = believed.sigma_depth_scale;
  given.sigma_depth_delay = believed.sigma_depth_delay;
  given.sigma_readout = believed.sigma_readout;
  given.sigma_depth_shift.setConstant(believed.sigma_depth_shift);
  given.sigma_bearing << Eigen::Vector2d::Constant(believed.sigma_focal),
      Eigen::Vector2d::Constant(believed.sigma_centre);
  given.sigma_gyro_correction.setConstant(sensor_.imu_noise.gyro_correction_sigma);
  return given;
}

std::shared_ptr<TrackedFrame> FrontEnd::Impl::makeFrame(double t, bool with_features) const {
  auto frame = std::make_shared<TrackedFrame>();
  frame->t = t;
  frame->epoch = epoch_;
  frame->status = health_.status();
  frame->T_I_C = extrinsics();
  frame->time_offset = timeOffset();
  frame->camera_correction = {filter_.depthCorrection(), depth_input_.curve(), filter_.bearingCorrection(),
                              depth_input_.shift(), filter_.depthScale()};
  frame->zero_velocity = rest_.still();
  frame->keyframe = keyframes_.newest();
  if (filter_.started()) {
    frame->state = filter_.nav();
    frame->covariance = map_.odometryVariance() * filter_.covariance() + filter_.covarianceOfScale();
    if (sources_.verticalUnknown()) frame->covariance += filter_.covarianceOfVertical();
    frame->T_chain_C = keyframes_.chainedCamera(filter_, frame->state.T_W_I, extrinsics());
  }
  if (with_features) {
    for (const Track& track : tracker_.tracks()) frame->features.push_back(track.feature);
  }
  return frame;
}

FrameOutput FrontEnd::Impl::statusOnly(double t, TrackingState state, const std::string& reason) const {
  std::shared_ptr<TrackedFrame> frame = makeFrame(t, false);
  frame->status = {state, reason};
  if (filter_.started() && std::isfinite(t)) {
    const double t_imu = t + timeOffset();
    const std::vector<ImuSample> samples = inertial_.between(
        filter_.nav().t, std::min({t_imu, inertial_.newest(), filter_.nav().t + options_.recovery.longestImuGap()}));
    if (samples.size() > 1) {
      const Propagation to = filter_.predict(samples, inertial_.noise(samples.front().t, samples.back().t));
      frame->state = to.predicted;
      frame->covariance = to.Phi * frame->covariance * to.Phi.transpose() + to.Q;
    }
    // The pose is published with the image's stamp, so extrapolate it to that time; after longer it is LOST.
    const double untold = std::min(t_imu - frame->state.t, options_.recovery.longestImuGap());
    if (untold > 0) carryOn(gyro(frame->state.t) - frame->state.bias_gyro, untold, &frame->state, &frame->covariance);
    frame->T_chain_C = keyframes_.chainedCamera(filter_, frame->state.T_W_I, extrinsics());
  }
  return {frame, nullptr};
}

FrameOutput FrontEnd::Impl::unusable(double t, const std::string& why) {
  if (!filter_.started()) return statusOnly(t, TrackingState::kWaiting, why);
  // Without a usable image and without the IMU nothing carries the pose on.
  const double t_imu = t + timeOffset();
  const bool imu_ended = t_imu - inertial_.newest() > options_.recovery.longestImuGap();
  return statusOnly(t, health_.unusable(why, imu_ended, t_imu - filter_.nav().t), why);
}

float FrontEnd::Impl::trueDepth(float reading) const {
  if (!(reading > 0)) return reading;
  return std::max(1e-3f, static_cast<float>(filter_.depthScale() * reading + filter_.depthCorrection()));
}

void FrontEnd::Impl::correctDepth(std::vector<Feature>* features) const {
  const BearingCorrection bearing = filter_.bearingCorrection();
  for (Feature& f : *features) {
    f.depth = trueDepth(f.depth);
    f.xy = bearing(f.xy);
  }
}

DepthGrid FrontEnd::Impl::depthGrid(int stride) const {
  const int on_image = strideOn(camera_->width(), camera_->height(), stride);
  DepthGrid grid = makeDepthGrid(tracker_.depth(), on_image, sensor_.depth_noise);
  for (int v = 0; v < grid.rows && bodies_.regions().any(); ++v) {
    for (int u = 0; u < grid.cols; ++u) {
      float& z = grid.z[static_cast<std::size_t>(v) * grid.cols + u];
      if (z > 0 && bodies_.regions().moves(grid.pixel(u, v), z)) z = 0;
    }
  }
  for (float& z : grid.z) z = trueDepth(z);
  return grid;
}

FrameOutput FrontEnd::Impl::makeOutput(double t, double t_imu, const std::string& keyframe_reason) {
  const SE3 T_odom_C = filter_.nav().T_W_I * extrinsics();
  const bool is_keyframe = !keyframe_reason.empty();
  const bool few = static_cast<int>(tracker_.tracks().size()) < 2 * options_.recovery.min_tracks;
  if (is_keyframe || few) {
    ScopedTimer timer(timing_, "frontend.reacquire", t);
    counters_.landmarks_reacquired += map_.reacquire(&tracker_, orb_, T_odom_C);
  }
  tracker_.replenish(T_odom_C, is_keyframe, t);

  FrameOutput output;
  std::shared_ptr<TrackedFrame> frame = makeFrame(t, true);
  if (is_keyframe) {
    ScopedTimer timer(timing_, "frontend.keyframe", t);
    orb_.describe(tracker_.gray(), &frame->features);
    for (std::size_t i = 0; i < frame->features.size(); ++i) {
      tracker_.tracks()[i].feature = frame->features[i];
    }
  }
  correctDepth(&frame->features);
  // Features on moving bodies are not passed on; the tracker keeps them, to recognise the bodies in the next images.
  bodies_.drop(&frame->features);
  if (is_keyframe) {
    ScopedTimer timer(timing_, "frontend.keyframe", t);
    output.keyframe = makeKeyframe(*frame, t_imu);
    frame->keyframe = keyframes_.newest();
  }
  placeAtStamp(&frame->features);
  if (!tracker_.depth().empty()) {
    ScopedTimer timer(timing_, "frontend.depth_grid", t);
    frame->depth_grid = depthGrid(2 * options_.keyframe_grid_stride);
  }
  output.frame = frame;
  inertial_.dropBefore(keyframes_.imuSince(t_imu - 2.0 * kStandingSeconds));
  return output;
}

void FrontEnd::Impl::placeAtStamp(std::vector<Feature>* features) const {
  if (!tracker_.camera().rolls()) return;
  const Eigen::Vector2d last(camera_->width() - 1, camera_->height() - 1);
  // Pixels belong to the configured intrinsics: undo the bearing correction first.
  const Eigen::Matrix3f given = filter_.bearingCorrection().matrix().inverse().cast<float>();
  for (Feature& f : *features) {
    Feature read = f;
    read.xy = (given * f.xy.homogeneous()).head<2>();
    f.pixel = tracker_.pixelAtStamp(read).cwiseMax(0.0).cwiseMin(last).cast<float>();
  }
}

KeyframePtr FrontEnd::Impl::makeKeyframe(const TrackedFrame& frame, double t_imu) {
  auto keyframe = std::make_shared<Keyframe>();
  keyframe->frame = frame;
  std::vector<cv::Point2f> occupied;
  for (const Feature& f : frame.features) occupied.emplace_back(f.pixel.x(), f.pixel.y());
  std::vector<Feature> corners = orb_.extract(tracker_.gray(), occupied, 6.0, tracker_.mask());
  for (Feature& corner : corners) tracker_.measure(&corner);
  correctDepth(&corners);
  keyframe->frame.features.insert(keyframe->frame.features.end(), corners.begin(), corners.end());
  bodies_.drop(&keyframe->frame.features);
  placeAtStamp(&keyframe->frame.features);
  if (!tracker_.depth().empty()) {
    keyframe->frame.depth_grid = depthGrid(options_.keyframe_grid_stride);
  }
  keyframe->gyro_correction = filter_.gyroCorrection();
  keyframe->imu_noise_scale = filter_.imuNoise();
  keyframe->depth_noise = surfaces_.learnt().parts();

  keyframes_.accept(keyframe.get(), frame.features, t_imu, inertial_, &filter_);
  ++counters_.keyframes;
  return keyframe;
}

}  // namespace vip_slam
