#include "vip_slam_ros/tf_lookup.h"

#include "vip_slam_ros/geometry_conversions.h"

namespace vip_slam {

std::optional<SE3> lookUpTransform(const tf2_ros::Buffer& buffer, const std::string& target,
                                   const std::string& source) {
  if (target.empty() || source.empty()) return std::nullopt;
  try {
    return fromMsg(buffer.lookupTransform(target, source, ros::Time(0)).transform);
  } catch (const tf2::TransformException&) {
    return std::nullopt;
  }
}

}  // namespace vip_slam
