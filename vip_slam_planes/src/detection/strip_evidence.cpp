#include "vip_slam_planes/detection/strip_evidence.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_planes/detection/plane_fit.h"

namespace vip_slam {
namespace {

constexpr double kLeastTurn = 3.0 * kDegree;  // of the line of sight
constexpr double kTurnsAlong = 1.0 / 3.0;     // share of that by which the face may seem to turn
constexpr double kShows = 6.0;                // sigmas by which what turns with the line of sight would be off
constexpr double kOff = 0.02;                 // m, of each one's middle to the other one's plane

MapTriangle moved(const SE3& T, MapTriangle t) {
  for (Eigen::Vector3d& p : t.corner) p = T * p;
  t.centre = T * t.centre;
  t.n = T.rotation() * t.n;
  return t;
}

Eigen::Vector3d level(const Eigen::Vector3d& v) { return Eigen::Vector3d(v.x(), v.y(), 0).normalized(); }

double angleBetweenUnits(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

void StripEvidence::add(KeyframeId id, const SE3& T_map_C, const std::vector<MapTriangle>& triangles,
                        const std::vector<DetectedPlane>& strips) {
  Frame frame{id, {}};
  const SE3 T_C_map = T_map_C.inverse();
  for (const DetectedPlane& found : strips) {
    Strip strip;
    strip.plane_C = transformPlane(T_C_map, found.plane);
    strip.centroid_C = T_C_map * found.centroid;
    strip.index = found.triangles;
    for (int i : found.triangles) {
      strip.triangles.push_back(moved(T_C_map, triangles[i]));
      strip.sigma += triangles[i].sigma / double(found.triangles.size());
    }
    if (!strip.triangles.empty()) frame.strips.push_back(std::move(strip));
  }
  frames_.push_back(std::move(frame));
  while (frames_.size() > keyframes_) frames_.pop_front();
}

void StripEvidence::remove(KeyframeId id) {
  frames_.erase(std::remove_if(frames_.begin(), frames_.end(), [id](const Frame& f) { return f.id == id; }),
                frames_.end());
}

StripEvidence::Placed StripEvidence::place(const Frame& frame, const Strip& strip, const CameraPoses& poses) const {
  const SE3& T_map_C = poses.at(frame.id);
  return {&strip, frame.id, T_map_C.inverse(), transformPlane(T_map_C, strip.plane_C), T_map_C * strip.centroid_C};
}

bool StripEvidence::isOneFace(const Placed& a, const Placed& b) const {
  const Eigen::Vector3d between = b.centroid - a.centroid, along = Eigen::Vector3d::UnitZ().cross(a.plane.n);
  if (std::abs(along.dot(between)) > gap_) return false;
  if (std::abs(a.plane.signedDistance(b.centroid)) > kOff || std::abs(b.plane.signedDistance(a.centroid)) > kOff) {
    return false;
  }
  const Eigen::Vector3d middle = 0.5 * (a.centroid + b.centroid);
  const Eigen::Vector3d from_a = a.T_C_map.inverse().t(), from_b = b.T_C_map.inverse().t();
  const double turn = angleBetweenUnits(level(middle - from_a), level(middle - from_b));
  if (turn < kLeastTurn || angleBetweenUnits(a.plane.n, b.plane.n) > kTurnsAlong * turn) return false;
  // How far apart its ends are shows how far off they would be.
  const Eigen::Vector3d along_C = a.T_C_map.rotation() * along;
  double low = std::numeric_limits<double>::max(), high = -low;
  for (const MapTriangle& t : a.strip->triangles) {
    for (const Eigen::Vector3d& p : t.corner) {
      low = std::min(low, along_C.dot(p));
      high = std::max(high, along_C.dot(p));
    }
  }
  return 0.5 * (high - low) * turn > kShows * std::max(a.strip->sigma, b.strip->sigma);
}

std::vector<JointPlane> StripEvidence::detect(const CameraPoses& poses) {
  std::vector<JointPlane> found;
  if (frames_.size() < 2 || !poses.count(frames_.back().id)) return found;
  std::vector<Strip>& newest = frames_.back().strips;
  for (std::size_t k = 0; k < newest.size();) {
    const Placed mine = place(frames_.back(), newest[k], poses);
    JointPlane face;
    for (std::size_t f = 0; f + 1 < frames_.size(); ++f) {
      if (!poses.count(frames_[f].id)) continue;
      std::vector<Strip>& earlier = frames_[f].strips;
      for (std::size_t j = 0; j < earlier.size();) {
        const Placed other = place(frames_[f], earlier[j], poses);
        if (!isOneFace(mine, other)) {
          ++j;
          continue;
        }
        take(other, &face);
        earlier.erase(earlier.begin() + static_cast<std::ptrdiff_t>(j));
      }
    }
    if (face.triangles.empty()) {
      ++k;
      continue;
    }
    take(mine, &face);
    newest.erase(newest.begin() + static_cast<std::ptrdiff_t>(k));
    if (fit(mine, &face)) found.push_back(std::move(face));
  }
  return found;
}

void StripEvidence::take(const Placed& placed, JointPlane* face) const {
  const SE3 T_map_C = placed.T_C_map.inverse();
  for (std::size_t i = 0; i < placed.strip->triangles.size(); ++i) {
    face->triangles.push_back({moved(T_map_C, placed.strip->triangles[i]), placed.keyframe, placed.strip->index[i]});
  }
}

bool StripEvidence::fit(const Placed& mine, JointPlane* face) const {
  PlaneMoments moments;  // about the strip: far from the origin of `map` the scatter would drown
  for (const EvidenceTriangle& e : face->triangles) {
    const double sigma = e.triangle.sigma + 0.005;
    moments.add(e.triangle.centre - mine.centroid, e.triangle.area / (sigma * sigma));
  }
  Plane local;
  face->kind = PlaneKind::kVertical;
  if (!fitPlane(moments, face->kind, mine.plane.n, &local)) return false;
  face->centroid = moments.centroid() + mine.centroid;
  face->plane = Plane::fromPointNormal(face->centroid, local.n);
  return true;
}

}  // namespace vip_slam
