// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/detection/plane_evidence.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "evidence_layers.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/util/significance.h"
#include "vip_slam_planes/detection/plane_histogram.h"
#include "vip_slam_planes/detection/surface_shape.h"
#include "vip_slam_planes/growth/triangle_association.h"

namespace vip_slam {
namespace {

constexpr double kPatchReach = 0.4;  // metres from the patch's first triangle
constexpr double kPatchAngle = 15.0 * kDegree, kWidestPatchAngle = 45.0 * kDegree;
constexpr std::size_t kMinTriangles = 4;
// Least area, relative to that for a plane in one image. Small upright surfaces are mostly furniture. Dark or polished
// table tops have depth in pieces only: such planes start small and narrow, and are grown by tracked frames.
constexpr double kMinUpright = 2.0, kMinLevel = 0.3;
// Share of the area of a wall's peak that must be new since its last test. Horizontal peaks are tested every time,
// since the visible pieces of a dark table top change.
constexpr double kFreshShare = 0.25;

// Whether enough keyframes show a part of the plane, and two of them more than a strip: the mesh across a step is a
// strip in every image.
bool shownBySeveral(const std::vector<EvidenceTriangle>& evidence, const std::vector<MapTriangle>& triangles,
                    const DetectedPlane& plane, int min_keyframes) {
  std::map<KeyframeId, std::vector<int>> parts;
  for (int i : plane.triangles) parts[evidence[i].keyframe].push_back(i);
  if (int(parts.size()) < min_keyframes) return false;
  if (plane.kind == PlaneKind::kHorizontal) return true;
  return std::count_if(parts.begin(), parts.end(), [&](auto& part) {
           std::sort(part.second.begin(), part.second.end());
           return isSolid(triangles, part.second);
         }) >= 2;
}

// Whether the plane lies on a known floor or table, or is one itself: no further below it than `step`, and hardly
// higher than the distance at which it would join it.
bool liesOn(const DetectedPlane& plane, const std::vector<const PlaneTrack*>& known, double step,
            const PlaneGrowthOptions& growth) {
  return std::any_of(known.begin(), known.end(), [&](const PlaneTrack* track) {
    if (track->kind() != plane.kind || track->plane().n.dot(plane.plane.n) < 0) return false;
    const double height = track->plane().signedDistance(plane.centroid);
    if (height < -step || height > 2 * growth.distance) return false;
    const int reach = static_cast<int>(std::ceil(growth.gap / track->cellSize()));
    return track->cells().near(track->cellAt(track->toPlane(plane.centroid)), reach);
  });
}

}  // namespace

void PlaneEvidence::add(KeyframeId id, const SE3& T_map_C, const std::vector<MapTriangle>& triangles,
                        const std::vector<int>& label, const std::vector<PlaneId>& beside) {
  Frame frame{id, {}};
  const SE3 T_C_map = T_map_C.inverse();
  const double level = std::cos(detection_.gravity_deg * kDegree), upright = std::sin(detection_.gravity_deg * kDegree);
  std::vector<int> place(triangles.size(), -1);                        // in its patch; -1: open
  std::vector<std::size_t> first(triangles.size(), triangles.size());  // triangle of its patch
  std::vector<int> members;
  for (std::size_t seed = 0; seed < triangles.size(); ++seed) {
    if (label[seed] >= 0 || place[seed] >= 0) continue;
    members.assign(1, static_cast<int>(seed));
    place[seed] = 0;
    first[seed] = seed;
    Eigen::Vector3d normals = triangles[seed].area * triangles[seed].n;
    Eigen::Vector3d centres = triangles[seed].area * triangles[seed].centre;
    double area = triangles[seed].area;
    for (std::size_t k = 0; k < members.size(); ++k) {
      for (int g : triangles[members[k]].neighbour) {
        if (g < 0 || label[g] >= 0 || place[g] >= 0) continue;
        const MapTriangle& t = triangles[g];
        if ((t.centre - triangles[seed].centre).norm() > kPatchReach) continue;
        const Eigen::Vector3d n = normals.normalized();
        if (n.dot(t.n) < std::cos(std::clamp(2.0 * t.sigma_angle, kPatchAngle, kWidestPatchAngle))) continue;
        if (std::abs(n.dot(t.centre - centres / area)) > distanceGate(t, growth_.distance)) continue;
        place[g] = static_cast<int>(members.size());
        first[g] = seed;
        members.push_back(g);
        normals += t.area * t.n;
        centres += t.area * t.centre;
        area += t.area;
      }
    }
    const Eigen::Vector3d n = normals.normalized();
    const double z = std::abs(n.z());
    if (members.size() < kMinTriangles || area < growth_.cell * growth_.cell || (z < level && z > upright)) continue;
    Patch patch;
    patch.kind = z >= level ? PlaneKind::kHorizontal : PlaneKind::kVertical;
    patch.n_C = T_C_map.rotation() * n;
    patch.centre_C = T_C_map * (centres / area);
    patch.area = area;
    patch.index = members;
    for (int i : members) {
      patch.beside.push_back(beside[i]);
      patch.triangles.push_back(moved(T_C_map, triangles[i]));
      for (int& g : patch.triangles.back().neighbour) g = g >= 0 && first[g] == seed ? place[g] : -1;
    }
    frame.patches.push_back(std::move(patch));
  }
  frames_.push_back(std::move(frame));
  while (frames_.size() > std::size_t(detection_.keyframes)) frames_.pop_front();
}

void PlaneEvidence::remove(KeyframeId id) {
  frames_.erase(std::remove_if(frames_.begin(), frames_.end(), [id](const Frame& f) { return f.id == id; }),
                frames_.end());
}

void PlaneEvidence::forgetTests() {
  for (Frame& frame : frames_) {
    for (Patch& patch : frame.patches) patch.tested = false;
  }
}

std::vector<EvidenceTriangle> PlaneEvidence::collect(const std::vector<Vote>& votes, const CameraPoses& poses) const {
  std::vector<EvidenceTriangle> all;
  int vertices = 0;
  for (const Vote& v : votes) {
    const Patch& patch = frames_[v.frame].patches[v.patch];
    const SE3& T_map_C = poses.at(frames_[v.frame].id);
    const int first = static_cast<int>(all.size());
    int next = vertices;
    for (std::size_t i = 0; i < patch.triangles.size(); ++i) {
      MapTriangle t = moved(T_map_C, patch.triangles[i]);
      for (int& g : t.neighbour) g = g < 0 ? -1 : g + first;
      for (int& k : t.vertex) k += vertices, next = std::max(next, k + 1);
      all.push_back({t, frames_[v.frame].id, patch.index[i], patch.beside[i]});
    }
    vertices = next;
  }
  return all;
}

std::vector<PlaneEvidence::Vote> PlaneEvidence::patchesNear(const PlaneTrack& plane, const CameraPoses& poses,
                                                            std::size_t frame) const {
  std::vector<Vote> near;
  const auto pose = poses.find(frames_[frame].id);
  if (pose == poses.end()) return near;
  for (std::size_t k = 0; k < frames_[frame].patches.size(); ++k) {
    const Patch& patch = frames_[frame].patches[k];
    const double off = std::abs(plane.plane().signedDistance(pose->second * patch.centre_C));
    if (patch.kind == plane.kind() && patch.area > 0 && off < 2 * growth_.distance) near.push_back({frame, k});
  }
  return near;
}

std::vector<std::pair<const PlaneTrack*, EvidenceTriangle>> PlaneEvidence::takeJoining(
    const CameraPoses& poses, const std::vector<const PlaneTrack*>& known) {
  std::vector<std::pair<const PlaneTrack*, EvidenceTriangle>> joining;
  for (std::size_t f = 0; f < frames_.size(); ++f) {
    std::set<std::size_t> near;
    for (const PlaneTrack* plane : known) {
      for (const Vote& v : patchesNear(*plane, poses, f)) near.insert(v.patch);
    }
    if (near.empty()) continue;
    std::vector<Vote> votes;
    for (std::size_t k : near) votes.push_back({f, k});
    const std::vector<EvidenceTriangle> evidence = collect(votes, poses);
    const std::vector<int> label = associateTriangles(trianglesOf(evidence), known, growth_);
    std::vector<char> joins = belongsTo(known, evidence, label);
    for (std::size_t i = 0; i < evidence.size(); ++i) {
      const MapTriangle& t = evidence[i].triangle;
      // Further off they may be another layer that no keyframe has shown apart yet.
      joins[i] = joins[i] && std::abs(known[label[i]]->plane().signedDistance(t.centre)) <
                                 std::max(detection_.max_rms, kNoiseSigmas * t.sigma);
      if (joins[i]) joining.emplace_back(known[label[i]], evidence[i]);
    }
    forget(votes, evidence, joins);
  }
  return joining;
}

int PlaneEvidence::seenBy(const PlaneTrack& plane, const CameraPoses& poses, double area) const {
  int count = 0;
  for (std::size_t f = 0; f < frames_.size(); ++f) {
    const std::vector<MapTriangle> triangles = trianglesOf(collect(patchesNear(plane, poses, f), poses));
    const std::vector<int> label = associateTriangles(triangles, {&plane}, growth_);
    double sum = 0;
    for (std::size_t i = 0; i < triangles.size(); ++i) sum += label[i] >= 0 ? triangles[i].area : 0.0;
    count += sum >= area;
  }
  return count;
}

void PlaneEvidence::forget(const std::vector<Vote>& votes, const std::vector<EvidenceTriangle>& all,
                           const std::vector<char>& used) {
  std::size_t first = 0;
  for (const Vote& v : votes) {
    Patch& patch = frames_[v.frame].patches[v.patch];
    std::size_t count = 0;
    const std::size_t size = patch.triangles.size();
    for (std::size_t i = first; i < std::min(first + size, all.size()); ++i) count += used[i] != 0;
    first += size;
    if (2 * count > size) patch.area = 0;
  }
}

std::vector<JointPlane> PlaneEvidence::detect(const CameraPoses& poses, const std::vector<const PlaneTrack*>& known) {
  std::vector<JointPlane> found;
  if (frames_.size() < 2 || !poses.count(frames_.back().id)) return found;
  const Eigen::Vector3d origin = poses.at(frames_.back().id).t();
  PlaneHistogram histogram(detection_.height_bin, detection_.distance_bin, detection_.angle_bin_deg);
  std::vector<Vote> all;
  for (std::size_t f = 0; f < frames_.size(); ++f) {
    const auto pose = poses.find(frames_[f].id);
    if (pose == poses.end()) continue;
    for (std::size_t k = 0; k < frames_[f].patches.size(); ++k) {
      const Patch& patch = frames_[f].patches[k];
      if (!(patch.area > 0)) continue;
      const Eigen::Vector3d n = pose->second.rotation() * patch.n_C, p = pose->second * patch.centre_C - origin;
      if (patch.kind == PlaneKind::kHorizontal) {
        histogram.addHorizontal(n, p, patch.area, static_cast<int>(all.size()));
      } else {
        histogram.addVertical(n, p, patch.area, static_cast<int>(all.size()));
      }
      all.push_back({f, k});
    }
  }
  while (true) {
    const PlaneHistogram::Peak peak = histogram.peak();
    if (peak.area < kMinLevel * detection_.min_area) break;
    std::vector<Vote> votes;
    std::set<std::size_t> frames;
    for (int i : peak.members) {
      votes.push_back(all[i]);
      frames.insert(all[i].frame);
      histogram.remove(i);
    }
    if (int(frames.size()) < detection_.min_keyframes || *frames.rbegin() + 1 != frames_.size()) continue;
    const PlaneKind kind = frames_[votes.front().frame].patches[votes.front().patch].kind;
    PlaneDetectionOptions together = detection_;
    together.min_area *= kind == PlaneKind::kHorizontal ? kMinLevel : kMinUpright;
    if (kind == PlaneKind::kHorizontal) together.min_width *= std::sqrt(kMinLevel);
    if (peak.area < together.min_area) continue;
    double fresh = 0;
    for (const Vote& v : votes) {
      const Patch& patch = frames_[v.frame].patches[v.patch];
      if (!patch.tested) fresh += patch.area;
    }
    if (kind == PlaneKind::kVertical && fresh < kFreshShare * peak.area) continue;
    for (const Vote& v : votes) frames_[v.frame].patches[v.patch].tested = true;
    const std::vector<EvidenceTriangle> evidence = collect(votes, poses);
    const std::vector<MapTriangle> triangles = trianglesOf(evidence);
    const std::vector<int> label = associateTriangles(triangles, known, growth_);
    std::vector<char> taken = belongsTo(known, evidence, label);
    for (const DetectedPlane& plane : detectPlanesAt(triangles, taken, kind, origin, together, growth_)) {
      // The keyframes see overlapping parts of the surface: use the area that they cover together.
      PlaneTrack area(0, kind, plane.plane, plane.centroid, 0.5 * growth_.cell);
      for (int i : plane.triangles) area.cover(triangles[i], 1, SE3(), nullptr);
      const bool small = area.area() < kMinUpright * detection_.min_area;
      if (area.area() < together.min_area || (small && liesOn(plane, known, detection_.max_rms, growth_)) ||
          !shownBySeveral(evidence, triangles, plane, detection_.min_keyframes)) {
        continue;
      }
      JointPlane joint{kind, plane.plane, plane.centroid, {}};
      for (int i : plane.triangles) {
        joint.triangles.push_back(evidence[i]);
        taken[i] = 1;
      }
      found.push_back(std::move(joint));
    }
    forget(votes, evidence, taken);
  }
  return found;
}

}  // namespace vip_slam
