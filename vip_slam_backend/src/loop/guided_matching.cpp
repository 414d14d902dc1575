// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/loop/guided_matching.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "vip_slam_backend/map/feature_grid.h"

namespace vip_slam {
namespace {

constexpr double kRatio = 0.9;        // of best to second distance; weak, since few corners lie around a projection
constexpr float kSameCorner2 = 4.0f;  // px^2: two detections of one corner do not compete

// With kWide over all descriptors of a landmark, since it looks different from other sides.
int distanceOf(const Map& map, const MapPoint& point, const Descriptor& descriptor, GuidedLooks looks) {
  if (point.landmark == kNoLandmark)
    return hammingDistance(map.keyframe(point.keyframe).features()[point.feature].descriptor, descriptor);
  if (looks == GuidedLooks::kStrict) return hammingDistance(map.landmark(point.landmark).descriptor, descriptor);
  int nearest = std::numeric_limits<int>::max();
  for (const MapObservation& o : map.landmark(point.landmark).observations)
    nearest = std::min(nearest, hammingDistance(map.feature(o).descriptor, descriptor));
  return nearest;
}

}  // namespace

bool mapPointOf(const Map& map, KeyframeId keyframe, std::uint32_t feature, MapPoint* point) {
  const MapKeyframe& kf = map.keyframe(keyframe);
  const Feature& f = kf.features()[feature];
  if (const MapLandmark* landmark = map.findLandmark(kf.landmarks[feature])) {
    *point = {landmark->p_W, 0.01, landmark->id, keyframe, feature};
    return true;
  }
  if (f.depth <= 0) return false;
  *point = {kf.T_W_C() * (f.depth * Eigen::Vector3d(f.xy.x(), f.xy.y(), 1.0)), f.depth_sigma, kNoLandmark, keyframe,
            feature};
  return true;
}

std::vector<MapPoint> mapPointsOf(const Map& map, const std::vector<KeyframeId>& keyframes) {
  std::vector<MapPoint> points;
  std::set<LandmarkId> done;
  for (const KeyframeId id : keyframes)
    for (std::uint32_t f = 0; f < map.keyframe(id).features().size(); ++f) {
      MapPoint point;
      if (!mapPointOf(map, id, f, &point)) continue;
      if (point.landmark != kNoLandmark && !done.insert(point.landmark).second) continue;
      points.push_back(point);
    }
  return points;
}

PlaceMatch makePlaceMatch(const Feature& feature, const MapPoint& point) {
  PlaceMatch m;
  m.p_W = point.p_W;
  m.xy = feature.xy.cast<double>();
  m.depth = feature.depth;
  m.depth_sigma = std::hypot(feature.depth_sigma, point.sigma);
  m.scale = std::pow(kOctaveScale, feature.octave);
  return m;
}

GuidedMatches matchGuided(const Map& map, const std::vector<Feature>& features, const SE3& T_W_C, double radius,
                          const std::vector<MapPoint>& points, const CameraModel& camera, int max_hamming,
                          GuidedLooks looks) {
  struct Best {
    int distance = std::numeric_limits<int>::max();
    const MapPoint* point = nullptr;
  };
  const FeatureGrid grid(features, camera.width(), camera.height(), radius);
  const SE3 T_C_W = T_W_C.inverse();
  std::vector<Best> best(features.size());
  for (const MapPoint& point : points) {
    const Eigen::Vector3d p_C = T_C_W * point.p_W;
    Eigen::Vector2d uv;
    if (p_C.z() < 0.1 || !camera.project(p_C, &uv) || !camera.inImage(uv)) continue;
    int first = std::numeric_limits<int>::max(), second = first;
    std::uint32_t nearest = 0;
    grid.around(uv, [&](std::uint32_t candidate) {
      const int distance = distanceOf(map, point, features[candidate].descriptor, looks);
      const bool rival = first < std::numeric_limits<int>::max() &&
                         (looks == GuidedLooks::kStrict ||
                          (features[candidate].pixel - features[nearest].pixel).squaredNorm() > kSameCorner2);
      if (distance < first) {
        if (rival) second = first;
        first = distance;
        nearest = candidate;
      } else if (rival && distance < second) {
        second = distance;
      }
    });
    if (first > max_hamming || first > kRatio * second || first >= best[nearest].distance) continue;
    best[nearest] = {first, &point};
  }
  GuidedMatches result;
  for (std::uint32_t f = 0; f < best.size(); ++f) {
    if (!best[f].point) continue;
    result.matches.push_back(makePlaceMatch(features[f], *best[f].point));
    result.source.emplace_back(f, best[f].point->landmark);
  }
  return result;
}

}  // namespace vip_slam
