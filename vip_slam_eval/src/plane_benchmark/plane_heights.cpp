// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/plane_benchmark/plane_heights.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <locale>
#include <sstream>

#include "vip_slam_core/util/statistics.h"
#include "vip_slam_eval/metrics/polygon_overlap.h"

namespace vip_slam {

void measureHeights(double t, const cv::Mat& depth, const CameraModel& camera, const SE3& T_map_C,
                    const std::vector<PlaneEstimate>& planes, PlaneHeights* heights, std::size_t min_points) {
  constexpr int kStep = 4;         // pixels
  constexpr double kReach = 0.10;  // metres: wide enough not to hide a drift of several centimetres
  for (const PlaneEstimate& plane : planes) {
    if (plane.kind != PlaneKind::kHorizontal || plane.plane.signedDistance(T_map_C.t()) <= 0) continue;
    const FlatRegion region(plane.polygons, plane.plane);
    std::vector<double> z;
    for (int v = kStep / 2; v < depth.rows; v += kStep) {
      for (int u = kStep / 2; u < depth.cols; u += kStep) {
        const float measured = depth.at<float>(v, u);
        Eigen::Vector2d xy;
        if (!(measured > 0) || !camera.undistort({double(u), double(v)}, &xy)) continue;
        const Eigen::Vector3d p = T_map_C * (double(measured) * Eigen::Vector3d(xy.x(), xy.y(), 1.0));
        if (std::abs(plane.plane.signedDistance(p)) > kReach) continue;
        if (region.contains(planeCoordinates(plane.plane, p))) z.push_back(p.z());
      }
    }
    if (z.size() < min_points) continue;
    (*heights)[plane.id].push_back({t, upperMedian(z), z.size()});
  }
}

std::string heightTable(const PlaneHeights& heights, const std::vector<PlaneEstimate>& planes) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << std::fixed << "level planes: id, area m^2, images, mean height cm, standard deviation cm, range cm\n";
  for (const auto& [id, samples] : heights) {
    double sum = 0, squares = 0, low = samples.front().height, high = low;
    for (const PlaneHeight& s : samples) {
      sum += s.height;
      low = std::min(low, s.height), high = std::max(high, s.height);
    }
    const double mean = sum / double(samples.size());
    for (const PlaneHeight& s : samples) squares += (s.height - mean) * (s.height - mean);
    const auto plane = std::find_if(planes.begin(), planes.end(), [id = id](const auto& p) { return p.id == id; });
    out << std::setw(5) << id << std::setprecision(2) << std::setw(9) << (plane == planes.end() ? 0.0 : plane->area)
        << std::setw(7) << samples.size() << std::setw(10) << 100 * mean << std::setw(8)
        << 100 * std::sqrt(squares / double(samples.size())) << std::setw(8) << 100 * (high - low) << '\n';
  }
  return out.str();
}

std::string heightsCsv(const PlaneHeights& heights) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << "plane,t,height_m,points\n" << std::fixed;
  for (const auto& [id, samples] : heights) {
    for (const PlaneHeight& s : samples) {
      out << id << ',' << std::setprecision(9) << s.t << ',' << std::setprecision(5) << s.height << ',' << s.points
          << '\n';
    }
  }
  return out.str();
}

}  // namespace vip_slam
