// SPDX-License-Identifier: BSD-3-Clause
// Relative motion from depth image registration, to evaluate and refine given poses.
#include <algorithm>
#include <cmath>

#include <Eigen/SparseCholesky>

#include "depth_registration.h"
#include "vip_slam_sim/io/pose_accuracy.h"

namespace vip_slam {
namespace {

constexpr std::size_t kPairs = 40;  ///< image pairs per lag

double rootMeanSquare(std::vector<double> squares) {
  // Leaves out the largest tenth, so that failed registrations do not count as errors of the poses.
  std::sort(squares.begin(), squares.end());
  squares.resize(squares.size() - squares.size() / 10);
  double sum = 0;
  for (const double s : squares) sum += s;
  return std::sqrt(sum / (3 * static_cast<double>(squares.size())));
}

/// The pose of each image's depth camera; false where the trajectory has none.
std::vector<bool> depthCameras(const RgbdFolder& folder, const Trajectory& T_W_C, std::vector<SE3>* T_W_D) {
  std::vector<bool> known;
  for (const RgbdFrame& frame : folder.frames) {
    SE3 T;
    known.push_back(poseAt(T_W_C, frame.t, &T));
    T_W_D->push_back(T * folder.T_color_depth);
  }
  return known;
}

/// First image at least `lag` seconds after image i; the number of images when there is none.
std::size_t after(const std::vector<RgbdFrame>& frames, std::size_t i, double lag) {
  std::size_t j = i + 1;
  while (j < frames.size() && frames[j].t - frames[i].t < 0.999 * lag) ++j;
  return j < frames.size() && frames[j].t - frames[i].t < 1.5 * lag + 0.01 ? j : frames.size();
}

/// A relative pose, from registration or from the given poses.
struct Edge {
  std::size_t a, b;
  SE3 T_b_a;
  PoseSigma sigma;
};

}  // namespace

std::vector<DepthDisagreement> posesAgainstDepth(const RgbdFolder& folder, const Trajectory& T_W_C,
                                                 const std::vector<double>& lags) {
  std::vector<SE3> T_W_D;
  const std::vector<bool> known = depthCameras(folder, T_W_C, &T_W_D);
  PoseRegistration registration(folder);
  std::vector<DepthDisagreement> out;
  const std::size_t stride = std::max<std::size_t>(1, folder.frames.size() / kPairs);
  for (const double lag : lags) {
    DepthDisagreement d;
    d.lag = lag;
    std::vector<double> rotation, position;
    for (std::size_t i = 0; i < folder.frames.size(); i += stride) {
      const std::size_t j = after(folder.frames, i, lag);
      if (j == folder.frames.size() || !known[i] || !known[j]) continue;
      const SE3 given = T_W_D[j].inverse() * T_W_D[i];
      SE3 found = given;
      PoseSigma own;
      if (!registration.align(i, j, &found, &own)) continue;
      rotation.push_back(logSO3((found * given.inverse()).rotation()).squaredNorm());
      position.push_back((found.inverse().t() - given.inverse().t()).squaredNorm());
    }
    if (rotation.size() >= 5) {
      d.pairs = static_cast<int>(rotation.size());
      d.error = {rootMeanSquare(rotation), rootMeanSquare(position)};
    }
    out.push_back(d);
  }
  return out;
}

Trajectory refinePoses(const RgbdFolder& folder, const PoseSigma& jitter, const PoseSigma& drift) {
  std::vector<SE3> T_W_D;
  const std::vector<bool> known = depthCameras(folder, folder.T_W_C, &T_W_D);
  const std::vector<SE3> given = T_W_D;
  PoseRegistration registration(folder);
  std::vector<Edge> edges;
  const PoseSigma near{1.5 * std::max(jitter.rotation, 1e-4), 1.5 * std::max(jitter.position, 1e-4)};
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (!known[i]) continue;
    // Neighbours keep their given relative motion unless the registrations contradict it.
    if (i + 1 < given.size() && known[i + 1]) edges.push_back({i, i + 1, given[i + 1].inverse() * given[i], near});
    std::size_t last = i;
    for (const double lag : {0.0, 0.1, 0.3, 1.0, 2.0}) {
      const std::size_t j = lag == 0 ? i + 1 : after(folder.frames, i, lag);
      if (j >= given.size() || j == last || !known[j]) continue;
      last = j;
      SE3 found = given[j].inverse() * given[i];
      PoseSigma own;
      if (!registration.align(i, j, &found, &own)) continue;
      // Depth sensors distort slightly, an error that the points' residuals do not show and that grows as the view
      // changes: 1 mrad and 1.5 mm, times 1 + 2 lag.
      const double warp = 1 + 2 * lag;
      edges.push_back({i, j, found, {std::hypot(own.rotation, 0.001 * warp), std::hypot(own.position, 0.0015 * warp)}});
    }
  }
  const auto size = static_cast<Eigen::Index>(6 * given.size());
  for (int n = 0; n < 15; ++n) {
    std::vector<Eigen::Triplet<double>> H;
    Eigen::VectorXd g = Eigen::VectorXd::Zero(size);
    const auto add = [&](std::size_t r, std::size_t c, const Matrix6d& block) {
      for (int y = 0; y < 6; ++y)
        for (int x = 0; x < 6; ++x)
          H.emplace_back(static_cast<int>(6 * r) + y, static_cast<int>(6 * c) + x, block(y, x));
    };
    const auto whiten = [](const PoseSigma& sigma) {
      Vector6d w;
      w << Eigen::Vector3d::Constant(1 / sigma.rotation), Eigen::Vector3d::Constant(1 / sigma.position);
      return w;
    };
    for (const Edge& e : edges) {
      // Each pose moves as T_W_D Exp(x); the residual is in a's frame.
      const SE3 T_b_a = T_W_D[e.b].inverse() * T_W_D[e.a];
      const Vector6d w = whiten(e.sigma);
      const Vector6d r = w.cwiseProduct((e.T_b_a.inverse() * T_b_a).log());
      const Matrix6d A = w.asDiagonal(), B = -(w.asDiagonal() * T_b_a.inverse().adjoint());
      const double robust = 1 / (1 + r.squaredNorm() / 12);
      add(e.a, e.a, robust * A.transpose() * A);
      add(e.a, e.b, robust * A.transpose() * B);
      add(e.b, e.a, robust * B.transpose() * A);
      add(e.b, e.b, robust * B.transpose() * B);
      g.segment<6>(static_cast<Eigen::Index>(6 * e.a)) += robust * A.transpose() * r;
      g.segment<6>(static_cast<Eigen::Index>(6 * e.b)) += robust * B.transpose() * r;
    }
    for (std::size_t i = 0; i < given.size(); ++i) {
      const Vector6d w = whiten(drift);
      const Vector6d r = w.cwiseProduct((given[i].inverse() * T_W_D[i]).log());
      add(i, i, Matrix6d(w.cwiseProduct(w).asDiagonal()));
      g.segment<6>(static_cast<Eigen::Index>(6 * i)) += w.cwiseProduct(r);
    }
    Eigen::SparseMatrix<double> information(size, size);
    information.setFromTriplets(H.begin(), H.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(information);
    if (solver.info() != Eigen::Success) break;
    const Eigen::VectorXd x = -solver.solve(g);
    for (std::size_t i = 0; i < given.size(); ++i)
      T_W_D[i] = T_W_D[i] * SE3::exp(x.segment<6>(static_cast<Eigen::Index>(6 * i)));
    if (x.lpNorm<Eigen::Infinity>() < 1e-7) break;
  }
  Trajectory out;
  for (std::size_t i = 0; i < given.size(); ++i)
    if (known[i]) out.push_back({folder.frames[i].t, T_W_D[i] * folder.T_color_depth.inverse()});
  return out;
}

}  // namespace vip_slam
