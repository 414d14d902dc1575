// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/metrics/polygon_overlap.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vip_slam {

Eigen::Vector2d planeCoordinates(const Plane& plane, const Eigen::Vector3d& x) {
  return tangentBasis(plane.n).transpose() * x;
}

FlatRegion::FlatRegion(const std::vector<PlanePolygon>& polygons, const Plane& plane) {
  const Eigen::Matrix<double, 3, 2> basis = tangentBasis(plane.n);
  min_y_ = std::numeric_limits<double>::infinity();
  max_y_ = -min_y_;
  const auto add = [&](const Ring& ring) {
    std::vector<Eigen::Vector2d> flat;
    for (const Eigen::Vector3d& p : ring) {
      flat.push_back(basis.transpose() * p);
      min_y_ = std::min(min_y_, flat.back().y());
      max_y_ = std::max(max_y_, flat.back().y());
    }
    if (flat.size() >= 3) rings_.push_back(std::move(flat));
  };
  for (const PlanePolygon& polygon : polygons) {
    add(polygon.outer);
    for (const Ring& hole : polygon.holes) add(hole);
  }
}

std::vector<double> FlatRegion::crossings(double y) const {
  std::vector<double> xs;
  for (const auto& ring : rings_) {
    for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
      const Eigen::Vector2d &a = ring[j], &b = ring[i];
      if ((a.y() > y) == (b.y() > y)) continue;
      xs.push_back(a.x() + (b.x() - a.x()) * (y - a.y()) / (b.y() - a.y()));
    }
  }
  std::sort(xs.begin(), xs.end());
  return xs;
}

bool FlatRegion::contains(const Eigen::Vector2d& p) const {
  const std::vector<double> xs = crossings(p.y());
  const auto before = std::upper_bound(xs.begin(), xs.end(), p.x()) - xs.begin();
  return before % 2 == 1;
}

double FlatRegion::area() const {
  // Holes may have either orientation, so the sign of a ring's area does not distinguish it from an outline: scan.
  return overlap(*this, *this);
}

double FlatRegion::overlap(const FlatRegion& a, const FlatRegion& b, double step) {
  const double low = std::max(a.min_y_, b.min_y_), high = std::min(a.max_y_, b.max_y_);
  if (!(high > low)) return 0;
  const int lines = std::max(16, static_cast<int>(std::ceil((high - low) / step)));
  const double height = (high - low) / lines;
  double length = 0;
  for (int k = 0; k < lines; ++k) {
    const double y = low + (k + 0.5) * height;
    const std::vector<double> xa = a.crossings(y), xb = b.crossings(y);
    for (std::size_t i = 0, j = 0; i + 1 < xa.size() && j + 1 < xb.size();) {
      length += std::max(0.0, std::min(xa[i + 1], xb[j + 1]) - std::max(xa[i], xb[j]));
      (xa[i + 1] < xb[j + 1] ? i : j) += 2;
    }
  }
  return length * height;
}

}  // namespace vip_slam
