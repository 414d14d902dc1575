// Planes of a problem: homographies from landmarks on planes, point-to-plane blocks from depth, priors.
#pragma once

#include <array>
#include <map>
#include <unordered_map>

#include "vip_slam_backend/factors/frame_geometry.h"
#include "vip_slam_backend/optimisation/problem_builder.h"

namespace vip_slam {

class PlaneFactorBuilder {
 public:
  PlaneFactorBuilder(const Map& map, const ProblemScope& scope, const BuilderSettings& settings,
                     const std::unordered_map<KeyframeId, int>& frames, BuiltProblem* built);
  /// Chooses the host of every landmark on a plane: the first keyframe that sees it well. With shared hosts instead, plane
  /// by plane, the keyframe that sees most of the landmarks still without host becomes theirs, and so on: few, well-filled
  /// compressed factors and a sparse system, but a bad track in a host reaches farther.
  void chooseHosts(const std::vector<LandmarkId>& landmarks);
  /// Turns a landmark on a plane into host-observer pairs. False when it is on none, or fails the gate: then it stays a
  /// free point.
  bool addLandmark(const MapLandmark& landmark);
  /// Compresses what was collected and adds the depth blocks.
  void finish();

 private:
  void addDepthBlocks();
  bool onPlane(const MapLandmark& landmark, int* plane) const;

  const Map& map_;
  const ProblemScope& scope_;
  const BuilderSettings& settings_;
  const std::unordered_map<KeyframeId, int>& frames_;
  BuiltProblem* built_;
  std::vector<FrameGeometry> geometry_;
  std::map<PlaneId, int> planes_;
  std::unordered_map<LandmarkId, KeyframeId> hosts_;
  std::map<std::array<int, 3>, BaHomography> homographies_;
  std::vector<BaHomographyPair> pairs_;
};

/// Where the mean ray of a landmark's observations meets its plane.
Eigen::Vector3d intersectWithPlane(const Map& map, const MapLandmark& landmark);

}  // namespace vip_slam
