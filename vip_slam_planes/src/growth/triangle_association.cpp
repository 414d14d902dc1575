// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/growth/triangle_association.h"

#include <cmath>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/util/significance.h"

namespace vip_slam {
namespace {

constexpr double kWidestAngle = 25.0 * kDegree;
constexpr int kNone = -1;

/// A triangle whose noise does not allow a decision between two planes.
struct Doubt {
  int track[2] = {kNone, kNone};  ///< in ascending order; none: no doubt
  double squares[2] = {0, 0};     ///< squared distance to each, in sigmas
};

// From afar half of a wall's triangles are nearer to a plane that runs a few centimetres in front of it, a door or one
// tilted by noise, and would keep growing and tilting it. So each connected patch of doubtful triangles decides
// jointly.
void settleDoubts(const std::vector<MapTriangle>& triangles, const std::vector<Doubt>& doubts,
                  std::vector<int>* label) {
  std::vector<char> visited(triangles.size(), 0);
  std::vector<int> patch;
  for (std::size_t seed = 0; seed < triangles.size(); ++seed) {
    if (doubts[seed].track[0] == kNone || visited[seed]) continue;
    const Doubt& first = doubts[seed];
    double sum[2] = {0, 0};
    patch.assign(1, static_cast<int>(seed));
    visited[seed] = 1;
    for (std::size_t i = 0; i < patch.size(); ++i) {
      // Capped, so that outliers do not decide.
      for (int k = 0; k < 2; ++k) sum[k] += std::min(doubts[patch[i]].squares[k], kNoiseSigmas * kNoiseSigmas);
      for (int g : triangles[patch[i]].neighbour) {
        if (g < 0 || visited[g] || doubts[g].track[0] != first.track[0] || doubts[g].track[1] != first.track[1]) {
          continue;
        }
        visited[g] = 1;
        patch.push_back(g);
      }
    }
    for (int i : patch) (*label)[i] = first.track[sum[1] < sum[0]];
  }
}

// Labels each open triangle with its nearest admissible plane, except the one that refused it.
void nearestPlanes(const std::vector<MapTriangle>& triangles, const std::vector<const PlaneTrack*>& tracks,
                   const std::vector<int>& refused, const PlaneGrowthOptions& options, std::vector<int>* label) {
  const AngleGate gate(options.angle_deg);
  std::vector<Doubt> doubts(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if ((*label)[i] != kNone) continue;
    const MapTriangle& t = triangles[i];
    const double min_cos = gate.cosine(t), reach = distanceGate(t, options.distance);
    double best = reach, next_best = reach;
    int second = kNone;
    for (std::size_t k = 0; k < tracks.size(); ++k) {
      if (refused[i] == static_cast<int>(k)) continue;
      const Plane& plane = tracks[k]->plane();
      const double distance = std::abs(plane.signedDistance(t.centre));
      if (distance >= next_best || plane.n.dot(t.n) <= min_cos) continue;
      if (distance < best) {
        next_best = best, second = (*label)[i];
        best = distance, (*label)[i] = static_cast<int>(k);
      } else {
        next_best = distance, second = static_cast<int>(k);
      }
    }
    if (second == kNone || next_best - best >= kNoiseSigmas * t.sigma) continue;
    const bool ascending = (*label)[i] < second;
    doubts[i].track[!ascending] = (*label)[i], doubts[i].squares[!ascending] = std::pow(best / t.sigma, 2);
    doubts[i].track[ascending] = second, doubts[i].squares[ascending] = std::pow(next_best / t.sigma, 2);
  }
  settleDoubts(triangles, doubts, label);
}

// Removes the label from connected patches that are not near the covered area of their plane, and records the plane in
// `refused`. Returns true when there was any.
bool dropDetached(const std::vector<MapTriangle>& triangles, const std::vector<const PlaneTrack*>& tracks,
                  const std::vector<char>& settled, double gap, std::vector<int>* label, std::vector<int>* refused) {
  std::vector<char> visited(triangles.size(), 0);
  std::vector<int> patch;
  bool any = false;
  for (std::size_t seed = 0; seed < triangles.size(); ++seed) {
    const int k = (*label)[seed];
    if (k == kNone || visited[seed] || settled[seed]) continue;
    const PlaneTrack& track = *tracks[k];
    const int reach = static_cast<int>(std::ceil(gap / track.cellSize()));
    bool touches = false;
    patch.assign(1, static_cast<int>(seed));
    visited[seed] = 1;
    for (std::size_t i = 0; i < patch.size(); ++i) {
      const MapTriangle& t = triangles[patch[i]];
      touches = touches || track.cells().near(track.cellAt(track.toPlane(t.centre)), reach);
      for (int g : t.neighbour) {
        if (g < 0 || visited[g] || (*label)[g] != k) continue;
        visited[g] = 1;
        patch.push_back(g);
      }
    }
    if (touches) continue;
    any = true;
    for (int i : patch) (*refused)[i] = (*label)[i], (*label)[i] = kNone;
  }
  return any;
}

}  // namespace

AngleGate::AngleGate(double angle_deg)
    : narrow_(angle_deg * kDegree),
      wide_(std::max(kWidestAngle, narrow_)),
      cos_narrow_(std::cos(narrow_)),
      cos_wide_(std::cos(wide_)) {}

double distanceGate(const MapTriangle& triangle, double distance) {
  return std::clamp(kNoiseSigmas * triangle.sigma, distance, 2.0 * distance);
}

std::vector<int> associateTriangles(const std::vector<MapTriangle>& triangles,
                                    const std::vector<const PlaneTrack*>& tracks, const PlaneGrowthOptions& options) {
  std::vector<int> label(triangles.size(), kNone);
  std::vector<int> refused(triangles.size(), kNone);
  std::vector<char> settled(triangles.size(), 0);
  nearestPlanes(triangles, tracks, refused, options, &label);
  if (!dropDetached(triangles, tracks, settled, options.gap, &label, &refused)) return label;
  // A plane whose covered area is far away may have been slightly nearer than the right one: try again without it.
  for (std::size_t i = 0; i < triangles.size(); ++i) settled[i] = label[i] != kNone;
  nearestPlanes(triangles, tracks, refused, options, &label);
  dropDetached(triangles, tracks, settled, options.gap, &label, &refused);
  return label;
}

}  // namespace vip_slam
