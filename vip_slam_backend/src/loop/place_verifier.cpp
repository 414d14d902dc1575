#include "vip_slam_backend/loop/place_verifier.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include <Eigen/LU>

#include "vip_slam_backend/loop/place_matching.h"
#include "vip_slam_backend/loop/scene_agreement.h"

namespace vip_slam {
namespace {

// ORB pyramids here and in common vocabularies grow by 1.2 to 1.4 per octave.
double octaveScale(const Feature& f) { return std::pow(1.3, f.octave); }

std::string words(const char* format, double a, double b) {
  char text[128];
  std::snprintf(text, sizeof text, format, a, b);
  return text;
}

// A feature's point in the map: its landmark, or its own depth. False when it has neither.
bool pointOf(const Map& map, const MapKeyframe& kf, std::uint32_t feature, Eigen::Vector3d* p_W, double* sigma) {
  const Feature& f = kf.features()[feature];
  if (const MapLandmark* landmark = map.findLandmark(kf.landmarks[feature])) {
    *p_W = landmark->p_W;
    *sigma = 0.01;
    return true;
  }
  if (f.depth <= 0) return false;
  *p_W = kf.T_W_C() * (f.depth * Eigen::Vector3d(f.xy.x(), f.xy.y(), 1.0));
  *sigma = f.depth_sigma;
  return true;
}

PlaceMatch makeMatch(const Feature& f, const Eigen::Vector3d& p_W, double sigma) {
  PlaceMatch m;
  m.p_W = p_W;
  m.xy = f.xy.cast<double>();
  m.depth = f.depth;
  m.depth_sigma = std::hypot(f.depth_sigma, sigma);
  m.scale = octaveScale(f);
  return m;
}

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

struct PlaceVerifier::Guided {
  std::vector<PlaceMatch> matches;
  std::vector<std::pair<std::uint32_t, LandmarkId>> source;  ///< query feature, landmark or kNoLandmark
};

PlaceVerifier::PlaceVerifier(const PlaceVerificationOptions& options, std::shared_ptr<const CameraModel> camera)
    : options_(options), camera_(std::move(camera)) {
  pose_options_.focal = camera_->focal();
  pose_options_.iterations = options_.ransac_iterations;
  pose_options_.ransac_px = options_.ransac_px;
  pose_options_.inlier_px = options_.inlier_px;
}

PlaceVerifier::Guided PlaceVerifier::guide(const Map& map, const Keyframe& query, const SE3& T_W_C, double radius,
                                           const std::vector<KeyframeId>& around) const {
  const auto& features = query.frame.features;
  const FeatureGrid grid(features, camera_->width(), camera_->height());
  const SE3 T_C_W = T_W_C.inverse();
  struct Best {
    int distance = 1000;
    PlaceMatch match;
    LandmarkId landmark = kNoLandmark;
  };
  std::vector<Best> best(features.size());
  std::set<LandmarkId> done;
  for (const KeyframeId id : around) {
    const MapKeyframe& kf = map.keyframe(id);
    for (std::uint32_t f = 0; f < kf.features().size(); ++f) {
      const LandmarkId landmark = kf.landmarks[f];
      if (landmark != kNoLandmark && !done.insert(landmark).second) continue;
      Eigen::Vector3d p_W;
      double sigma;
      if (!pointOf(map, kf, f, &p_W, &sigma)) continue;
      Eigen::Vector2d uv;
      const Eigen::Vector3d p_C = T_C_W * p_W;
      if (p_C.z() < 0.1 || !camera_->project(p_C, &uv) || !camera_->inImage(uv)) continue;
      const Descriptor& descriptor =
          landmark != kNoLandmark ? map.landmark(landmark).descriptor : kf.features()[f].descriptor;
      int first = 1000, second = 1000;
      std::uint32_t nearest = 0;
      for (const std::uint32_t candidate : grid.near(uv, radius)) {
        const int distance = hammingDistance(descriptor, features[candidate].descriptor);
        if (distance < first) {
          second = first;
          first = distance;
          nearest = candidate;
        } else if (distance < second) {
          second = distance;
        }
      }
      if (first > options_.max_hamming || first > 0.9 * second || first >= best[nearest].distance) continue;
      best[nearest] = {first, makeMatch(features[nearest], p_W, sigma), landmark};
    }
  }
  Guided result;
  for (std::uint32_t f = 0; f < best.size(); ++f) {
    if (best[f].distance > options_.max_hamming) continue;
    result.matches.push_back(best[f].match);
    result.source.emplace_back(f, best[f].landmark);
  }
  return result;
}

void PlaceVerifier::finish(const Map& map, const Keyframe& query, const SE3& T_G_I, const SE3& start,
                           const std::vector<KeyframeId>& around, PlaceVerification* result) const {
  SE3 T_W_C = start;
  Guided guided;
  PlacePose pose;
  for (const double factor : {1.0, 0.5}) {
    guided = guide(map, query, T_W_C, factor * options_.guided_radius, around);
    pose = refinePlacePose(guided.matches, T_W_C, pose_options_);
    result->inliers = static_cast<int>(pose.inliers.size());
    if (!pose.found || result->inliers < options_.min_ransac_inliers) {
      result->reason = words("%.0f inliers after guided matching, needs %.0f", result->inliers, options_.min_inliers);
      return;
    }
    T_W_C = pose.T_W_C;
  }
  result->T_W_I = T_W_C * query.frame.T_I_C.inverse();
  result->information = pose.information;
  for (const std::uint32_t k : pose.inliers)
    if (guided.source[k].second != kNoLandmark) result->landmarks.push_back(guided.source[k]);
  if (result->inliers < options_.min_inliers) {
    result->reason = words("%.0f inliers after guided matching, needs %.0f", result->inliers, options_.min_inliers);
    return;
  }
  // Position along the weakest direction, marginal over the angles.
  const Matrix6d covariance = result->information.inverse();
  const double sigma = std::sqrt(covariance.bottomRightCorner<3, 3>().diagonal().maxCoeff());
  if (!(sigma <= options_.max_sigma_position)) {
    result->reason = words("position is known to %.3f m only, needs %.3f", sigma, options_.max_sigma_position);
    return;
  }
  const double tilt = std::acos(std::clamp((result->T_W_I.rotation().conjugate() * Eigen::Vector3d::UnitZ())
                                               .dot(T_G_I.rotation().conjugate() * Eigen::Vector3d::UnitZ()),
                                           -1.0, 1.0)) * 180.0 / M_PI;
  if (tilt > options_.max_gravity_deg) {
    result->reason = words("pose is tilted %.1f deg against gravity, at most %.1f", tilt, options_.max_gravity_deg);
    return;
  }
  const MapKeyframe& match = map.keyframe(result->match);
  const DepthAgreement depth =
      compareDepth(match.data->frame.depth_grid, query.frame.depth_grid, match.T_W_C().inverse() * T_W_C, *camera_);
  if (depth.compared >= 100) {
    result->depth_agreement = depth.agreement();
    if (depth.agreement() < options_.min_depth_agreement) {
      result->reason = words("%.2f of the common depth agrees, needs %.2f", depth.agreement(), options_.min_depth_agreement);
      return;
    }
    if (depth.seeThrough() > options_.max_see_through) {
      result->reason = words("%.2f of the surfaces are seen through, at most %.2f", depth.seeThrough(), options_.max_see_through);
      return;
    }
  }
  result->accepted = true;
  result->reason = words("%.0f inliers, depth agreement %.2f", result->inliers, result->depth_agreement);
}

// A keyframe in poor texture has few corners that come again; those around it have others.
std::vector<PlaceMatch> PlaceVerifier::match(const Map& map, const Keyframe& query, const BowResult& query_bow,
                                             const std::vector<KeyframeId>& around,
                                             const KeyframeDatabase& database) const {
  struct Best {
    int distance = 1000;
    PlaceMatch match;
  };
  const auto& features = query.frame.features;
  std::vector<Best> best(features.size());
  for (const KeyframeId id : around) {
    if (!database.has(id)) continue;
    const MapKeyframe& kf = map.keyframe(id);
    for (const auto& pair :
         matchByDirectIndex(features, query_bow.direct, kf.features(), database.bow(id).direct, options_)) {
      Eigen::Vector3d p_W;
      double sigma;
      const int distance = hammingDistance(features[pair.first].descriptor, kf.features()[pair.second].descriptor);
      if (distance < best[pair.first].distance && pointOf(map, kf, pair.second, &p_W, &sigma))
        best[pair.first] = {distance, makeMatch(features[pair.first], p_W, sigma)};
    }
  }
  std::vector<PlaceMatch> matches;
  for (const Best& b : best)
    if (b.distance < 1000) matches.push_back(b.match);
  return matches;
}

PlaceVerification PlaceVerifier::verify(const Map& map, const Keyframe& query, const SE3& T_G_I,
                                        const BowResult& query_bow, KeyframeId match, const KeyframeDatabase& database,
                                        const std::function<bool(KeyframeId)>& allowed) const {
  PlaceVerification result;
  result.match = match;
  const std::vector<PlaceMatch> matches = this->match(
      map, query, query_bow, neighbourhood(map, match, options_.matched_keyframes, allowed), database);
  result.matches = static_cast<int>(matches.size());
  if (result.matches < options_.min_matches) {
    result.reason = words("%.0f descriptor matches, needs %.0f", result.matches, options_.min_matches);
    return result;
  }
  PlacePoseOptions pose_options = pose_options_;
  pose_options.seed = query.id * 1000003ull + match;
  const PlacePose pose = ransacPlacePose(matches, T_G_I.rotation() * query.frame.T_I_C.rotation(), pose_options);
  result.inliers = static_cast<int>(pose.inliers.size());
  if (result.inliers < options_.min_ransac_inliers) {
    result.reason = words("%.0f inliers of RANSAC, needs %.0f", result.inliers, options_.min_ransac_inliers);
    return result;
  }
  finish(map, query, T_G_I, pose.T_W_C, neighbourhood(map, match, options_.guided_keyframes, allowed), &result);
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
