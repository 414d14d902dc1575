// SPDX-License-Identifier: BSD-3-Clause
// Contradictions between images and IMU: repeated images, faults of the IMU, bodies that move independently of
// the camera, an IMU that is wrong or missing.
#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/util/same_pixels.h"
#include "vip_slam_core/util/statistics.h"

#include "front_end_impl.h"

namespace vip_slam {

namespace {

// Factor on the IMU's noise that no sound IMU reaches: with wrong axes, signs or units the adapted factor goes to its
// limit of 30, while extrinsics that are wrong by a degree or a delay of 10 ms leave it at 1.
constexpr double kImplausibleNoise = 10.0;

}  // namespace

bool FrontEnd::Impl::imuIsContradicted() const { return filter_.imuNoiseScale() > kImplausibleNoise; }

bool FrontEnd::Impl::movesByImu(double t_imu, const SE3& T_odom_C_then) const {
  if (!rest_.imuIsQuiet(inertial_, filter_.nav().t, t_imu)) return true;
  const std::vector<ImuSample> samples = inertial_.between(filter_.nav().t, t_imu);
  if (samples.size() < 2) return true;
  const SE3 T_now_then = (filter_.predict(samples).predicted.T_W_I * extrinsics()).inverse() * T_odom_C_then;
  std::vector<double> moved;
  for (const Eigen::Vector3d& then : trackedPoints()) {
    const Eigen::Vector3d now = T_now_then * then;
    if (now.z() > 0) moved.push_back((now.hnormalized() - then.hnormalized()).norm() * camera_->focal());
  }
  if (moved.empty()) return true;
  // A standing camera that is simulated without noise renders equal images.
  return upperMedian(std::move(moved)) > kStillPixels;
}

bool FrontEnd::Impl::repeatsLastImage(const cv::Mat& gray, double t_imu) const {
  return !rest_.still() && !tracker_.tracks().empty() && samePixels(gray, tracker_.gray()) &&
         movesByImu(t_imu, filter_.nav().T_W_I * extrinsics());
}

FrameOutput FrontEnd::Impl::repeatedImage(double t, double t_imu) {
  ++counters_.repeated_image;
  // A camera slower than its topic repeats images in between, which is no fault for a moment.
  if (health_.tracking() && t_imu - filter_.nav().t < kMoment)
    return statusOnly(t, health_.status().state, health_.status().reason);
  return unusable(t, "the image repeats the one before: has the camera frozen?");
}

}  // namespace vip_slam
