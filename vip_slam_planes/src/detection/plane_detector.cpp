// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/detection/plane_detector.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/util/statistics.h"
#include "vip_slam_planes/detection/connected_surfaces.h"
#include "vip_slam_planes/detection/plane_fit.h"
#include "vip_slam_planes/detection/plane_histogram.h"
#include "vip_slam_planes/detection/surface_layers.h"
#include "vip_slam_planes/detection/surface_shape.h"
#include "vip_slam_planes/growth/triangle_association.h"

namespace vip_slam {
namespace {

class Detector {
 public:
  Detector(const std::vector<MapTriangle>& triangles, const std::vector<char>& taken,
           const Eigen::Vector3d& camera_centre, const PlaneDetectionOptions& options, const PlaneGrowthOptions& growth)
      : triangles_(triangles),
        taken_(taken),
        camera_(camera_centre),
        options_(options),
        growth_(growth),
        level_(options.gravity_deg),
        joins_(growth.angle_deg) {}

  std::vector<DetectedPlane> run() {
    histogramPeaks();
    if (options_.general) generalSurfaces();
    return std::move(found_);
  }

  std::vector<DetectedPlane> runAt(PlaneKind kind) {
    std::vector<int> members;
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      if (!taken_[i]) members.push_back(static_cast<int>(i));
    }
    if (!members.empty()) startFrom(members, kind);
    return std::move(found_);
  }

 private:
  bool kindOf(const MapTriangle& t, PlaneKind* kind) const {
    const double gate = level_.angle(t);
    if (std::abs(t.n.z()) > std::cos(gate)) {
      *kind = PlaneKind::kHorizontal;
    } else if (std::abs(t.n.z()) < std::sin(gate)) {
      *kind = PlaneKind::kVertical;
    } else {
      *kind = PlaneKind::kGeneral;
    }
    return *kind != PlaneKind::kGeneral;
  }

  void histogramPeaks() {
    PlaneHistogram histogram(options_.height_bin, options_.distance_bin, options_.angle_bin_deg);
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      PlaneKind kind;
      const MapTriangle& t = triangles_[i];
      if (taken_[i] || !kindOf(t, &kind)) continue;
      const Eigen::Vector3d local = t.centre - camera_;
      if (kind == PlaneKind::kHorizontal) {
        histogram.addHorizontal(t.n, local, t.area, static_cast<int>(i));
      } else {
        histogram.addVertical(t.n, local, t.area, static_cast<int>(i));
      }
    }
    while (true) {
      const PlaneHistogram::Peak peak = histogram.peak();
      if (peak.area < options_.min_area) break;
      for (int i : peak.members) histogram.remove(i);
      PlaneKind kind;
      kindOf(triangles_[peak.members.front()], &kind);
      for (int i : startFrom(peak.members, kind)) histogram.remove(i);
    }
  }

  // Starts planes from the triangles of a peak; returns the triangles that their surfaces consist of.
  std::vector<int> startFrom(const std::vector<int>& members, PlaneKind kind) {
    std::vector<int> used;
    Plane plane;
    if (!fit(members, kind, &plane, nullptr)) return used;
    std::vector<double> offset, area;
    for (int i : members) {
      offset.push_back(plane.signedDistance(triangles_[i].centre));
      area.push_back(triangles_[i].area);
    }
    const auto layers = splitLayers(offset, area, medianSigma(members));
    for (const std::vector<int>& layer : layers) {
      std::vector<int> own;
      for (int k : layer) own.push_back(members[k]);
      if (layers.size() > 1 && !fit(own, kind, &plane, nullptr)) continue;
      std::vector<char> apart(triangles_.size(), 0);
      if (layers.size() > 1) {
        for (int i : members) apart[i] = 1;
        for (int i : own) apart[i] = 0;
      }
      for (const std::vector<int>& surface : surfaces(gather(plane, apart), plane)) {
        if (accept(surface, kind)) used.insert(used.end(), surface.begin(), surface.end());
      }
    }
    return used;
  }

  // Flood fill over the mesh, after the peaks; accept() checks that a surface is neither horizontal nor vertical.
  void generalSurfaces() {
    std::vector<char> visited(triangles_.size(), 0);
    const std::vector<char> nowhere(triangles_.size(), 0);
    for (std::size_t seed = 0; seed < triangles_.size(); ++seed) {
      if (visited[seed] || taken_[seed]) continue;
      const Plane start = Plane::fromPointNormal(triangles_[seed].centre, triangles_[seed].n);
      std::vector<int> patch{static_cast<int>(seed)};
      visited[seed] = 1;
      double area = 0;
      for (std::size_t i = 0; i < patch.size(); ++i) {
        area += triangles_[patch[i]].area;
        for (int g : triangles_[patch[i]].neighbour) {
          if (g < 0 || visited[g] || taken_[g] || !joins(triangles_[g], start, 3.0)) continue;
          visited[g] = 1;
          patch.push_back(g);
        }
      }
      Plane plane;
      if (area < options_.min_area || !fit(patch, PlaneKind::kGeneral, &plane, nullptr)) continue;
      for (const std::vector<int>& surface : surfaces(gather(plane, nowhere), plane)) {
        accept(surface, PlaneKind::kGeneral);
      }
    }
  }

