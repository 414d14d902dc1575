// The first state: images until the initialiser has one, then the start of filter, tracks and stillness.
#include "vip_slam_core/depth/grid_spacing.h"
#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/imu/preintegration.h"

#include "front_end_impl.h"

namespace vip_slam {

SE3 FrontEnd::Impl::gyroRotation(double t0, double t1) const {
  const std::vector<ImuSample> samples = imu_.between(t0, t1);
  if (samples.size() < 2) return SE3();
  const Preintegration pre(samples, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), sensor_.imu_noise);
  const Eigen::Matrix3d R_I_C = extrinsics().R();
  return SE3(Eigen::Matrix3d(R_I_C.transpose() * pre.deltaR().transpose() * R_I_C), Eigen::Vector3d::Zero());
}

FrameOutput FrontEnd::Impl::initialise(double t, double t_imu, const cv::Mat& gray, const DepthReading& depth_read) {
  const bool first = phase_ == Phase::kWaiting;
  phase_ = Phase::kInitialising;
  const SE3 rotation = first ? SE3() : gyroRotation(last_imu_t_, t_imu);
  last_imu_t_ = t_imu;
  // The velocity is not known yet: zero, and levelled by the accelerometer so that gravity is no acceleration.
  NavState turning;
  turning.t = t_imu;
  if (const std::optional<ImuSample> sample = imu_.at(t_imu); sample && sample->accel.norm() > 1.0) {
    turning.T_W_I = SE3(gravityAlignedRotation(sample->accel), Eigen::Vector3d::Zero());
  }
  const cv::Mat depth = depthAtStamp(depth_read, turning);
  tracker_.track(gray, depth, {rotation, 0, 0}, false, SE3(), colourRows(turning), t);
  tracker_.replenish(SE3(), true, t);
  const int stride = strideOn(camera_->width(), camera_->height(), options_.frame_grid_stride);
  // After a restart extrinsics and gyro correction are known better than from the configuration.
  initialiser_.setCalibration(extrinsics(), filter_.calibration().gyro_correction);
  std::optional<FilterPrior> prior =
      initialiser_.add({t_imu, measurements(), makeDepthGrid(depth, stride, sensor_.depth_noise)}, imu_);
  if (!prior) {
    const std::string why = status_.state == TrackingState::kInitialising && !status_.reason.empty() && first
                                ? status_.reason + "; " + initialiser_.reason()
                                : initialiser_.reason();
    status_ = {TrackingState::kInitialising, why};
    return statusOnly(t, status_.state, status_.reason);
  }
  startAtBase(sensor_.T_base_imu, &*prior);
  const std::optional<ImuSample> here = imu_.at(t_imu);
  const Eigen::Vector3d omega = here ? Eigen::Vector3d(here->gyro - prior->state.bias_gyro) : Eigen::Vector3d::Zero();
  filter_.start(*prior, next_clone_++, omega);
  if (prior->standing) {
    stillness_.begin(imuSpread(imu_.between(t_imu - options_.initialisation.standing_seconds, t_imu)));
  }
  initialiser_.reset();
  phase_ = Phase::kTracking;
  started_imu_t_ = t_imu;
  status_ = {TrackingState::kTracking, ""};
  last_good_t_ = last_held_t_ = last_metric_t_ = last_points_t_ = last_agreed_t_ = t;
  doubt_imu_t_ = t_imu;  // until the initial velocity is confirmed, its error cannot be distinguished from a shock
  shock_imu_t_ = -1e300;
  last_good_variance_ = filter_.covariance().block<3, 3>(3, 3).diagonal().maxCoeff();
  // The tracks' references were taken under unknown poses: begin them here.
  const SE3 T_odom_C = filter_.nav().T_W_I * extrinsics();
  tracker_.restartReferences(T_odom_C, colourRows(filter_.nav()));
  return makeOutput(t, t_imu, "first");
}

}  // namespace vip_slam
