// SPDX-License-Identifier: BSD-3-Clause
// What the front-end nodelet publishes.
#include <cv_bridge/cv_bridge.h>
#include <sensor_msgs/image_encodings.h>
#include <vip_slam_msgs/Calibration.h>
#include <vip_slam_msgs/Keyframe.h>
#include <vip_slam_msgs/TrackedFrame.h>
#include <vip_slam_msgs/TrackingStatus.h>

#include "feature_image.h"
#include "front_end_nodelet.h"
#include "vip_slam_ros/calibration.h"
#include "vip_slam_ros/frame_conversions.h"
#include "vip_slam_ros/geometry_conversions.h"

namespace vip_slam {
namespace {

/// Standard deviation of one gyro sample, rad/s.
double gyroSigma(const SensorConfig& sensor) {
  return sensor.imu_noise.gyro_noise_density * std::sqrt(std::max(1.0, sensor.imu_rate));
}

}  // namespace

void FrontEndNodelet::publishPose(const ros::Time& stamp, const TrackedFrame& frame) {
  covariance_ = frame.covariance;
  if (!hasPose(frame.status.state)) return;
  posed_imu_t_ = frame.state.t;
  // A message that is published is shared with all receivers and never changed again.
  auto odometry = boost::make_shared<nav_msgs::Odometry>(
      toOdometry(stamp, frame.state, frame.covariance, front_end_->gyro(frame.state.t), gyroSigma(sensor_), frames_));
  if (publish_tf_) tf_broadcaster_->sendTransform(toTransform(*odometry));
  odometry_pub_.publish(odometry);
  odometry_monitor_->published(stamp);
}

void FrontEndNodelet::publish(const ImagePair& pair, const FrameOutput& output, double milliseconds) {
  const TrackedFrame& frame = *output.frame;
  const ros::Time stamp = ros::Time().fromNSec(pair.stamp);
  const double clock_set = stamp.toSec() - pair.t;
  // Planes and back end get the keyframe before the frame that belongs to it, as in the offline runner.
  if (output.keyframe) {
    auto keyframe = boost::make_shared<vip_slam_msgs::Keyframe>(toMsg(*output.keyframe, frames_.odom));
    keyframe->frame.header.stamp = stamp;
    keyframe->frame.clock_set = clock_set;
    keyframe_pub_.publish(keyframe);
  }
  auto tracked = boost::make_shared<vip_slam_msgs::TrackedFrame>(toMsg(frame, frames_.odom));
  tracked->header.stamp = stamp;
  tracked->clock_set = clock_set;
  tracked->processing_ms = milliseconds;
  frame_pub_.publish(tracked);
  TrackingStatus status = frame.status;
  const double now = ros::Time::now().toSec();
  std::string cause;
  if (status.state == TrackingState::kDegraded) cause = depthAbsence(now);
  if (!hasPose(status.state) && sensor_.topics.hasInertial()) cause = imu_monitor_->fault(now);
  if (!cause.empty()) status.reason += " (" + cause + ")";
  status_pub_.publish(boost::make_shared<vip_slam_msgs::TrackingStatus>(toMsg(status)));
  publishFeatureImage(pair, frame);
}

void FrontEndNodelet::publishFeatureImage(const ImagePair& pair, const TrackedFrame& frame) {
  if (feature_image_pub_.getNumSubscribers() == 0 || pair.gray.empty() || pair.gray.type() != CV_8UC1) return;
  if (pair.t - last_feature_image_ < 1.0 / feature_image_rate_ - 1e-3) return;
  last_feature_image_ = pair.t;
  std_msgs::Header header;
  header.stamp.fromNSec(pair.stamp);
  header.frame_id = calibration_->colorFrame();
  const cv_bridge::CvImage picture(header, sensor_msgs::image_encodings::BGR8, drawFeatureImage(pair.gray, frame));
  feature_image_pub_.publish(picture.toImageMsg());
}

void FrontEndNodelet::publishImuRate(double t) {
  // Each prediction integrates from the newest image on: without images its cost and its error grow.
  constexpr double kLongestPrediction = 1.0;  // seconds
  if (imu_rate_pub_.getNumSubscribers() == 0 || t - posed_imu_t_ > kLongestPrediction) return;
  const auto state = front_end_->predict(t);
  // With a separate accelerometer the state may lag behind the gyro's sample.
  if (!state || state->t <= predicted_imu_t_) return;
  predicted_imu_t_ = state->t;
  const ros::Time stamp = toStamp(time_->onMachineClock(state->t - front_end_->timeOffset()));
  imu_rate_pub_.publish(boost::make_shared<nav_msgs::Odometry>(
      toOdometry(stamp, *state, covariance_, front_end_->gyro(state->t), gyroSigma(sensor_), frames_)));
}

void FrontEndNodelet::publishCalibration() {
  calibration_pub_.publish(boost::make_shared<vip_slam_msgs::Calibration>(
      toCalibrationMsg(sensor_, time_->newest(), calibration_->colorFrame())));
}

}  // namespace vip_slam
