// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/loop/place_verifier.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "vip_slam_backend/loop/guided_matching.h"
#include "vip_slam_backend/loop/place_matching.h"
#include "vip_slam_backend/loop/scene_agreement.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

// Radians: tilt of the odometry and of the map against gravity.
constexpr double kTiltSigma = 0.003;

std::vector<KeyframeId> neighbourhood(const Map& map, KeyframeId match, int most,
                                      const std::function<bool(KeyframeId)>& allowed) {
  std::vector<KeyframeId> around{match};
  const auto add = [&](KeyframeId id) {
    if (id != 0 && static_cast<int>(around.size()) < most && (!allowed || allowed(id)) &&
        std::find(around.begin(), around.end(), id) == around.end())
      around.push_back(id);
  };
  add(map.keyframe(match).previous);
  add(map.keyframe(match).next);
  for (const auto& neighbour : map.covisible(match, 10)) add(neighbour.first);
  return around;
}

}  // namespace

PlaceVerifier::PlaceVerifier(const PlaceVerificationOptions& options, std::shared_ptr<const CameraModel> camera)
    : options_(options), camera_(std::move(camera)) {
  pose_options_.focal = camera_->focal();
  pose_options_.iterations = options_.ransac_iterations;
  pose_options_.ransac_px = options_.ransac_px;
  pose_options_.inlier_px = options_.inlier_px;
  pose_options_.tilt_sigma = kTiltSigma;
}

void PlaceVerifier::finish(const Map& map, const Keyframe& query, const SE3& T_G_I, const SE3& start,
                           const std::vector<KeyframeId>& around, PlaceVerification* result) const {
  SE3 T_W_C = start;
  PlacePoseOptions pose_options = pose_options_;
  pose_options.depth_shared = sharedByTwo(query.depth_noise);
  GuidedMatches guided;
  PlacePose pose;
  const std::vector<MapPoint> points = mapPointsOf(map, around);
  for (const double factor : {1.0, 0.5}) {
    guided = matchGuided(map, query.frame.features, T_W_C, factor * options_.guided_radius, points, *camera_,
                         options_.max_hamming, GuidedLooks::kStrict);
    pose = refinePlacePose(guided.matches, singleCamera(), T_W_C, T_G_I.rotation() * query.frame.T_I_C.rotation(),
                           pose_options);
    result->inliers = static_cast<int>(pose.inliers.size());
    if (result->inliers < options_.min_ransac_inliers) {
      result->reason =
          formatted("%d inliers of guided matching, needs %d", result->inliers, options_.min_ransac_inliers);
      return;
    }
    if (!pose.found) {
      result->reason = formatted("%d of %zu matches do not fix a pose", result->inliers, guided.matches.size());
      return;
    }
    T_W_C = pose.T_W_B;
  }
  result->T_W_I = T_W_C * query.frame.T_I_C.inverse();
  result->information = pose.information;
  for (const std::uint32_t k : pose.inliers)
    if (guided.source[k].second != kNoLandmark) result->landmarks.push_back(guided.source[k]);
  std::vector<bool> inlier(query.frame.features.size(), false);
  for (const std::uint32_t k : pose.inliers) inlier[guided.source[k].first] = true;
  result->coverage = placeCoverage(map, query.frame.features, inlier, T_W_C, around, *camera_);
  // Position along the weakest direction, marginal over the angles.
  const Matrix6d covariance = result->information.inverse();
  const double sigma = std::sqrt(covariance.bottomRightCorner<3, 3>().diagonal().maxCoeff());
  if (!(sigma <= options_.max_sigma_position)) {
    result->reason = formatted("position is known to %.3f m only, needs %.3f", sigma, options_.max_sigma_position);
    return;
  }
  const MapKeyframe& match = map.keyframe(result->match);
  const DepthAgreement depth =
      compareDepth(match.data->frame.depth_grid, query.frame.depth_grid, match.T_W_C().inverse() * T_W_C, *camera_);
  if (depth.compared >= 100) {
    result->depth_agreement = depth.agreement();
    if (depth.agreement() < options_.min_depth_agreement) {
      result->reason =
          formatted("%.2f of the common depth agrees, needs %.2f", depth.agreement(), options_.min_depth_agreement);
      return;
    }
    if (depth.seeThrough() > options_.max_see_through) {
      result->reason = formatted("%.2f of the surfaces are seen through, at most %.2f", depth.seeThrough(),
                                 options_.max_see_through);
      return;
    }
  }
  result->accepted = true;
  result->reason = formatted("%d inliers in %d of %d cells of the image, depth agreement %.2f", result->inliers,
                             result->coverage.explained_cells, result->coverage.cells, result->depth_agreement);
}

