#include "vip_slam_backend/loop/place_support.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "vip_slam_backend/loop/guided_matching.h"
#include "vip_slam_backend/loop/place_surfaces.h"

namespace vip_slam {
namespace {

constexpr std::size_t kViews = 15, kCoveringViews = 5;
constexpr double kPointSize = 0.05;   // metres
constexpr double kTiltSigma = 0.003;  // radians: tilt of the odometry and of the map against gravity
constexpr double kMinContradiction = 0.005, kUnknownContradiction = 0.05;  // of depth
constexpr double kOccludedWeight = 0.25;
constexpr std::size_t kEstablishedViews = 4;
constexpr int kFewDepths = 100;
constexpr double kDepthSlack = 0.1, kDepthSlackPerMetre = 0.05;

SE3 cameraInOdom(const Keyframe& keyframe) { return keyframe.frame.state.T_W_I * keyframe.frame.T_I_C; }

// Whether a view shows what lies at p_V (its camera's frame): in its image and not behind a nearer surface.
bool shows(const DepthGrid& grid, const Eigen::Vector3d& p_V, const CameraModel& camera) {
  Eigen::Vector2d uv;
  if (p_V.z() < 0.2 || !camera.project(p_V, &uv) || !camera.inImage(uv, 10)) return false;
  if (grid.empty()) return true;
  const int c = static_cast<int>(std::lround((uv.x() - grid.offset) / grid.stride));
  const int r = static_cast<int>(std::lround((uv.y() - grid.offset) / grid.stride));
  if (c < 0 || r < 0 || c >= grid.cols || r >= grid.rows) return false;
  const double z = grid.at(c, r);
  return z <= 0 || z > p_V.z() - kDepthSlack - kDepthSlackPerMetre * p_V.z();
}

// Cell of the image, an eighth of the width by a sixth of the height.
int cellOf(const Feature& feature, const CameraModel& camera) {
  return static_cast<int>(feature.pixel.x() * 8 / camera.width()) * 6 +
         static_cast<int>(feature.pixel.y() * 6 / camera.height());
}

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
  pose_options.tilt_sigma = kTiltSigma;
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
    std::vector<SE3> T_V_C;
    for (std::size_t v = 0; v < std::min(kCoveringViews, views[c].size()); ++v)
      T_V_C.push_back(map.keyframe(views[c][v]).T_W_C().inverse() * T_W_C);
    std::set<int> covered_cells, inlier_cells;
    for (std::size_t f = 0; f < frame.features.size(); ++f) {
      const Feature& feature = frame.features[f];
      if (inlier[c][f]) inlier_cells.insert(cellOf(feature, verifier.camera()));
      if (feature.depth <= 0) continue;
      const Eigen::Vector3d p_C = feature.depth * Eigen::Vector3d(feature.xy.x(), feature.xy.y(), 1.0);
      bool shown = false;
      for (std::size_t v = 0; v < T_V_C.size() && !shown; ++v)
        shown = shows(map.keyframe(views[c][v]).data->frame.depth_grid, T_V_C[v] * p_C, verifier.camera());
      support.covered += shown;
      if (shown) covered_cells.insert(cellOf(feature, verifier.camera()));
    }
    for (const MapPoint& point : points[c]) {
      const MapLandmark* landmark = map.findLandmark(point.landmark);
      if (!landmark || landmark->observations.size() < kEstablishedViews) continue;
      if (!shows(frame.depth_grid, T_W_C.inverse() * point.p_W, verifier.camera())) continue;
      ++support.established;
      support.refound += found.count({static_cast<std::uint32_t>(c), point.landmark}) != 0;
    }
    support.covered_cells += static_cast<int>(covered_cells.size());
    for (const int cell : covered_cells) support.explained_cells += static_cast<int>(inlier_cells.count(cell));
    if (views[c].empty()) continue;
    const MapKeyframe& nearest = map.keyframe(views[c].front());
    const DepthAgreement depth =
        compareDepth(nearest.data->frame.depth_grid, frame.depth_grid, T_V_C.front(), verifier.camera());
    support.depth.compared += depth.compared;
    support.depth.agree += depth.agree;
    support.depth.see_through += depth.see_through;
    support.depth.occluded += depth.occluded;
  }
  return support;
}

}  // namespace vip_slam
