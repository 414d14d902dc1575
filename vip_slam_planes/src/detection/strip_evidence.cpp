// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/detection/strip_evidence.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_planes/detection/plane_fit.h"
#include "vip_slam_planes/growth/triangle_association.h"

namespace vip_slam {
namespace {

constexpr double kMinTurn = 3.0 * kDegree;  // change of the line of sight between the two views
constexpr double kTurnsAlong = 1.0 / 3.0;   // share of that by which the two normals may differ
constexpr double kShows = 6.0;              // sigmas that a strip turning with the line of sight must deviate by
constexpr double kOff = 0.02;               // m, largest distance of each centroid from the other plane
constexpr double kUpright = 0.5;            // sine of the angle to the vertical; normals of narrow things are noisy
constexpr double kMinRemains = 0.03;        // m^2
constexpr std::size_t kMinInStrip = 6;
constexpr double kBeside = 0.15;  // m
// Angles to a neighbouring surface between which it counts as a round body; beyond, it is another face at a corner.
constexpr double kBends = 10.0 * kDegree, kTurnsOff = 60.0 * kDegree;
constexpr double kBendingShare = 0.25;  // of the strip's area

Eigen::Vector3d level(const Eigen::Vector3d& v) { return Eigen::Vector3d(v.x(), v.y(), 0).normalized(); }

/// Bounds along the face and upwards, in the plane's frame.
Eigen::AlignedBox2d boundsOf(const std::vector<MapTriangle>& triangles, const Eigen::Vector3d& along,
                             const Eigen::Vector3d& up) {
  Eigen::AlignedBox2d bounds;
  for (const MapTriangle& t : triangles) {
    for (const Eigen::Vector3d& p : t.corner) bounds.extend(Eigen::Vector2d(along.dot(p), up.dot(p)));
  }
  return bounds;
}

/// Whether surfaces next to the triangles are turned a little against them, as on a round body, but less than another
/// face is. All in the camera frame.
bool bendsOn(const std::vector<MapTriangle>& triangles, const Plane& plane, const Eigen::Vector3d& up,
             const std::vector<MapTriangle>& all) {
  const Eigen::Vector3d along = up.cross(plane.n).normalized();
  Eigen::AlignedBox2d around = boundsOf(triangles, along, up);
  around.min().x() -= kBeside, around.max().x() += kBeside;
  double own = 0, bent = 0;
  for (const MapTriangle& t : triangles) own += t.area;
  for (const MapTriangle& t : all) {
    if (std::abs(plane.signedDistance(t.centre)) > kBeside) continue;
    if (!around.contains(Eigen::Vector2d(along.dot(t.centre), up.dot(t.centre)))) continue;
    const double angle = std::acos(std::clamp(plane.n.dot(t.n), -1.0, 1.0));
    if (angle > std::max(kBends, 2.0 * t.sigma_angle) && angle < kTurnsOff) bent += t.area;
  }
  return bent > kBendingShare * own;
}

double angleBetweenUnits(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

void StripEvidence::add(KeyframeId id, const SE3& T_map_C, const std::vector<MapTriangle>& triangles,
                        const std::vector<int>& label, const std::vector<DetectedPlane>& strips) {
  Frame frame{id, {}, {}, {}};
  const SE3 T_C_map = T_map_C.inverse();
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (label[i] >= 0 || std::abs(triangles[i].n.z()) > kUpright) continue;
    frame.upright.push_back(moved(T_C_map, triangles[i]));
    frame.index.push_back(static_cast<int>(i));
  }
  for (const DetectedPlane& found : strips) {
    Strip strip;
    strip.plane_C = transformPlane(T_C_map, found.plane);
    strip.centroid_C = T_C_map * found.centroid;
    strip.index = found.triangles;
    for (int i : found.triangles) {
      strip.triangles.push_back(moved(T_C_map, triangles[i]));
      strip.sigma += triangles[i].sigma / double(found.triangles.size());
    }
    if (strip.triangles.empty()) continue;
    strip.bends_on = bendsOn(strip.triangles, strip.plane_C, T_C_map.R().col(2), frame.upright);
    frame.strips.push_back(std::move(strip));
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
  if (std::abs(along.dot(between)) > growth_.gap) return false;
  if (std::abs(a.plane.signedDistance(b.centroid)) > kOff || std::abs(b.plane.signedDistance(a.centroid)) > kOff) {
    return false;
  }
  const Eigen::Vector3d middle = 0.5 * (a.centroid + b.centroid);
  const Eigen::Vector3d from_a = a.T_C_map.inverse().t(), from_b = b.T_C_map.inverse().t();
  const double turn = angleBetweenUnits(level(middle - from_a), level(middle - from_b));
  if (turn < kMinTurn || angleBetweenUnits(a.plane.n, b.plane.n) > kTurnsAlong * turn) return false;
  // The ends of a strip that turned with the line of sight would deviate by half its width times the turn.
  const Eigen::Matrix3d R = a.T_C_map.R();
  const double width = boundsOf(a.strip->triangles, R * along, R.col(2)).sizes().x();
  return 0.5 * width * turn > kShows * std::max(a.strip->sigma, b.strip->sigma);
}

bool StripEvidence::remainsOf(const Placed& strip, const Frame& frame, const CameraPoses& poses, Strip* remains) const {
  const SE3 &T_map_C = poses.at(frame.id), T_C_map = T_map_C.inverse();
  const Plane plane = transformPlane(T_C_map, strip.plane);
  const Eigen::Vector3d up = T_C_map.R().col(2), along = up.cross(plane.n).normalized();
  const Eigen::Vector3d middle = T_C_map * strip.centroid;
  const AngleGate gate(growth_.angle_deg);
  *remains = Strip();
  PlaneMoments moments;
  double area = 0;
  for (std::size_t i = 0; i < frame.upright.size(); ++i) {
    const MapTriangle& t = frame.upright[i];
    if (plane.n.dot(t.n) < gate.cosine(t) || std::abs(along.dot(t.centre - middle)) > growth_.gap) continue;
    if (std::abs(plane.signedDistance(t.centre)) > distanceGate(t, growth_.distance)) continue;
    for (const Eigen::Vector3d& p : t.corner) moments.add(T_map_C * p - strip.centroid, t.area);
    area += t.area;
    remains->sigma += t.sigma;
    remains->triangles.push_back(t);
    remains->index.push_back(frame.index[i]);
  }
  Plane fitted;
  if (remains->triangles.size() < kMinInStrip || area < kMinRemains) return false;
  if (!fitPlane(moments, PlaneKind::kVertical, strip.plane.n, &fitted)) return false;
  remains->sigma /= double(remains->triangles.size());
  const Eigen::Vector3d centroid = moments.centroid() + strip.centroid;
  remains->centroid_C = T_C_map * centroid;
  remains->plane_C = transformPlane(T_C_map, Plane::fromPointNormal(centroid, fitted.n));
  return !bendsOn(remains->triangles, remains->plane_C, up, frame.upright);
}

std::vector<JointPlane> StripEvidence::detect(const CameraPoses& poses) {
  if (frames_.size() < 2 || !poses.count(frames_.back().id)) return {};
  std::vector<JointPlane> found = pairsOfStrips(poses);
  for (JointPlane& face : stripsWithRemains(poses)) found.push_back(std::move(face));
  return found;
}

std::vector<JointPlane> StripEvidence::stripsWithRemains(const CameraPoses& poses) {
  std::vector<JointPlane> found;
  const std::size_t newest = frames_.size() - 1;
  for (std::size_t f = 0; f <= newest; ++f) {
    if (!poses.count(frames_[f].id)) continue;
    std::vector<Strip>& strips = frames_[f].strips;
    for (std::size_t k = 0; k < strips.size();) {
      const Placed strip = place(frames_[f], strips[k], poses);
      JointPlane face;
      // Strips of older keyframes were already tested against the other keyframes; only the newest is left.
      for (std::size_t g = f == newest ? 0 : newest; g <= newest && !strips[k].bends_on; ++g) {
        Strip remains;
        if (g == f || !poses.count(frames_[g].id) || !remainsOf(strip, frames_[g], poses, &remains)) continue;
        const Placed other = place(frames_[g], remains, poses);
        if (isOneFace(strip, other) && isOneFace(other, strip)) take(other, &face);
      }
      if (face.triangles.empty()) {
        ++k;
        continue;
      }
      take(strip, &face);
      if (fit(strip, &face)) found.push_back(std::move(face));
      strips.erase(strips.begin() + static_cast<std::ptrdiff_t>(k));
    }
  }
  return found;
}

std::vector<JointPlane> StripEvidence::pairsOfStrips(const CameraPoses& poses) {
  std::vector<JointPlane> found;
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
    face->triangles.push_back({moved(T_map_C, placed.strip->triangles[i]), placed.keyframe, placed.strip->index[i], 0});
  }
}

bool StripEvidence::fit(const Placed& mine, JointPlane* face) const {
  PlaneMoments moments;  // relative to the strip: far from the origin of `map` the scatter would lose precision
  for (const EvidenceTriangle& e : face->triangles) {
    moments.add(e.triangle.centre - mine.centroid, fitWeight(e.triangle));
  }
  Plane local;
  face->kind = PlaneKind::kVertical;
  if (!fitPlane(moments, face->kind, mine.plane.n, &local)) return false;
  face->centroid = moments.centroid() + mine.centroid;
  face->plane = Plane::fromPointNormal(face->centroid, local.n);
  return true;
}

}  // namespace vip_slam