// In poor texture few corners are detected again, so use the neighbouring keyframes' corners as well.
std::vector<PlaceMatch> PlaceVerifier::match(const Map& map, const Keyframe& query, const BowResult& query_bow,
                                             KeyframeId match, const KeyframeDatabase& database,
                                             const std::function<bool(KeyframeId)>& allowed) const {
  struct Best {
    int distance = std::numeric_limits<int>::max();
    PlaceMatch match;
  };
  const auto& features = query.frame.features;
  std::vector<Best> best(features.size());
  for (const KeyframeId id : neighbourhood(map, match, options_.matched_keyframes, allowed)) {
    if (!database.has(id)) continue;
    const std::vector<Feature>& theirs = map.keyframe(id).features();
    for (const auto& pair : matchByDirectIndex(features, query_bow.direct, theirs, database.bow(id).direct, options_)) {
      MapPoint point;
      const int distance = hammingDistance(features[pair.first].descriptor, theirs[pair.second].descriptor);
      if (distance < best[pair.first].distance && mapPointOf(map, id, pair.second, &point))
        best[pair.first] = {distance, makePlaceMatch(features[pair.first], point)};
    }
  }
  std::vector<PlaceMatch> matches;
  for (const Best& b : best)
    if (b.distance < std::numeric_limits<int>::max()) matches.push_back(b.match);
  return matches;
}

PlaceVerification PlaceVerifier::verify(const Map& map, const Keyframe& query, const SE3& T_G_I,
                                        const BowResult& query_bow, KeyframeId match, const KeyframeDatabase& database,
                                        const std::function<bool(KeyframeId)>& allowed) const {
  PlaceVerification result;
  result.match = match;
  const std::vector<PlaceMatch> matches = this->match(map, query, query_bow, match, database, allowed);
  if (static_cast<int>(matches.size()) < options_.min_matches) {
    result.reason = formatted("%zu descriptor matches, needs %d", matches.size(), options_.min_matches);
    return result;
  }
  PlacePoseOptions pose_options = pose_options_;
  pose_options.seed = query.id * 1000003ull + match;
  const PlacePose pose =
      ransacPlacePose(matches, singleCamera(), T_G_I.rotation() * query.frame.T_I_C.rotation(), pose_options);
  result.inliers = static_cast<int>(pose.inliers.size());
  if (result.inliers < options_.min_ransac_inliers) {
    result.reason = formatted("%d inliers of RANSAC, needs %d", result.inliers, options_.min_ransac_inliers);
    return result;
  }
  finish(map, query, T_G_I, pose.T_W_B, neighbourhood(map, match, options_.guided_keyframes, allowed), &result);
  return result;
}

PlaceVerification PlaceVerifier::track(const Map& map, const Keyframe& query, const SE3& T_W_I, KeyframeId match,
                                       const std::function<bool(KeyframeId)>& allowed) const {
  PlaceVerification result;
  result.match = match;
  finish(map, query, T_W_I, T_W_I * query.frame.T_I_C, neighbourhood(map, match, options_.guided_keyframes, allowed),
         &result);
  return result;
}

}  // namespace vip_slam
