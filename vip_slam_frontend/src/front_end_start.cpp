// SPDX-License-Identifier: BSD-3-Clause
// The first state: images until the initialiser has one, then the start of filter, tracks and stillness.
#include <algorithm>

#include "vip_slam_core/geometry/so3.h"

#include "front_end_impl.h"

namespace vip_slam {

FrameOutput FrontEnd::Impl::initialise(const ImageStep& step) {
  const double t = step.t, t_imu = step.t_imu;
  const bool first = health_.waiting();
  // Images and depth tell the motion between images; the gyro the rotation, where there is one.
  const std::optional<frontend::AlignedMotion> aligned = align(step, first ? 0.0 : t_imu - last_imu_t_);
  std::optional<SE3> moved;
  if (aligned) moved = aligned->T_current_previous;
  SE3 rotation;
  if (!first) rotation = inertial_.hasGyro() ? sources_.byGyro(last_imu_t_, t_imu) : moved.value_or(SE3());
  rotation.t().setZero();
  if (!first && !inertial_.complete())
    sources_.substitute(last_imu_t_, t_imu, moved.value_or(SE3()), NavState(), false);
  sources_.setLast(moved.value_or(SE3()));
  last_imu_t_ = t_imu;
  // The velocity is not known yet: zero, and levelled by the accelerometer so that gravity is no acceleration.
  NavState turning;
  turning.t = t_imu;
  if (const std::optional<ImuSample> sample = inertial_.at(t_imu); sample && sample->accel.norm() > 1.0) {
    turning.T_W_I = SE3(gravityAlignedRotation(sample->accel), Eigen::Vector3d::Zero());
  }
  const cv::Mat depth = depthAtStamp(step.read, turning);
  tracker_.track(step.gray, depth, {rotation, 0, 0}, false, SE3(), colourRows(turning), t);
  tracker_.replenish(SE3(), true, t);
  // After a restart the extrinsics are known better than from the configuration.
  initialiser_.setExtrinsics(extrinsics());
  const auto& tracks = tracker_.tracks();
  const auto points =
      std::count_if(tracks.begin(), tracks.end(), [](const Track& track) { return track.feature.depth > 0; });
  const bool surfaces = !depth.empty() && surfaces_.sees(depth);
  std::optional<Eigen::Vector3d> up;
  if (!depth.empty()) up = frontend::upByFloor(shareNormals(surfaces_.patches(depth)));
  std::optional<FilterPrior> prior =
      initialiser_.add({t_imu, static_cast<int>(points), surfaces, up, first ? std::nullopt : moved}, inertial_);
  if (!prior) {
    health_.initialising(initialiser_.reason());
    return statusOnly(t, health_.status().state, health_.status().reason);
  }
  startAtBase(sensor_.T_base_imu, &*prior);
  const std::optional<ImuSample> here = inertial_.at(t_imu);
  const Eigen::Vector3d omega = here ? Eigen::Vector3d(here->gyro - prior->state.bias_gyro) : Eigen::Vector3d::Zero();
  filter_.start(*prior, next_clone_++, omega);
  if (prior->at_rest) rest_.begin(inertial_, t_imu, kStandingSeconds);
  counters_.level = initialiser_.level();
  initialiser_.reset();
  health_.start(t, filter_.covariance().block<3, 3>(3, 3).diagonal().maxCoeff());
  const std::string& fault = initialiser_.accelerometerFault();
  sources_.start(t_imu, !fault.empty());
  health_.setImuFault(fault);
  // The tracks' references were taken under unknown poses: begin them here.
  const SE3 T_odom_C = filter_.nav().T_W_I * extrinsics();
  tracker_.restartReferences(T_odom_C, colourRows(filter_.nav()));
  return makeOutput(t, t_imu, "first");
}

}  // namespace vip_slam
