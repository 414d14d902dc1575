#include "plane_factors.h"

#include <array>
#include <cmath>

#include "vip_slam_backend/factors/reprojection.h"
#include "vip_slam_backend/solver/robust.h"

namespace vip_slam {

PlaneFactorBuilder::PlaneFactorBuilder(const Map& map, const ProblemScope& scope, const BuilderSettings& settings,
                                       const std::unordered_map<KeyframeId, int>& frames, BuiltProblem* built)
    : map_(map), scope_(scope), settings_(settings), frames_(frames), built_(built) {
  BaProblem& problem = built->problem;
  for (const BaFrame& f : problem.frames) geometry_.emplace_back(f.state.T_W_I, f.T_I_C);
  if (settings.variant == Variant::kVi) return;
  // Planes that a free frame sees by depth; a plane without depth has nothing that fixes its distance but homographies.
  for (const KeyframeId id : scope.free)
    for (const auto& observation : map.keyframe(id).planes) planes_[observation.first] = 0;
  for (auto& entry : planes_) {
    const MapPlane& plane = map.planes().at(entry.first);
    entry.second = static_cast<int>(problem.planes.size());
    BaPlane variable;
    variable.plane = plane.estimate.plane;
    variable.kind = plane.estimate.kind;
    variable.prior_weight = 180.0 / (M_PI * settings.measurement.plane_prior_deg);
    problem.planes.push_back(variable);
    built->planes.push_back(entry.first);
  }
}

bool PlaneFactorBuilder::onPlane(const MapLandmark& landmark, int* index) const {
  const auto found = planes_.find(landmark.plane);
  if (landmark.plane == 0 || found == planes_.end()) return false;
  *index = found->second;
  return std::abs(built_->problem.planes[*index].plane.signedDistance(landmark.p_W)) <= 0.1;
}

void PlaneFactorBuilder::chooseHosts(const std::vector<LandmarkId>& landmarks) {
  if (planes_.empty()) return;
  // Per plane and keyframe: the landmarks that it could host.
  std::map<int, std::map<KeyframeId, std::vector<LandmarkId>>> candidates;
  std::unordered_map<LandmarkId, std::vector<KeyframeId>> views;
  for (const LandmarkId id : landmarks) {
    const MapLandmark& landmark = map_.landmark(id);
    int plane = 0;
    if (!onPlane(landmark, &plane)) continue;
    const Plane& parameters = built_->problem.planes[plane].plane;
    for (const MapObservation& o : landmark.observations) {
      const auto frame = frames_.find(o.keyframe);
      if (frame == frames_.end()) continue;
      // A host must see the plane well: its ray is what the others are compared with.
      const FrameGeometry& g = geometry_[frame->second];
      const Eigen::Vector2d xy = map_.feature(o).xy.cast<double>();
      double rho = 1;
      if (!homographyDepthRatio(g, g, parameters, xy, &rho)) continue;
      candidates[plane][o.keyframe].push_back(id);
      views[id].push_back(o.keyframe);
    }
  }
  for (auto& plane : candidates) {
    std::map<KeyframeId, int> count;
    std::set<std::pair<int, KeyframeId>> order;
    for (const auto& entry : plane.second) {
      count[entry.first] = static_cast<int>(entry.second.size());
      order.insert({count[entry.first], entry.first});
    }
    if (!settings_.measurement.homography_shared_hosts) {
      for (const auto& entry : plane.second)
        for (const LandmarkId id : entry.second) hosts_.emplace(id, entry.first);  // ascending: the first view wins
      continue;
    }
    while (!order.empty() && order.rbegin()->first > 0) {
      const KeyframeId host = order.rbegin()->second;
      for (const LandmarkId id : plane.second[host]) {
        if (!hosts_.emplace(id, host).second) continue;
        for (const KeyframeId other : views[id]) {
          order.erase({count[other], other});
          order.insert({--count[other], other});
        }
      }
    }
  }
}

bool PlaneFactorBuilder::addLandmark(const MapLandmark& landmark) {
  int plane_index = 0;
  const auto host_id = hosts_.find(landmark.id);
  if (host_id == hosts_.end() || !onPlane(landmark, &plane_index)) return false;
  const Plane& plane = built_->problem.planes[plane_index].plane;
  std::vector<BaHomographyPair> pairs;
  int tried = 0, refused = 0;
  const int host = frames_.at(host_id->second);
  const Feature* host_feature = nullptr;
  for (const MapObservation& o : landmark.observations)
    if (o.keyframe == host_id->second) host_feature = &map_.feature(o);
  for (const MapObservation& o : landmark.observations) {
    const auto frame = frames_.find(o.keyframe);
    if (frame == frames_.end() || frame->second == host) continue;
    const Feature& feature = map_.feature(o);
    const bool both_fixed = built_->problem.frames[host].fixed && built_->problem.frames[frame->second].fixed;
    if (both_fixed) continue;
    BaHomographyPair pair;
    pair.i = host;
    pair.j = frame->second;
    pair.plane = plane_index;
    pair.pair.xy_i = host_feature->xy.cast<double>();
    pair.pair.xy_j = feature.xy.cast<double>();
    ++tried;
    double rho = 1;
    if (!homographyDepthRatio(geometry_[pair.i], geometry_[pair.j], plane, pair.pair.xy_i, &rho)) {
      ++refused;
      continue;
    }
    // The pair's noise is that of the observer and that of the host, seen from the observer.
    const Vector9d h = homographyVector(geometry_[pair.i], geometry_[pair.j], plane);
    const double observer = 1.0 / pixelWeight(feature, settings_), from = 1.0 / pixelWeight(*host_feature, settings_);
    const double sigma = std::sqrt(observer * observer + hostNoiseGain(h, pair.pair.xy_i) * from * from) *
                         settings_.measurement.homography_inflation;
    pair.pair.weight = 1.0 / (sigma * rho);
    // Outliers cannot be down-weighted after compression: gate and weigh here, at the present estimate.
    const double chi2 = (homographyRows(pair.pair) * h).squaredNorm();
    if (chi2 > settings_.measurement.outlier_chi2) {
      ++refused;
      continue;
    }
    pair.pair.weight *= huberScale(chi2, settings_.measurement.huber);
    pairs.push_back(pair);
  }
  if (tried == 0 || 2 * refused > tried) return false;
  pairs_.insert(pairs_.end(), pairs.begin(), pairs.end());
  return true;
}

void PlaneFactorBuilder::finish() {
  BaProblem& problem = built_->problem;
  if (planes_.empty()) return;
  if (settings_.variant == Variant::kViP) {
    problem.homography_pairs = std::move(pairs_);
  } else {
    for (const BaHomographyPair& pair : pairs_) {
      BaHomography& h = homographies_[{pair.i, pair.j, pair.plane}];
      h.i = pair.i;
      h.j = pair.j;
      h.plane = pair.plane;
      addHomographyPair(pair.pair, &h.G);
      ++h.pairs;
    }
    for (const auto& entry : homographies_) problem.homographies.push_back(entry.second);
  }
  addDepthBlocks();
}

void PlaneFactorBuilder::addDepthBlocks() {
  BaProblem& problem = built_->problem;
  // Keyframes that are constants: one block per plane in the world, seen from a fixed frame at the origin.
  std::map<PlaneId, Eigen::Matrix4d> outside;
  std::map<PlaneId, int> outside_points;
  for (const auto& entry : map_.keyframes()) {
    const auto frame = frames_.find(entry.first);
    const bool constant = frame == frames_.end() || problem.frames[frame->second].fixed;
    if (constant && !scope_.outside_planes) continue;
    const Eigen::Matrix4d T_W_C = entry.second.T_W_C().matrix();
    for (const auto& observation : entry.second.planes) {
      const auto plane = planes_.find(observation.first);
      if (plane == planes_.end()) continue;
      const PlaneObservation& o = observation.second;
      if (constant) {
        const auto sum = outside.emplace(observation.first, Eigen::Matrix4d::Zero()).first;
        sum->second += T_W_C * o.G * T_W_C.transpose();
        ++outside_points[observation.first];
      } else if (settings_.variant == Variant::kViP) {
        for (const PlanePoint& p : o.points) {
          BaPlanePoint factor;
          factor.frame = frame->second;
          factor.plane = plane->second;
          factor.p_C = p.p_C.cast<double>();
          factor.weight = std::sqrt(o.weight_scale) / p.sigma;
          problem.plane_points.push_back(factor);
        }
      } else {
        BaPointToPlane factor;
        factor.frame = frame->second;
        factor.plane = plane->second;
        factor.G = o.G;
        factor.points = static_cast<int>(o.points.size());
        problem.point_to_plane.push_back(factor);
      }
    }
  }
  if (outside.empty()) return;
  BaFrame world;
  world.fixed = true;
  world.motion = false;
  const int world_frame = static_cast<int>(problem.frames.size());
  problem.frames.push_back(world);
  built_->frames.push_back(0);
  for (const auto& sum : outside) {
    BaPointToPlane factor;
    factor.frame = world_frame;
    factor.plane = planes_[sum.first];
    factor.G = sum.second;
    factor.points = outside_points[sum.first];
    problem.point_to_plane.push_back(factor);
  }
}

Eigen::Vector3d intersectWithPlane(const Map& map, const MapLandmark& landmark) {
  const Plane& plane = map.planes().at(landmark.plane).estimate.plane;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weights = 0;
  for (const MapObservation& o : landmark.observations) {
    const MapKeyframe& kf = map.keyframe(o.keyframe);
    const SE3 T_W_C = kf.T_W_C();
    const Eigen::Vector2f& xy = kf.features()[o.feature].xy;
    const Eigen::Vector3d ray = T_W_C.rotation() * Eigen::Vector3d(xy.x(), xy.y(), 1.0);
    const double incidence = plane.n.dot(ray);
    const double z = -plane.signedDistance(T_W_C.t()) / incidence;
    const double cosine = std::abs(incidence) / ray.norm();
    if (!(z > 0.05) || cosine < 0.1) continue;
    // A ray's error on the plane grows with distance and with the slant.
    const double weight = cosine * cosine / (z * z);
    sum += weight * (T_W_C.t() + z * ray);
    weights += weight;
  }
  return weights > 0 ? Eigen::Vector3d(sum / weights) : plane.project(landmark.p_W);
}

}  // namespace vip_slam
