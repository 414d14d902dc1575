// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/runner/plane_files.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "vip_slam_core/geometry/polygon_triangulation.h"
#include "vip_slam_core/util/atomic_file.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_ros/markers.h"

namespace vip_slam {
namespace {

struct Rgb {
  int r, g, b;
};

Rgb colorOf(const PlaneEstimate& plane) {
  if (plane.kind == PlaneKind::kHorizontal) return {165, 165, 170};
  const auto color = colorOfId(plane.id);
  return {int(255 * color.r), int(255 * color.g), int(255 * color.b)};
}

struct Box {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  void add(const Eigen::Vector3d& p) {
    low = low.cwiseMin(p.head<2>());
    high = high.cwiseMax(p.head<2>());
  }
  bool empty() const { return low.x() > high.x(); }
};

/// Points as an SVG path in drawing coordinates: x to the right, y (up) flipped to y down.
std::string pathData(const std::vector<Eigen::Vector3d>& points, bool closed) {
  std::string data;
  for (const auto& p : points) data += formatted(data.empty() ? "M%.3f %.3f" : "L%.3f %.3f", p.x(), -p.y());
  return closed ? data + "Z" : data;
}

/// The ends of a vertical polygon seen from above.
std::vector<Eigen::Vector3d> wallEnds(const PlanePolygon& polygon, const Plane& plane) {
  const Eigen::Vector3d along = plane.n.cross(Eigen::Vector3d::UnitZ()).normalized();
  const auto [low, high] = std::minmax_element(
      polygon.outer.begin(), polygon.outer.end(),
      [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return along.dot(a) < along.dot(b); });
  return {*low, *high};
}

/// Horizontal planes that one stands on: facing up, within 30 cm of the lowest of at least 1 m^2.
std::vector<const PlaneEstimate*> floors(const std::vector<PlaneEstimate>& planes) {
  const auto height = [](const PlaneEstimate& p) { return -p.plane.d * p.plane.n.z(); };
  const auto faces_up = [](const PlaneEstimate& p) {
    return p.kind == PlaneKind::kHorizontal && p.plane.n.z() > 0 && p.area >= 1.0;
  };
  double lowest = std::numeric_limits<double>::infinity();
  for (const auto& plane : planes) {
    if (faces_up(plane)) lowest = std::min(lowest, height(plane));
  }
  std::vector<const PlaneEstimate*> result;
  for (const auto& plane : planes) {
    if (faces_up(plane) && height(plane) < lowest + 0.3) result.push_back(&plane);
  }
  return result;
}

}  // namespace

void writePlanesPly(const std::string& path, const std::vector<PlaneEstimate>& planes) {
  std::vector<std::pair<Triangle, Rgb>> triangles;
  for (const auto& plane : planes) {
    for (const auto& polygon : plane.polygons) {
      for (const auto& triangle : triangulate(polygon, plane.plane)) triangles.emplace_back(triangle, colorOf(plane));
    }
  }
  AtomicFile file(path);
  auto& out = file.stream();
  out << "ply\nformat ascii 1.0\ncomment planes of a VIP-SLAM map, metres\nelement vertex " << 3 * triangles.size()
      << "\nproperty float x\nproperty float y\nproperty float z\n"
         "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face "
      << triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const auto& [triangle, color] : triangles) {
    for (const auto& p : triangle)
      out << formatted("%.4f %.4f %.4f %d %d %d\n", p.x(), p.y(), p.z(), color.r, color.g, color.b);
  }
  for (std::size_t i = 0; i < triangles.size(); ++i)
    out << "3 " << 3 * i << " " << 3 * i + 1 << " " << 3 * i + 2 << "\n";
  file.commit();
}

void writeFloorPlan(const std::string& path, const std::vector<PlaneEstimate>& planes, const Trajectory& trajectory) {
  Box box;
  std::string drawing;
  drawing += "<g fill='#e9e6df' fill-rule='evenodd' stroke='none'>\n";
  for (const PlaneEstimate* plane : floors(planes)) {
    for (const auto& polygon : plane->polygons) {
      std::string data = pathData(polygon.outer, true);
      for (const auto& hole : polygon.holes) data += pathData(hole, true);
      for (const auto& p : polygon.outer) box.add(p);
      drawing += "<path d='" + data + "'/>\n";
    }
  }
  drawing += "</g>\n<g stroke='#2b2f36' stroke-width='0.08' stroke-linecap='round' fill='none'>\n";
  for (const auto& plane : planes) {
    if (plane.kind != PlaneKind::kVertical) continue;
    for (const auto& polygon : plane.polygons) {
      if (polygon.outer.size() < 3) continue;
      const auto ends = wallEnds(polygon, plane.plane);
      for (const auto& p : ends) box.add(p);
      drawing += "<path d='" + pathData(ends, false) + "'/>\n";
    }
  }
  drawing += "</g>\n";
  std::vector<Eigen::Vector3d> line;
  for (const auto& pose : trajectory) {
    // A point every five centimetres is enough for the drawing.
    if (line.empty() || (pose.T_W_B.t() - line.back()).norm() > 0.05) line.push_back(pose.T_W_B.t());
    box.add(pose.T_W_B.t());
  }
  if (!line.empty()) {
    drawing += "<path fill='none' stroke='#d5462f' stroke-width='0.04' d='" + pathData(line, false) + "'/>\n";
    drawing +=
        "<circle r='0.1' fill='#d5462f'" + formatted(" cx='%.3f' cy='%.3f'/>\n", line.front().x(), -line.front().y());
  }
  if (box.empty()) {
    box.add({0, 0, 0});
    box.add({1, 1, 0});
  }
  const double margin = 0.5, footer = 0.8;
  const double left = box.low.x() - margin, top = -box.high.y() - margin;
  const double width = std::max(2.5, box.high.x() - box.low.x() + 2 * margin);
  const double height = box.high.y() - box.low.y() + 2 * margin + footer;
  const double scale = std::clamp(1000.0 / width, 10.0, 120.0);  // pixels per metre
  const double x = left + 0.3, y = top + height - 0.4;

  AtomicFile file(path);
  auto& out = file.stream();
  out << "<svg xmlns='http://www.w3.org/2000/svg'"
      << formatted(" width='%.0f' height='%.0f'", scale * width, scale * height)
      << formatted(" viewBox='%.3f %.3f", left, top) << formatted(" %.3f %.3f'>\n", width, height) << "<rect"
      << formatted(" x='%.3f' y='%.3f'", left, top) << formatted(" width='%.3f' height='%.3f'", width, height)
      << " fill='white'/>\n"
      << drawing << "<path stroke='#2b2f36' stroke-width='0.04' d='" << pathData({{x, -y, 0}, {x + 1, -y, 0}}, false)
      << "'/>\n<text font-family='sans-serif' font-size='0.25' fill='#2b2f36'"
      << formatted(" x='%.3f' y='%.3f'", x + 1.1, y + 0.08) << ">1 m</text>\n</svg>\n";
  file.commit();
}

}  // namespace vip_slam
