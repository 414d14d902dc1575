// SPDX-License-Identifier: BSD-3-Clause
#include "depth_registration.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace vip_slam {
namespace {

constexpr int kStep = 4;   ///< px between points
constexpr int kReach = 6;  ///< px from a point to the neighbours that define its normal
constexpr int kIterations = 12;
constexpr double kFar = 4;                                        ///< m
constexpr double kFirstGate = 0.15, kLastGate = 0.03;             ///< m between point and plane
constexpr double kAlike = 30;                                     ///< points with correlated errors that count as one
constexpr double kWorstRotation = 0.004, kWorstPosition = 0.006;  ///< rad, m; limits on the worst direction's sigma
constexpr double kRobust = 0.01;                                  ///< m

DepthSurface surfaceOf(const cv::Mat& depth, const CameraIntrinsics& c) {
  const auto at = [&](int u, int v) -> Eigen::Vector3d {
    if (u < 0 || v < 0 || u >= depth.cols || v >= depth.rows) return Eigen::Vector3d::Zero();
    const double z = 0.001 * depth.at<std::uint16_t>(v, u);
    return {(u - c.cx) / c.fx * z, (v - c.cy) / c.fy * z, z};
  };
  DepthSurface s;
  s.columns = depth.cols / kStep;
  s.rows = depth.rows / kStep;
  for (int y = 0; y < s.rows; ++y)
    for (int x = 0; x < s.columns; ++x) {
      const int u = x * kStep, v = y * kStep;
      const Eigen::Vector3d m = at(u, v), l = at(u - kReach, v), r = at(u + kReach, v), t = at(u, v - kReach),
                            b = at(u, v + kReach);
      s.point.push_back(m);
      s.normal.push_back(Eigen::Vector3d::Zero());
      if (m.z() < 0.3 || m.z() > kFar || l.z() == 0 || r.z() == 0 || t.z() == 0 || b.z() == 0) continue;
      const double bend = 0.004 * m.z() * m.z() + 0.002;
      if ((0.5 * (l + r) - m).norm() > bend || (0.5 * (t + b) - m).norm() > bend) continue;
      s.normal.back() = (b - t).cross(r - l).normalized();
    }
  return s;
}

/// `T_b_a`: in, initial guess; out, result. False when the surfaces do not constrain every direction.
bool registerSurfaces(const DepthSurface& a, const DepthSurface& b, const CameraIntrinsics& c, SE3* T_b_a,
                      PoseSigma* error) {
  double gate = kFirstGate;
  for (int n = 0; n < kIterations; ++n, gate = std::max(kLastGate, 0.8 * gate)) {
    Matrix6d H = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    double weights = 0, squares = 0;
    for (std::size_t k = 0; k < a.point.size(); ++k) {
      if (a.normal[k].isZero()) continue;
      const Eigen::Vector3d p = *T_b_a * a.point[k];
      if (p.z() < 0.3) continue;
      const long x = std::lround((c.fx * p.x() / p.z() + c.cx) / kStep),
                 y = std::lround((c.fy * p.y() / p.z() + c.cy) / kStep);
      if (x < 0 || y < 0 || x >= b.columns || y >= b.rows) continue;
      const std::size_t j =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(b.columns) + static_cast<std::size_t>(x);
      if (b.normal[j].isZero() || b.normal[j].dot(T_b_a->rotation() * a.normal[k]) < 0.8) continue;
      const double r = b.normal[j].dot(p - b.point[j]);
      if (std::abs(r) > gate) continue;
      const double w = 1 / (1 + r * r / (kRobust * kRobust));
      Vector6d J;
      J << p.cross(b.normal[j]), b.normal[j];
      H += w * J * J.transpose();
      g += w * r * J;
      weights += w;
      squares += w * r * r;
    }
    if (weights < 300) return false;
    const Vector6d d = -H.ldlt().solve(g);
    if (!d.allFinite()) return false;
    if (n + 1 == kIterations) {
      const Matrix6d covariance = kAlike * squares / weights * H.inverse();
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> rotation(covariance.topLeftCorner<3, 3>()),
          position(covariance.bottomRightCorner<3, 3>());
      *error = {std::sqrt(rotation.eigenvalues()[2]), std::sqrt(position.eigenvalues()[2])};
      // Written so that NaN fails as well.
      if (!(error->rotation < kWorstRotation && error->position < kWorstPosition)) return false;
    }
    *T_b_a = SE3(expQuaternion(d.head<3>()), d.tail<3>()) * *T_b_a;
  }
  return true;
}

}  // namespace

const DepthSurface& PoseRegistration::surface(std::size_t i) {
  const auto known = surfaces_.find(i);
  if (known != surfaces_.end()) return known->second;
  while (surfaces_.size() > 64) surfaces_.erase(surfaces_.begin());  // the oldest: pairs come in time order
  cv::Mat rgb, depth;
  loadRgbdFrame(folder_, folder_.frames[i], &rgb, &depth);
  return surfaces_[i] = surfaceOf(depth, folder_.depth_registered ? folder_.camera : folder_.depth_camera);
}

bool PoseRegistration::align(std::size_t i, std::size_t j, SE3* T_j_i, PoseSigma* error) {
  const DepthSurface from = surface(i);  // a copy, as surface(j) may evict it from the cache
  return registerSurfaces(from, surface(j), folder_.depth_registered ? folder_.camera : folder_.depth_camera, T_j_i,
                          error);
}

}  // namespace vip_slam
