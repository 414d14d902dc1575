// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/metrics/trajectory_metrics.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/geometry/so3.h"

namespace vip_slam {
namespace {

double angleOf(const Eigen::Quaterniond& q) { return logSO3(q).norm(); }

// Error of the estimated motion from a to b against the true one.
void addRelative(const PosePair& a, const PosePair& b, std::vector<double>* position, std::vector<double>* rotation) {
  const SE3 truth = a.T_W_B.inverse() * b.T_W_B;
  const SE3 estimate = a.T_M_B.inverse() * b.T_M_B;
  const SE3 error = truth.inverse() * estimate;
  position->push_back(error.t().norm());
  rotation->push_back(angleOf(error.rotation()) / kDegree);
}

std::vector<double> cumulativePath(const std::vector<PosePair>& pairs) {
  std::vector<double> path(pairs.size(), 0.0);
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    path[i] = path[i - 1] + (pairs[i].T_W_B.t() - pairs[i - 1].T_W_B.t()).norm();
  }
  return path;
}

// sum truth * estimate^T of the positions about their means
Eigen::Matrix3d crossCovariance(const std::vector<PosePair>& pairs, const Eigen::Vector3d& mean_truth,
                                const Eigen::Vector3d& mean_estimate) {
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const PosePair& pair : pairs) {
    covariance += (pair.T_W_B.t() - mean_truth) * (pair.T_M_B.t() - mean_estimate).transpose();
  }
  return covariance;
}

// The rotation R, of those that `alignment` allows, that maximises the trace of R^T M.
Eigen::Matrix3d bestRotation(const Eigen::Matrix3d& M, Alignment alignment) {
  if (alignment == Alignment::kYaw) {
    return expSO3(Eigen::Vector3d(0, 0, std::atan2(M(1, 0) - M(0, 1), M(0, 0) + M(1, 1))));
  }
  if (alignment != Alignment::kSe3) return Eigen::Matrix3d::Identity();
  return nearestRotation(M);
}

// Weight of the orientations relative to the positions, m^2: a tenth of the mean square position error after alignment,
// at least 1 mm^2. Positions that spread wider than their errors dominate; but a camera at rest, or one that moved on
// a straight line, leaves the rotation (about that line) to the noise of the positions, so orientations must fix it.
double orientationWeight(const std::vector<PosePair>& pairs, const Eigen::Vector3d& mean_truth,
                         const Eigen::Vector3d& mean_estimate, const Eigen::Matrix3d& R) {
  constexpr double kShare = 0.1, kFloor = 1e-6;
  double sum = 0;
  for (const PosePair& pair : pairs) {
    sum += (pair.T_W_B.t() - mean_truth - R * (pair.T_M_B.t() - mean_estimate)).squaredNorm();
  }
  return std::max(kFloor, kShare * sum / double(pairs.size()));
}

}  // namespace

std::vector<PosePair> associate(const Trajectory& truth, const Trajectory& estimate, double max_gap,
                                double time_offset) {
  std::vector<PosePair> pairs;
  pairs.reserve(estimate.size());
  for (const StampedPose& pose : estimate) {
    PosePair pair{pose.t, SE3(), pose.T_W_B};
    if (poseAt(truth, pose.t + time_offset, &pair.T_W_B, max_gap)) pairs.push_back(pair);
  }
  return pairs;
}

Alignment alignmentFromName(const std::string& name) {
  for (const Alignment a : {Alignment::kNone, Alignment::kPosition, Alignment::kYaw, Alignment::kSe3}) {
    if (alignmentName(a) == name) return a;
  }
  throw std::invalid_argument("alignment: is '" + name + "', expected none, position, yaw or se3");
}

std::string alignmentName(Alignment alignment) {
  switch (alignment) {
    case Alignment::kNone:
      return "none";
    case Alignment::kPosition:
      return "position";
    case Alignment::kYaw:
      return "yaw";
    case Alignment::kSe3:
      return "se3";
  }
  return "unknown";
}

SE3 align(const std::vector<PosePair>& pairs, Alignment alignment) {
  if (pairs.empty()) throw std::invalid_argument("alignment: no pair of poses, expected at least one");
  if (alignment == Alignment::kNone) return SE3();
  Eigen::Vector3d mean_truth = Eigen::Vector3d::Zero(), mean_estimate = Eigen::Vector3d::Zero();
  for (const PosePair& pair : pairs) {
    mean_truth += pair.T_W_B.t();
    mean_estimate += pair.T_M_B.t();
  }
  mean_truth /= double(pairs.size());
  mean_estimate /= double(pairs.size());

  const Eigen::Matrix3d covariance = crossCovariance(pairs, mean_truth, mean_estimate);
  const double weight = orientationWeight(pairs, mean_truth, mean_estimate, bestRotation(covariance, alignment));
  Eigen::Matrix3d turns = Eigen::Matrix3d::Zero();
  for (const PosePair& pair : pairs) turns += pair.T_W_B.R() * pair.T_M_B.R().transpose();
  const Eigen::Matrix3d R = bestRotation(covariance + weight * turns, alignment);
  return SE3(R, mean_truth - R * mean_estimate);
}

AbsoluteError absoluteError(const std::vector<PosePair>& pairs, Alignment alignment) {
  AbsoluteError result;
  result.T_W_M = align(pairs, alignment);
  std::vector<double> position, rotation;
  for (const PosePair& pair : pairs) {
    const SE3 estimate = result.T_W_M * pair.T_M_B;
    PoseError error;
    error.t = pair.t;
    error.position = estimate.t() - pair.T_W_B.t();
    error.rotation = angleOf(pair.T_W_B.rotation().conjugate() * estimate.rotation());
    position.push_back(error.position.norm());
    rotation.push_back(error.rotation / kDegree);
    result.errors.push_back(error);
  }
  result.position = summarise(std::move(position));
  result.rotation = summarise(std::move(rotation));
  return result;
}

RelativeError relativeErrorOverTime(const std::vector<PosePair>& pairs, double seconds) {
  RelativeError result;
  result.delta = seconds;
  if (pairs.size() < 2) return result;
  const double tolerance = 0.5 * (pairs.back().t - pairs.front().t) / double(pairs.size() - 1) + 1e-9;
  std::vector<double> position, rotation;
  for (const PosePair& pair : pairs) {
    const double wanted = pair.t + seconds;
    auto next =
        std::lower_bound(pairs.begin(), pairs.end(), wanted, [](const PosePair& p, double t) { return p.t < t; });
    if (next != pairs.begin() && (next == pairs.end() || wanted - std::prev(next)->t < next->t - wanted)) --next;
    if (std::abs(next->t - wanted) > tolerance || next->t <= pair.t) continue;
    addRelative(pair, *next, &position, &rotation);
  }
  result.position = summarise(std::move(position));
  result.rotation = summarise(std::move(rotation));
  return result;
}

RelativeError relativeErrorOverDistance(const std::vector<PosePair>& pairs, double metres) {
  RelativeError result;
  result.delta = metres;
  const std::vector<double> path = cumulativePath(pairs);
  std::vector<double> position, rotation;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto end = std::lower_bound(path.begin(), path.end(), path[i] + metres);
    if (end == path.end()) break;
    addRelative(pairs[i], pairs[static_cast<std::size_t>(end - path.begin())], &position, &rotation);
  }
  result.position = summarise(std::move(position));
  result.rotation = summarise(std::move(rotation));
  return result;
}

double truePathLength(const std::vector<PosePair>& pairs) { return pairs.empty() ? 0 : cumulativePath(pairs).back(); }

}  // namespace vip_slam
