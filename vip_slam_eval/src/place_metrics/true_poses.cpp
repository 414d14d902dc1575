#include "place_metrics/true_poses.h"

#include <cmath>

#include <Eigen/Geometry>

namespace vip_slam {

TruePoses truePoses(const Map& map, const Trajectory& truth) {
  TruePoses poses;
  for (const auto& entry : map.keyframes()) {
    const TrackedFrame& frame = entry.second.data->frame;
    SE3 T;
    if (poseAt(truth, frame.t + frame.time_offset, &T)) poses[entry.first] = T;
  }
  return poses;
}

SE3 alignMap(const Map& map, const TruePoses& truth) {
  Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = a;
  for (const auto& entry : truth) {
    a += map.keyframe(entry.first).state.T_W_I.t();
    b += entry.second.t();
  }
  a /= static_cast<double>(truth.size());
  b /= static_cast<double>(truth.size());
  double sine = 0, cosine = 0;
  for (const auto& entry : truth) {
    const Eigen::Vector3d p = map.keyframe(entry.first).state.T_W_I.t() - a, q = entry.second.t() - b;
    cosine += p.x() * q.x() + p.y() * q.y();
    sine += p.x() * q.y() - p.y() * q.x();
  }
  const Eigen::Quaterniond R(Eigen::AngleAxisd(std::atan2(sine, cosine), Eigen::Vector3d::UnitZ()));
  return SE3(R, b - R * a);
}

bool samePlace(const SE3& a, const SE3& b) {
  return (a.t() - b.t()).norm() <= 2 && a.rotation().angularDistance(b.rotation()) <= 30 * M_PI / 180;
}

}  // namespace vip_slam