  std::vector<std::vector<int>> surfaces(const std::vector<int>& members, const Plane& plane) const {
    return connectedSurfaces(triangles_, members, plane, camera_, std::max(0.05, growth_.gap));
  }

  bool joins(const MapTriangle& t, const Plane& plane, double widening) const {
    return plane.n.dot(t.n) > joins_.cosine(t) &&
           std::abs(plane.signedDistance(t.centre)) < widening * distanceGate(t, growth_.distance);
  }

  // The free triangles on the plane, except those of another layer.
  std::vector<int> gather(const Plane& plane, const std::vector<char>& apart) const {
    std::vector<int> members;
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      if (!taken_[i] && !apart[i] && joins(triangles_[i], plane, 1.0)) members.push_back(static_cast<int>(i));
    }
    return members;
  }

  bool fit(const std::vector<int>& members, PlaneKind kind, Plane* plane, double* rms) const {
    std::vector<Eigen::Vector3d> points;
    std::vector<double> weights;
    for (int i : members) {
      points.push_back(triangles_[i].centre - camera_);
      weights.push_back(fitWeight(triangles_[i]));
    }
    Plane local;
    if (points.size() < 3 || !fitPlaneRobust(points, weights, medianSigma(members) + 0.002, kind,
                                             triangles_[members.front()].n, &local, rms)) {
      return false;
    }
    *plane = Plane(local.n, local.d - local.n.dot(camera_));
    return true;
  }

  double medianSigma(const std::vector<int>& members) const {
    std::vector<double> sigmas;
    for (int i : members) sigmas.push_back(triangles_[i].sigma);
    return upperMedian(std::move(sigmas));
  }

  bool accept(const std::vector<int>& surface, PlaneKind kind) {
    DetectedPlane result;
    result.kind = kind;
    PlaneMoments moments;
    for (int i : surface) {
      result.area += triangles_[i].area;
      for (const Eigen::Vector3d& p : triangles_[i].corner) moments.add(p - camera_, triangles_[i].area / 3);
    }
    // Horizontal surfaces may be strips: they are seen at a flat angle, a few nodes high, and a mesh across a step is
    // horizontal by accident only.
    if (result.area < options_.min_area) return false;
    if (kind != PlaneKind::kHorizontal && !isSolid(triangles_, surface)) return false;
    double rms = 0;
    if (!fit(surface, kind, &result.plane, &rms)) return false;
    const double sigma = medianSigma(surface);
    if (rms > options_.max_rms + 1.5 * sigma) return false;
    if (kind == PlaneKind::kVertical && mayBeAStep(triangles_, surface, result.plane, camera_)) return false;
    const Eigen::Vector3d& n = result.plane.n;
    if (kind == PlaneKind::kVertical && facetsLean(triangles_, surface, result.plane, Eigen::Vector3d::UnitZ().cross(n),
                                                   options_.max_tilt_deg * kDegree)) {
      return false;
    }

    const double spread = moments.spread();
    if (spread * std::sqrt(12.0) < options_.min_width) return false;  // side of a uniform rectangle

    // Surfaces that lean are not accepted: the tilt of a free fit minus what noise explains.
    Plane free;
    double free_rms = 0;
    if (!fit(surface, PlaneKind::kGeneral, &free, &free_rms)) return false;
    const double z = std::min(1.0, std::abs(free.n.z()));
    const double uncertainty = std::max(sigma, free_rms) / (spread * std::sqrt(double(surface.size()) / 4.0));
    const double lean = std::min(std::acos(z), std::asin(z));
    const double limit = options_.max_tilt_deg * kDegree;
    if (kind == PlaneKind::kGeneral) {
      if (lean < limit) return false;
    } else {
      const double tilt = kind == PlaneKind::kHorizontal ? std::acos(z) : std::asin(z);
      if (tilt > limit + 2 * uncertainty) return false;
    }
    if (isCurved(triangles_, surface, result.plane, std::max(rms, 0.5 * sigma))) return false;
    result.centroid = moments.centroid() + camera_;
    for (int i : surface) {
      // The triangles were gathered around the whole peak; keep those on this surface's own plane.
      if (!joins(triangles_[i], result.plane, 1.0)) continue;
      result.triangles.push_back(i);
      taken_[i] = 1;
    }
    found_.push_back(std::move(result));
    return true;
  }

  const std::vector<MapTriangle>& triangles_;
  std::vector<char> taken_;
  Eigen::Vector3d camera_;
  const PlaneDetectionOptions& options_;
  const PlaneGrowthOptions& growth_;
  const AngleGate level_, joins_;
  std::vector<DetectedPlane> found_;
};

}  // namespace

std::vector<DetectedPlane> detectPlanes(const std::vector<MapTriangle>& triangles, const std::vector<char>& taken,
                                        const Eigen::Vector3d& camera_centre, const PlaneDetectionOptions& options,
                                        const PlaneGrowthOptions& growth) {
  return Detector(triangles, taken, camera_centre, options, growth).run();
}

std::vector<DetectedPlane> detectPlanesAt(const std::vector<MapTriangle>& triangles, const std::vector<char>& taken,
                                          PlaneKind kind, const Eigen::Vector3d& camera_centre,
                                          const PlaneDetectionOptions& options, const PlaneGrowthOptions& growth) {
  return Detector(triangles, taken, camera_centre, options, growth).runAt(kind);
}

}  // namespace vip_slam
