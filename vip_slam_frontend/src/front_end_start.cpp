// The first state: images until the initialiser has one, then the start of filter, tracks and stillness.
#include <algorithm>

#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/imu/preintegration.h"

#include "front_end_impl.h"

namespace vip_slam {

SE3 FrontEnd::Impl::gyroRotation(double t0, double t1) const {
  const std::vector<ImuSample> samples = inertial_.between(t0, t1);
  if (samples.size() < 2) return SE3();
  const Preintegration pre(samples, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), sensor_.imu_noise);
  const Eigen::Matrix3d R_I_C = extrinsics().R();
  return SE3(Eigen::Matrix3d(R_I_C.transpose() * pre.deltaR().transpose() * R_I_C), Eigen::Vector3d::Zero());
}

void FrontEnd::Impl::substitute(double t0, double t1, const SE3& T_current_previous, const NavState& state, bool both) {
  if (!(t1 > t0)) return;
  frontend::Substitute substitute{t0, t1, std::nullopt, std::nullopt};
  Eigen::Vector3d rate = gyro(0.5 * (t0 + t1)) - state.bias_gyro;
  if (both || !inertial_.hasGyro()) {
    rate = extrinsics().R() * logSO3(Eigen::Matrix3d(T_current_previous.R().transpose())) / (t1 - t0);
    substitute.gyro = rate + state.bias_gyro;
  }
  if (both || !inertial_.hasAccel()) {
    const Eigen::Matrix3d R_W_I = state.T_W_I.R() * expSO3(Eigen::Vector3d(0.5 * (t1 - t0) * rate));
    substitute.accel = R_W_I.transpose() * gravityVector(sensor_.gravity) + state.bias_accel;
  }
  inertial_.substitute(substitute);
}

FrameOutput FrontEnd::Impl::initialise(double t, double t_imu, const cv::Mat& gray, const DepthReading& depth_read) {
  const bool first = phase_ == Phase::kWaiting;
  phase_ = Phase::kInitialising;
  // Images and depth tell the motion between images; the gyro the rotation, where there is one.
  const std::optional<frontend::AlignedMotion> aligned = align(gray, depth_read, first ? 0.0 : t_imu - last_imu_t_, t);
  std::optional<SE3> moved;
  if (aligned) moved = aligned->T_current_previous;
  SE3 rotation;
  if (!first) rotation = inertial_.hasGyro() ? gyroRotation(last_imu_t_, t_imu) : moved.value_or(SE3());
  rotation.t().setZero();
  if (!first && !inertial_.complete()) substitute(last_imu_t_, t_imu, moved.value_or(SE3()), NavState(), false);
  last_motion_ = moved.value_or(SE3());
  last_imu_t_ = t_imu;
  // The velocity is not known yet: zero, and levelled by the accelerometer so that gravity is no acceleration.
  NavState turning;
  turning.t = t_imu;
  if (const std::optional<ImuSample> sample = inertial_.at(t_imu); sample && sample->accel.norm() > 1.0) {
    turning.T_W_I = SE3(gravityAlignedRotation(sample->accel), Eigen::Vector3d::Zero());
  }
  const cv::Mat depth = depthAtStamp(depth_read, turning);
  tracker_.track(gray, depth, {rotation, 0, 0}, false, SE3(), colourRows(turning), t);
  tracker_.replenish(SE3(), true, t);
  // After a restart the extrinsics are known better than from the configuration.
  initialiser_.setExtrinsics(extrinsics());
  const auto& tracks = tracker_.tracks();
  const auto points =
      std::count_if(tracks.begin(), tracks.end(), [](const Track& track) { return track.feature.depth > 0; });
  const bool surfaces = !depth.empty() && options_.filter.use_surfaces && surfaces_.sees(depth);
  std::optional<Eigen::Vector3d> up;
  if (!depth.empty() && !inertial_.hasAccel()) up = frontend::upByFloor(shareNormals(surfaces_.patches(depth)));
  std::optional<FilterPrior> prior =
      initialiser_.add({t_imu, static_cast<int>(points), surfaces, up, first ? std::nullopt : moved}, inertial_);
  if (!prior) {
    const std::string why = status_.state == TrackingState::kInitialising && !status_.reason.empty() && first
                                ? status_.reason + "; " + initialiser_.reason()
                                : initialiser_.reason();
    status_ = {TrackingState::kInitialising, why};
    return statusOnly(t, status_.state, status_.reason);
  }
  startAtBase(sensor_.T_base_imu, &*prior);
  const std::optional<ImuSample> here = inertial_.at(t_imu);
  const Eigen::Vector3d omega = here ? Eigen::Vector3d(here->gyro - prior->state.bias_gyro) : Eigen::Vector3d::Zero();
  filter_.start(*prior, next_clone_++, omega);
  if (prior->at_rest) {
    stillness_.begin(imuSpread(inertial_.between(t_imu - options_.initialisation.standing_seconds, t_imu)));
  }
  counters_.level = initialiser_.level();
  initialiser_.reset();
  phase_ = Phase::kTracking;
  started_imu_t_ = t_imu;
  status_ = {TrackingState::kTracking, ""};
  last_good_t_ = last_held_t_ = last_metric_t_ = last_points_t_ = last_agreed_t_ = t;
  faults_.reset(t_imu);  // until the initial velocity is confirmed, its error cannot be told from a shock
  last_good_variance_ = filter_.covariance().block<3, 3>(3, 3).diagonal().maxCoeff();
  // The tracks' references were taken under unknown poses: begin them here.
  const SE3 T_odom_C = filter_.nav().T_W_I * extrinsics();
  tracker_.restartReferences(T_odom_C, colourRows(filter_.nav()));
  return makeOutput(t, t_imu, "first");
}

}  // namespace vip_slam
