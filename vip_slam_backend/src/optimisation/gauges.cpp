// SPDX-License-Identifier: BSD-3-Clause
#include "gauges.h"

#include <map>
#include <set>
#include <vector>

#include <Eigen/Eigenvalues>

#include "../util/union_find.h"
#include "vip_slam_backend/factors/homography.h"

namespace vip_slam {
namespace {

// Least eigenvalue of the sum of n n^T over shared planes: how far a third plane is off those spanned by two others.
bool spanSpace(const BaProblem& problem, const std::set<int>& a, const std::set<int>& b) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const int plane : a) {
    const Eigen::Vector3d& n = problem.planes[plane].plane.n;
    if (b.count(plane)) sum += n * n.transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(sum, Eigen::EigenvaluesOnly).eigenvalues()[0] >
         kMinIncidence * kMinIncidence;
}

void joinByPlanes(const BaProblem& problem, UnionFind* parts) {
  std::map<int, std::set<int>> planes_of;  // by part
  for (std::size_t f = 0; f < problem.frames.size(); ++f) planes_of[parts->find(static_cast<int>(f))];
  if (planes_of.size() < 2) return;
  for (const BaPointToPlane& f : problem.point_to_plane) planes_of[parts->find(f.frame)].insert(f.plane);
  for (const BaPlaneSample& f : problem.plane_samples) planes_of[parts->find(f.frame)].insert(f.plane);
  for (bool joined = true; joined;) {
    joined = false;
    for (auto a = planes_of.begin(); a != planes_of.end(); ++a) {
      for (auto b = std::next(a); b != planes_of.end();) {
        if (!spanSpace(problem, a->second, b->second)) {
          ++b;
          continue;
        }
        parts->join(a->first, b->first);
        a->second.insert(b->second.begin(), b->second.end());
        b = planes_of.erase(b);
        joined = true;
      }
    }
  }
}

}  // namespace

void addGauges(BaProblem* problem) {
  UnionFind parts(static_cast<int>(problem->frames.size()));
  for (const BaPoint& p : problem->points)
    for (int o = p.first + 1; o < p.first + p.count; ++o)
      parts.join(problem->observations[p.first].frame, problem->observations[o].frame);
  for (const BaImu& f : problem->imu) parts.join(f.i, f.j);
  for (const BaRelativePose& f : problem->relative_poses) parts.join(f.i, f.j);
  for (const BaHomography& f : problem->homographies) parts.join(f.i, f.j);
  for (const BaHomographyPair& f : problem->homography_pairs) parts.join(f.i, f.j);
  joinByPlanes(*problem, &parts);
  const int n = static_cast<int>(problem->frames.size());
  std::vector<char> held(n, 0), inertial(n, 0);
  for (int f = 0; f < n; ++f)
    if (problem->frames[f].fixed) held[parts.find(f)] = 1;
  for (const BaImu& f : problem->imu) inertial[parts.find(f.i)] = 1;
  for (int f = 0; f < n; ++f) {
    const int part = parts.find(f);
    if (held[part]) continue;
    held[part] = 1;  // frames ascend: f is the oldest of its part
    BaGauge gauge;
    gauge.frame = f;
    gauge.prior.T_W_I = problem->frames[f].state.T_W_I;
    gauge.prior.tilt = !inertial[part];
    problem->gauges.push_back(gauge);
  }
}

void addMotionPriors(BaProblem* problem) {
  std::vector<char> reached(problem->frames.size(), 0);
  for (const BaImu& f : problem->imu) reached[f.j] = 1;
  for (std::size_t f = 0; f < problem->frames.size(); ++f) {
    const BaFrame& frame = problem->frames[f];
    if (frame.fixed || reached[f]) continue;
    BaMotionPrior prior;
    prior.frame = static_cast<int>(f);
    prior.prior.v_W = frame.state.v_W;
    prior.prior.bias_gyro = frame.state.bias_gyro;
    prior.prior.bias_accel = frame.state.bias_accel;
    problem->motion_priors.push_back(prior);
  }
}

}  // namespace vip_slam
