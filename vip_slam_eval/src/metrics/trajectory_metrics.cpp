#include "vip_slam_eval/trajectory_metrics.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>

namespace vip_slam {
namespace {

constexpr double kDegrees = 180.0 / M_PI;

double angleOf(const Eigen::Quaterniond& q) { return logSO3(q).norm(); }

// Error of the estimated motion from a to b against the true one.
void addRelative(const PosePair& a, const PosePair& b, std::vector<double>* position, std::vector<double>* rotation) {
  const SE3 truth = a.T_W_B.inverse() * b.T_W_B;
  const SE3 estimate = a.T_M_B.inverse() * b.T_M_B;
  const SE3 error = truth.inverse() * estimate;
  position->push_back(error.t().norm());
  rotation->push_back(angleOf(error.rotation()) * kDegrees);
}

std::vector<double> cumulativePath(const std::vector<PosePair>& pairs) {
  std::vector<double> path(pairs.size(), 0.0);
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    path[i] = path[i - 1] + (pairs[i].T_W_B.t() - pairs[i - 1].T_W_B.t()).norm();
  }
  return path;
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
    case Alignment::kNone: return "none";
    case Alignment::kPosition: return "position";
    case Alignment::kYaw: return "yaw";
    case Alignment::kSe3: return "se3";
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

  // covariance = sum truth * estimate^T
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const PosePair& pair : pairs) {
    covariance += (pair.T_W_B.t() - mean_truth) * (pair.T_M_B.t() - mean_estimate).transpose();
  }
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  if (alignment == Alignment::kYaw) {
    // Maximise the trace of Rz(yaw)^T covariance.
    const double yaw = std::atan2(covariance(1, 0) - covariance(0, 1), covariance(0, 0) + covariance(1, 1));
    R = expSO3(Eigen::Vector3d(0, 0, yaw));
  } else if (alignment == Alignment::kSe3) {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
    R = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  }
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
    rotation.push_back(error.rotation * kDegrees);
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
    auto next = std::lower_bound(pairs.begin(), pairs.end(), wanted,
                                 [](const PosePair& p, double t) { return p.t < t; });
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
