// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/loop/graph_builder.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "vip_slam_core/geometry/angle.h"

namespace vip_slam {
namespace {

// Metres between neighbours. A rotation in place drifts too: a full turn counts as two metres of travel.
double wayBetween(const MapKeyframe& a, const MapKeyframe& b) {
  const double turned = a.state.T_W_I.rotation().angularDistance(b.state.T_W_I.rotation());
  const double way = (a.state.T_W_I.t() - b.state.T_W_I.t()).norm() + turned / M_PI;
  // With keyframes missing in between, as after localisation-only mode, the distance travelled is not known.
  constexpr double kWayPerSecond = 0.5;  // m
  return b.previous == a.id() ? way : std::max(way, kWayPerSecond * std::abs(b.data->frame.t - a.data->frame.t));
}

// Odometry between neighbours: a random walk along the way, and what the front end says of this motion, which is much
// over a gap without images. Where it was not tracking, or only just, and says nothing, the walk is ten times as large.
Matrix6d odometryInformation(const MapKeyframe& a, const MapKeyframe& b, double drift,
                             const PoseGraphOptions& options) {
  const double way = std::max(0.02, wayBetween(a, b));
  const double angle = options.odometry_sigma_yaw_deg * kDegree, position = options.odometry_sigma_position;
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal().head<3>().setConstant(angle * angle * way);
  covariance.diagonal().tail<3>().setConstant(position * position * way);
  const bool weak =
      a.data->frame.status.state != TrackingState::kTracking || b.data->frame.status.state != TrackingState::kTracking;
  if (b.previous == a.id() && b.motion.known())
    covariance += b.motion.covariance;
  else if (weak)
    covariance *= 100;
  return (drift * covariance).inverse().llt().matrixU();
}

// Factor on the variances of all odometry for a drift that is common to the whole way that a loop closes. Over w metres
// a walk has the variance s^2 w and the drift (d w)^2: as if each variance counted 1 + (d / s)^2 w times.
double commonDrift(const Map& map, const std::pair<KeyframeId, KeyframeId>& closing, const PoseGraphOptions& options) {
  const auto [first, last] = std::minmax(closing.first, closing.second);
  double way = 0;
  for (const auto& [id, kf] : map.keyframes())
    if (id > first && id <= last && map.hasKeyframe(kf.previous)) way += wayBetween(map.keyframe(kf.previous), kf);
  const double ratio = options.odometry_drift / options.odometry_sigma_position;
  return 1 + ratio * ratio * way;
}

std::map<std::uint32_t, std::uint32_t> epochGroups(const Map& map,
                                                   const std::vector<std::pair<KeyframeId, KeyframeId>>& loops) {
  std::map<std::uint32_t, std::uint32_t> group;
  for (const auto& entry : map.keyframes()) group[entry.second.data->frame.epoch] = entry.second.data->frame.epoch;
  const auto join = [&group](std::uint32_t a, std::uint32_t b) {
    const std::uint32_t from = std::max(group[a], group[b]), into = std::min(group[a], group[b]);
    if (from == into) return;
    for (auto& g : group)
      if (g.second == from) g.second = into;
  };
  for (const auto& loop : loops)
    if (map.hasKeyframe(loop.first) && map.hasKeyframe(loop.second))
      join(map.keyframe(loop.first).data->frame.epoch, map.keyframe(loop.second).data->frame.epoch);
  return group;
}

}  // namespace

Matrix6d diagonalSqrtInformation(double sigma_angle, double sigma_position) {
  Matrix6d L = Matrix6d::Zero();
  L.diagonal().head<3>().setConstant(1.0 / sigma_angle);
  L.diagonal().tail<3>().setConstant(1.0 / sigma_position);
  return L;
}

Matrix6d loopSqrtInformation(const Matrix6d& camera_information, const SE3& T_W_match, const SE3& T_W_query,
                             const SE3& T_I_C, const PoseGraphOptions& options) {
  Matrix6d covariance = Matrix6d::Zero();
  const Eigen::FullPivLU<Matrix6d> lu(camera_information);
  if (lu.isInvertible()) {
    // From the query camera's perturbation to the residual: theta_I = R_I_C theta_C rotates the lever arm from camera
    // to body, and positions are compared in the match's frame.
    const Eigen::Matrix3d R_match_W = T_W_match.R().transpose();
    Matrix6d J = Matrix6d::Zero();
    J.topLeftCorner<3, 3>() = T_I_C.R();
    J.bottomLeftCorner<3, 3>() = R_match_W * T_W_query.R() * hat(T_I_C.t()) * T_I_C.R();
    J.bottomRightCorner<3, 3>() = R_match_W;
    covariance = J * lu.inverse() * J.transpose();
  }
  const double angle = options.loop_sigma_angle_deg * kDegree;
  covariance.diagonal().head<3>().array() += angle * angle;
  covariance.diagonal().tail<3>().array() += options.loop_sigma_position * options.loop_sigma_position;
  return covariance.inverse().llt().matrixU();
}

std::vector<EpochPart> epochParts(const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops) {
  std::vector<EpochPart> parts;
  for (const auto& [epoch, part] : epochGroups(map, loops)) parts.push_back({epoch, part});
  return parts;
}

std::set<KeyframeId> connectedKeyframes(const Map& map, KeyframeId id,
                                        const std::vector<std::pair<KeyframeId, KeyframeId>>& loops) {
  const auto group = epochGroups(map, loops);
  const std::uint32_t ours = group.at(map.keyframe(id).data->frame.epoch);
  std::set<KeyframeId> result;
  for (const auto& entry : map.keyframes())
    if (group.at(entry.second.data->frame.epoch) == ours) result.insert(entry.first);
  return result;
}

std::set<KeyframeId> referencePart(const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops) {
  struct Part {
    std::size_t keyframes = 0;
    bool stored = false;
    KeyframeId oldest = 0;
  };
  std::map<std::uint32_t, Part> parts;
  const auto group = epochGroups(map, loops);
  for (const auto& [id, keyframe] : map.keyframes()) {
    Part& part = parts[group.at(keyframe.data->frame.epoch)];
    if (part.keyframes++ == 0) part.oldest = id;  // in ascending order
    part.stored = part.stored || keyframe.stored;
  }
  if (parts.empty()) return {};
  constexpr std::size_t kFragment = 10;  // a part is a fragment when the largest one is this many times as large
  std::size_t largest = 0;
  for (const auto& entry : parts) largest = std::max(largest, entry.second.keyframes);
  const auto lesser = [largest](const auto& a, const auto& b) {
    const auto rank = [largest](const Part& part) {
      return std::make_tuple(part.stored,
                             part.stored ? part.keyframes : std::size_t(kFragment * part.keyframes >= largest));
    };
    const auto p = rank(a.second), q = rank(b.second);
    return p != q ? p < q : a.second.oldest > b.second.oldest;
  };
  return connectedKeyframes(map, std::max_element(parts.begin(), parts.end(), lesser)->second.oldest, loops);
}

PosePlaneGraph buildPosePlaneGraph(const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops,
                                   const std::vector<std::pair<PlaneId, PlaneId>>& same_planes,
                                   const std::pair<KeyframeId, KeyframeId>& closing, double min_seconds,
                                   const PoseGraphOptions& options) {
  PosePlaneGraph graph;
  std::map<PlaneId, PlaneId> into;
  for (const auto& pair : same_planes) into[pair.first] = pair.second;
  const auto planeOf = [&into](PlaneId id) {
    const auto it = into.find(id);
    return it == into.end() ? id : it->second;
  };
  for (const auto& entry : map.keyframes()) graph.addPose(entry.first, entry.second.state.T_W_I);
  for (const auto& entry : map.planes())
    if (planeOf(entry.first) == entry.first) graph.addPlane(entry.first, entry.second.estimate.plane);

  const auto relative = [&map](KeyframeId i, KeyframeId j) {
    return map.keyframe(i).state.T_W_I.inverse() * map.keyframe(j).state.T_W_I;
  };
  const Matrix6d loop_information =
      diagonalSqrtInformation(options.loop_sigma_angle_deg * kDegree, options.loop_sigma_position);
  const double drift = commonDrift(map, closing, options);
  std::map<std::uint32_t, KeyframeId> last;  // per epoch
  for (const auto& entry : map.keyframes()) {
    const MapKeyframe& kf = entry.second;
    const auto before = last.find(kf.data->frame.epoch);
    if (before != last.end())
      graph.addEdge(RelativePoseEdge{before->second, entry.first, relative(before->second, entry.first),
                                     odometryInformation(map.keyframe(before->second), kf, drift, options)});
    last[kf.data->frame.epoch] = entry.first;
    for (const auto& neighbour : map.covisible(entry.first, options.covisible_edge)) {
      const MapKeyframe& other = map.keyframe(neighbour.first);
      const bool apart = other.data->frame.epoch != kf.data->frame.epoch ||
                         std::abs(other.data->frame.t - kf.data->frame.t) > min_seconds;
      if (neighbour.first < entry.first && apart)
        graph.addEdge(
            RelativePoseEdge{neighbour.first, entry.first, relative(neighbour.first, entry.first), loop_information});
    }
    const Eigen::Vector3d plane_sigma(0.5 * kDegree, 0.5 * kDegree, 0.02);
    for (const auto& seen : kf.planes) {
      const auto plane = map.planes().find(seen.first);
      if (plane == map.planes().end()) continue;
      graph.addEdge(PosePlaneEdge{entry.first, planeOf(seen.first),
                                  transformPlane(kf.state.T_W_I.inverse(), plane->second.estimate.plane),
                                  plane_sigma.cwiseInverse().asDiagonal()});
    }
  }
  for (const auto& loop : loops)
    if (map.hasKeyframe(loop.first) && map.hasKeyframe(loop.second))
      graph.addEdge(RelativePoseEdge{loop.second, loop.first, relative(loop.second, loop.first), loop_information});
  return graph;
}

}  // namespace vip_slam
