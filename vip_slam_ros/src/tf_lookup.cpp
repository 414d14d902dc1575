// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/tf_lookup.h"

#include <tf2/exceptions.h>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_ros/geometry_conversions.h"

namespace vip_slam {

std::string bareFrame(const std::string& frame) { return !frame.empty() && frame[0] == '/' ? frame.substr(1) : frame; }

std::optional<SE3> lookUpTransform(const tf2::BufferCore& buffer, const std::string& target,
                                   const std::string& source) {
  if (target.empty() || source.empty()) return std::nullopt;
  try {
    return fromMsg(buffer.lookupTransform(bareFrame(target), bareFrame(source), ros::Time(0)).transform);
  } catch (const tf2::TransformException&) {
    return std::nullopt;
  }
}

std::optional<SE3> lookUpExtrinsics(const tf2::BufferCore& buffer, const std::string& imu_frame,
                                    const std::string& camera_frame) {
  if (bareFrame(imu_frame) == bareFrame(camera_frame)) return std::nullopt;
  return lookUpTransform(buffer, imu_frame, camera_frame);
}

std::string whyNoExtrinsics(const std::string& imu_frame, const std::string& camera_frame) {
  if (imu_frame.empty()) return "the IMU messages' frame_id is empty: tf cannot tell where the IMU is";
  if (camera_frame.empty()) return "the images' frame_id is empty: tf cannot tell where the camera is";
  if (bareFrame(imu_frame) == bareFrame(camera_frame))
    return "image and IMU name the same frame, '" + camera_frame + "': tf cannot tell where they are";
  return "tf does not connect '" + camera_frame + "' to '" + imu_frame + "'";
}

std::string leverArmProblem(const SE3& T_imu_cam, double most) {
  const double arm = T_imu_cam.t().norm();
  if (arm <= most) return "";
  return formatted("the camera is %.2f m from the IMU, expected %g m at most (max_lever_arm): %s", arm, most,
                   arm > 5 ? "in millimetres instead of metres?" : "is that right?");
}

ExtrinsicsGap extrinsicsGap(const SE3& T_imu_cam_a, const SE3& T_imu_cam_b) {
  ExtrinsicsGap gap;
  gap.degrees = T_imu_cam_a.rotation().angularDistance(T_imu_cam_b.rotation()) / kDegree;
  gap.metres = (T_imu_cam_a.t() - T_imu_cam_b.t()).norm();
  return gap;
}

}  // namespace vip_slam
