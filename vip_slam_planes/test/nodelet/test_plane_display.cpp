// SPDX-License-Identifier: BSD-3-Clause
// What rviz is told about planes: colours, translucency, deletions, depth points.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl_conversions/pcl_conversions.h>

#include "plane_display.h"

namespace vip_slam {
namespace {

using visualization_msgs::Marker;

PlaneEstimate square(PlaneId id, PlaneKind kind) {
  PlaneEstimate estimate;
  estimate.id = id;
  estimate.kind = kind;
  estimate.plane = kind == PlaneKind::kHorizontal ? Plane({0, 0, 1}, 0) : Plane({-1, 0, 0}, 0);
  const Eigen::Vector3d u = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d v = kind == PlaneKind::kHorizontal ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ();
  PlanePolygon polygon;
  polygon.outer = {u * 0 + v * 0, u, u + v, v};
  estimate.polygons.push_back(polygon);
  return estimate;
}

bool isGrey(const std_msgs::ColorRGBA& c) { return std::abs(c.r - c.g) < 0.05 && std::abs(c.g - c.b) < 0.05; }

std::map<std::string, Marker> byName(const visualization_msgs::MarkerArray& array) {
  std::map<std::string, Marker> result;
  for (const Marker& m : array.markers) result[m.ns + " " + std::to_string(m.id)] = m;
  return result;
}

TEST(PlaneDisplay, HorizontalOnesAreGreyOthersHaveAColourEach) {
  PlaneDisplay display;
  const std::vector<PlaneEstimate> planes = {square(1, PlaneKind::kHorizontal), square(2, PlaneKind::kVertical),
                                             square(3, PlaneKind::kVertical), square(4, PlaneKind::kGeneral)};
  std_msgs::Header header;
  header.frame_id = "map";
  const auto markers = byName(display.markers(planes, header, 0.4));
  ASSERT_EQ(markers.size(), 8u);
  for (const auto& [name, marker] : markers) {
    EXPECT_EQ(marker.action, Marker::ADD);
    EXPECT_EQ(marker.header.frame_id, "map");
    EXPECT_EQ(isGrey(marker.color), marker.id == 1) << name;
    EXPECT_FLOAT_EQ(marker.color.a, marker.ns == "planes" ? 0.4f : 1.0f) << name;
    EXPECT_EQ(marker.colors.size(), marker.ns == "planes" ? marker.points.size() : 0u);
  }
  EXPECT_EQ(markers.at("planes 2").points.size(), 6u);    // two triangles
  EXPECT_EQ(markers.at("outlines 2").points.size(), 8u);  // four edges
  const auto differ = [&](int a, int b) {
    const auto &p = markers.at("planes " + std::to_string(a)).color,
               &q = markers.at("planes " + std::to_string(b)).color;
    return std::abs(p.r - q.r) + std::abs(p.g - q.g) + std::abs(p.b - q.b) > 0.2;
  };
  EXPECT_TRUE(differ(2, 3) && differ(3, 4) && differ(2, 4));
  // The same colour the next time; what is gone is deleted, once.
  const auto later = byName(display.markers({planes[1]}, header, 0.4));
  ASSERT_EQ(later.size(), 8u);
  EXPECT_EQ(later.at("planes 2").color, markers.at("planes 2").color);
  for (const auto& [name, marker] : later)
    EXPECT_EQ(marker.action, marker.id == 2 ? Marker::ADD : Marker::DELETE) << name;
  EXPECT_EQ(display.markers({planes[1]}, header, 0.4).markers.size(), 2u);
}

TEST(PlaneDisplay, DepthPointsHaveThePlanesColoursAndMoveWithTheirKeyframes) {
  PlaneDisplay display;
  std_msgs::Header header;
  MapUpdate map;
  KeyframeEstimate keyframe;
  keyframe.id = 5;
  keyframe.state.T_W_I = SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 0, 0));
  map.keyframes.push_back(keyframe);
  PlaneUpdate update;
  update.planes = {square(1, PlaneKind::kHorizontal), square(2, PlaneKind::kVertical)};
  for (const PlaneId plane : {1, 2}) {
    PlaneObservation seen;
    seen.keyframe = 5;
    seen.plane = plane;
    seen.points.push_back({Eigen::Vector3f(0, 0, float(plane)), 0.01f});
    update.observations.push_back(seen);
  }
  display.apply(map);
  display.apply(update);
  EXPECT_EQ(display.points(), 2u);
  pcl::PointCloud<pcl::PointXYZRGB> cloud;
  pcl::fromROSMsg(display.cloud(header, 0), cloud);
  ASSERT_EQ(cloud.size(), 2u);
  for (const auto& point : cloud) {
    EXPECT_FLOAT_EQ(point.x, 1);
    std_msgs::ColorRGBA color;
    color.r = point.r / 255.f, color.g = point.g / 255.f, color.b = point.b / 255.f;
    EXPECT_EQ(isGrey(color), point.z == 1.0f);
  }
  update.observations.clear();
  update.removed = {1};
  update.planes.erase(update.planes.begin());
  display.apply(update);
  EXPECT_EQ(display.points(), 1u);
  map.keyframes.clear();
  map.removed_keyframes = {5};
  display.apply(map);
  EXPECT_EQ(display.points(), 0u);
}

// Two planes that meet: each keeps its points and its colour, one in a cube, the mean of those in it.
TEST(PlaneDisplay, TheCloudIsThinnedPlaneByPlane) {
  PlaneDisplay display;
  MapUpdate map;
  KeyframeEstimate keyframe;
  keyframe.id = 5;
  map.keyframes.push_back(keyframe);
  PlaneUpdate update;
  update.planes = {square(1, PlaneKind::kHorizontal), square(2, PlaneKind::kVertical)};
  for (const PlaneId plane : {1, 2}) {
    PlaneObservation seen;
    seen.keyframe = 5;
    seen.plane = plane;
    for (int i = 0; i < 40; ++i)
      seen.points.push_back({Eigen::Vector3f(0.005f + 0.01f * float(i), 0.05f, 0.05f), 0.01f});
    update.observations.push_back(seen);
  }
  display.apply(map);
  display.apply(update);
  std_msgs::Header header;
  header.frame_id = "map";
  header.stamp.fromNSec(1700000000123456789);
  const sensor_msgs::PointCloud2 message = display.cloud(header, 0.1);
  EXPECT_EQ(message.header, header) << "to the nanosecond";
  pcl::PointCloud<pcl::PointXYZRGB> cloud;
  pcl::fromROSMsg(message, cloud);
  ASSERT_EQ(cloud.size(), 8u);
  std::size_t grey = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_NEAR(std::fmod(cloud[i].x, 0.1f), 0.05f, 1e-4f);
    grey += std::abs(cloud[i].r - cloud[i].g) < 12 && std::abs(cloud[i].g - cloud[i].b) < 12;
  }
  EXPECT_EQ(grey, 4u);
  pcl::fromROSMsg(display.cloud(header, 0), cloud);
  EXPECT_EQ(cloud.size(), 80u);
}

}  // namespace
}  // namespace vip_slam
