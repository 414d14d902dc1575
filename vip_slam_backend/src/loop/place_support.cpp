// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/loop/place_support.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "vip_slam_backend/loop/guided_matching.h"
#include "vip_slam_backend/loop/place_coverage.h"
#include "vip_slam_backend/loop/place_surfaces.h"
#include "vip_slam_backend/map/views.h"

namespace vip_slam {
namespace {

constexpr std::size_t kViews = 15;
constexpr double kPointSize = 0.05;                                        // metres
constexpr double kMinContradiction = 0.005, kUnknownContradiction = 0.05;  // of depth
constexpr double kOccludedWeight = 0.25;
constexpr std::size_t kEstablishedViews = 4;
constexpr int kFewDepths = 100;

SE3 cameraInOdom(const Keyframe& keyframe) { return keyframe.frame.state.T_W_I * keyframe.frame.T_I_C; }

}  // namespace

double PlaceSupport::evidence() const {
  // A surface that the other camera sees through contradicts the pose; one behind another surface is often just
  // occluded.
  double contradiction = kUnknownContradiction;
  if (depth.compared >= kFewDepths)
    contradiction = kMinContradiction + depth.seeThrough() + kOccludedWeight * depth.occluded / depth.compared;
  // Even at the right place corners are missed, and with few landmarks the share is uncertain: regularise it.
  const double there = (refound + 2.0) / (established + 10.0);
  return points * explainedCells() * there / contradiction;
}

CameraRig rigOf(const std::vector<KeyframePtr>& keyframes) {
  const SE3 T_B_odom = cameraInOdom(*keyframes.back()).inverse();
  CameraRig rig;
  for (const KeyframePtr& keyframe : keyframes) rig.push_back(T_B_odom * cameraInOdom(*keyframe));
  return rig;
}

PlaceSupport placeSupport(const Map& map, const std::vector<KeyframePtr>& keyframes, const SE3& T_W_odom,
                          const PlaceVerifier& verifier, const std::function<bool(KeyframeId)>& allowed) {
  const CameraRig rig = rigOf(keyframes);
  const SE3 T_odom_B = cameraInOdom(*keyframes.back());
  PlacePoseOptions pose_options = verifier.poseOptions();
  pose_options.depth_shared = sharedByTwo(keyframes.back()->depth_noise);
  const PlaceVerificationOptions& options = verifier.options();
  PlaceSupport support;
  support.T_W_C = T_W_odom * T_odom_B;

  std::vector<std::vector<KeyframeId>> views;
  std::vector<std::vector<MapPoint>> points;
  for (const SE3& T_B_C : rig) {
    views.push_back(viewsAlong(map, support.T_W_C * T_B_C, kViews, allowed));
    points.push_back(mapPointsOf(map, views.back()));
  }
  if (!views.back().empty()) support.match = views.back().front();

  std::vector<PlaceMatch> matches;
  std::vector<std::pair<std::uint32_t, LandmarkId>> source;
  std::vector<PlaceSurface> surfaces;
  PlacePose pose;
  for (const double factor : {1.0, 0.5}) {
    matches.clear();
    source.clear();
    surfaces.clear();
    for (std::uint32_t c = 0; c < rig.size(); ++c) {
      const GuidedMatches guided =
          matchGuided(map, keyframes[c]->frame.features, support.T_W_C * rig[c], factor * options.guided_radius,
                      points[c], verifier.camera(), options.max_hamming, GuidedLooks::kWide);
      for (PlaceMatch m : guided.matches) {
        m.camera = c;
        matches.push_back(m);
      }
      source.insert(source.end(), guided.source.begin(), guided.source.end());
      if (views[c].empty()) continue;
      const std::vector<PlaceSurface> seen = matchSurfaces(map, views[c].front(), keyframes[c]->frame.depth_grid,
                                                           support.T_W_C * rig[c], verifier.camera(), c);
      surfaces.insert(surfaces.end(), seen.begin(), seen.end());
    }
    pose = refinePlacePose(matches, rig, support.T_W_C, T_odom_B.rotation(), pose_options, surfaces);
    if (!pose.found) return support;
    support.T_W_C = pose.T_W_B;
  }
  support.found = true;
  support.information = pose.information;
  support.matches = static_cast<int>(pose.inliers.size());

  std::set<std::array<int, 3>> distinct;
  std::vector<std::vector<bool>> inlier;
  for (const KeyframePtr& keyframe : keyframes) inlier.emplace_back(keyframe->frame.features.size(), false);
  for (const std::uint32_t k : pose.inliers) {
    const Eigen::Vector3d cell = matches[k].p_W / kPointSize;
    distinct.insert({static_cast<int>(std::floor(cell.x())), static_cast<int>(std::floor(cell.y())),
                     static_cast<int>(std::floor(cell.z()))});
    inlier[matches[k].camera][source[k].first] = true;
    if (matches[k].camera + 1 == rig.size() && source[k].second != kNoLandmark) support.landmarks.push_back(source[k]);
  }
  support.points = static_cast<int>(distinct.size());

  std::set<std::pair<std::uint32_t, LandmarkId>> found;
  for (const std::uint32_t k : pose.inliers) found.emplace(matches[k].camera, source[k].second);
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const SE3 T_W_C = support.T_W_C * rig[c];
    const TrackedFrame& frame = keyframes[c]->frame;
    const PlaceCoverage coverage = placeCoverage(map, frame.features, inlier[c], T_W_C, views[c], verifier.camera());
    support.covered += coverage.features;
    support.covered_cells += coverage.cells;
    support.explained_cells += coverage.explained_cells;
    for (const MapPoint& point : points[c]) {
      const MapLandmark* landmark = map.findLandmark(point.landmark);
      if (!landmark || landmark->observations.size() < kEstablishedViews) continue;
      if (!shows(frame.depth_grid, T_W_C.inverse() * point.p_W, verifier.camera())) continue;
      ++support.established;
      support.refound += found.count({static_cast<std::uint32_t>(c), point.landmark}) != 0;
    }
    if (views[c].empty()) continue;
    const MapKeyframe& nearest = map.keyframe(views[c].front());
    const DepthAgreement depth = compareDepth(nearest.data->frame.depth_grid, frame.depth_grid,
                                              nearest.T_W_C().inverse() * T_W_C, verifier.camera());
    support.depth.compared += depth.compared;
    support.depth.agree += depth.agree;
    support.depth.see_through += depth.see_through;
    support.depth.occluded += depth.occluded;
  }
  return support;
}

}  // namespace vip_slam
