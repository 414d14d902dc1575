// SPDX-License-Identifier: BSD-3-Clause
#include "plane_display.h"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "vip_slam_core/geometry/polygon_triangulation.h"
#include "vip_slam_ros/geometry_conversions.h"
#include "vip_slam_ros/markers.h"
#include "vip_slam_ros/point_cloud.h"

namespace vip_slam {
namespace {

std_msgs::ColorRGBA colorOf(PlaneId id, bool horizontal, double alpha) {
  return horizontal ? makeColor(0.62, 0.62, 0.65, alpha) : colorOfId(id, alpha);
}

void addRing(const Ring& ring, visualization_msgs::Marker* lines) {
  for (std::size_t i = 0; i < ring.size(); ++i) {
    lines->points.push_back(toPointMsg(ring[i]));
    lines->points.push_back(toPointMsg(ring[(i + 1) % ring.size()]));
  }
}

}  // namespace

visualization_msgs::MarkerArray PlaneDisplay::markers(const std::vector<PlaneEstimate>& planes,
                                                      const std_msgs::Header& header, double opacity) {
  using visualization_msgs::Marker;
  visualization_msgs::MarkerArray array;
  std::set<PlaneId> now;
  for (const PlaneEstimate& plane : planes) {
    Marker fill = makeMarker(header, "planes", int(plane.id), Marker::TRIANGLE_LIST);
    const bool horizontal = plane.kind == PlaneKind::kHorizontal;
    fill.color = colorOf(plane.id, horizontal, opacity);
    Marker lines = makeMarker(header, "outlines", int(plane.id), Marker::LINE_LIST);
    lines.color = colorOf(plane.id, horizontal, 1.0);
    lines.scale.x = 0.02;
    for (const PlanePolygon& polygon : plane.polygons) {
      for (const Triangle& triangle : triangulate(polygon, plane.plane)) {
        for (const auto& corner : triangle) fill.points.push_back(toPointMsg(corner));
      }
      addRing(polygon.outer, &lines);
      for (const Ring& hole : polygon.holes) addRing(hole, &lines);
    }
    // With a colour per corner rviz draws without lighting, so that a plane looks the same from both sides.
    fill.colors.assign(fill.points.size(), fill.color);
    if (fill.points.empty()) continue;  // rviz warns about empty lists
    now.insert(plane.id);
    array.markers.push_back(std::move(fill));
    array.markers.push_back(std::move(lines));
  }
  for (const PlaneId id : shown_) {
    if (now.count(id) > 0) continue;
    array.markers.push_back(makeDeletion(header, "planes", int(id)));
    array.markers.push_back(makeDeletion(header, "outlines", int(id)));
  }
  shown_ = std::move(now);
  return array;
}

void PlaneDisplay::apply(const MapUpdate& update) {
  for (const auto& keyframe : update.keyframes) keyframes_[keyframe.id] = keyframe.state.T_W_I * keyframe.T_I_C;
  for (const KeyframeId id : update.removed_keyframes) {
    keyframes_.erase(id);
    for (auto& [plane, observations] : points_) observations.erase(id);
  }
}

void PlaneDisplay::apply(const PlaneUpdate& update) {
  for (const PlaneMerge& merge : update.merges) {
    auto node = points_.extract(merge.from);
    if (node.empty()) continue;
    for (auto& [keyframe, points] : node.mapped()) {
      auto& into = points_[merge.into][keyframe];
      into.insert(into.end(), points.begin(), points.end());
    }
  }
  for (const PlaneId id : update.removed) points_.erase(id);
  horizontal_.clear();  // an update lists all planes
  for (const PlaneEstimate& plane : update.planes) {
    if (plane.kind == PlaneKind::kHorizontal) horizontal_.insert(plane.id);
  }
  for (const PlaneObservation& observation : update.observations) {
    auto& points = points_[observation.plane][observation.keyframe];
    points.clear();
    for (const PlaneSample& point : observation.points) points.push_back(point.p_C);
  }
}

sensor_msgs::PointCloud2 PlaneDisplay::cloud(const std_msgs::Header& header, double voxel) const {
  ColoredCloud all;
  all.reserve(points());
  for (const auto& [plane, observations] : points_) {
    ColoredCloud one;
    const std_msgs::ColorRGBA color = colorOf(plane, horizontal_.count(plane) > 0, 1.0);
    for (const auto& [keyframe, points] : observations) {
      const auto pose = keyframes_.find(keyframe);
      if (pose == keyframes_.end()) continue;
      const Eigen::Matrix3f R = pose->second.R().cast<float>();
      const Eigen::Vector3f t = pose->second.t().cast<float>();
      for (const auto& p : points) addPoint(R * p + t, color, &one);
    }
    // Each plane by itself: its colour stays its own at corners, and the cubes of one plane are few enough to count.
    if (voxel > 0) thin(voxel, &one);
    all += one;
  }
  return toPointCloud(all, header);
}

std::size_t PlaneDisplay::points() const {
  std::size_t count = 0;
  for (const auto& [plane, observations] : points_) {
    for (const auto& [keyframe, points] : observations) count += points.size();
  }
  return count;
}

void PlaneDisplay::clear() {
  keyframes_.clear();
  points_.clear();
  horizontal_.clear();
}

}  // namespace vip_slam
