// SPDX-License-Identifier: BSD-3-Clause
// From a problem to the plain arrays that the kernels of the structured solver read.
#include <algorithm>

#include "structured_solver.h"

namespace vip_slam {
namespace {

void copyRowMajor(const Eigen::Matrix3d& M, double* out) {
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(out, 3, 3) = M;
}

// Stores a matrix, row by row, in one lane.
template <typename Derived>
void storeRows(const Eigen::MatrixBase<Derived>& expression, double* rows) {
  const typename Derived::PlainObject M = expression;
  for (int r = 0; r < M.rows(); ++r)
    for (int c = 0; c < M.cols(); ++c) rows[kKernelLanes * (r * M.cols() + c)] = M(r, c);
}

}  // namespace

void StructuredSolver::prepare(const BaProblem& problem) {
  loaded_ = false;
  structure_.update(problem);
  const SparseCholesky& cholesky = structure_.cholesky;
  observations_.resize(structure_.sorted.size());
  for (std::size_t o = 0; o < observations_.size(); ++o) observations_[o] = problem.observations[structure_.sorted[o]];
  values_.resize(cholesky.valueCount() + 8);
  for (auto* v : {&gradient_, &full_gradient_, &diagonal_, &damping_, &step_}) v->assign(cholesky.dimension(), 0.0);
  W_.resize(24 * observations_.size());
  points_.resize(3 * problem.points.size());
  point_step_.resize(points_.size());
  point_gradient_.resize(points_.size());
  point_damping_.resize(points_.size());
  point_system_.resize(2 * points_.size());
  shared_extrinsics_ = true;
  for (const BaFrame& f : problem.frames)
    shared_extrinsics_ &= f.T_I_C.R() == problem.frames[0].T_I_C.R() && f.T_I_C.t() == problem.frames[0].T_I_C.t();
  packHomographies(problem);
  packPointToPlane(problem);
  packImu(problem);
  for (KernelArray& sums : frame_sums_) sums.resize(kFrameSums * problem.frames.size());
  eliminated_.resize(8 * problem.frames.size());
}

void StructuredSolver::packHomographies(const BaProblem& problem) {
  const std::size_t count = problem.homographies.size();
  const std::size_t batches = (count + kKernelLanes - 1) / kKernelLanes;
  homographies_.resize(batches * kKernelLanes);
  homography_sums_.assign(24 * homographies_.size(), 0.0);
  for (std::size_t k = 0; k < homographies_.size(); ++k) {
    const BaHomography& f = problem.homographies[std::min(k, count - 1)];
    const SystemStructure::TriplePlaces& place = structure_.homographies[std::min(k, count - 1)];
    homographies_[k] = {f.i,
                        f.j,
                        f.plane,
                        place.ji.transposed,
                        place.pi.transposed,
                        place.pj.transposed,
                        place.ji.offset,
                        place.pi.offset,
                        place.pj.offset};
    double* sums = homography_sums_.data() + 24 * kKernelLanes * (k / kKernelLanes) + k % kKernelLanes;
    for (int s = 0; s < 24; ++s) sums[kKernelLanes * s] = f.sums[s];
  }
}

void StructuredSolver::packPointToPlane(const BaProblem& problem) {
  const std::size_t count = problem.point_to_plane.size();
  point_to_plane_.resize((count + kKernelLanes - 1) / kKernelLanes * kKernelLanes);
  point_to_plane_sums_.resize(10 * point_to_plane_.size());
  for (std::size_t k = 0; k < point_to_plane_.size(); ++k) {
    const BaPointToPlane& f = problem.point_to_plane[std::min(k, count - 1)];
    const BlockPlace& place = structure_.point_to_plane[std::min(k, count - 1)];
    point_to_plane_[k] = {f.frame, f.plane, place.transposed, place.offset};
    double* sums = point_to_plane_sums_.data() + 10 * kKernelLanes * (k / kKernelLanes) + k % kKernelLanes;
    for (int r = 0; r < 3; ++r)
      for (int c = r; c < 3; ++c, sums += kKernelLanes) *sums = f.G(r, c);
    for (int r = 0; r < 4; ++r, sums += kKernelLanes) *sums = f.G(r, 3);
  }
}

void StructuredSolver::packImu(const BaProblem& problem) {
  const std::size_t count = problem.imu.size();
  imu_.resize((count + kKernelLanes - 1) / kKernelLanes * kKernelLanes);
  imu_constants_.resize(kImuConstantRows * imu_.size());
  imu_states_.assign(kImuStateRows * imu_.size(), 0.0);
  const SparseCholesky& cholesky = structure_.cholesky;
  for (std::size_t k = 0; k < imu_.size(); ++k) {
    const BaImu& f = problem.imu[std::min(k, count - 1)];
    const auto& place = structure_.imu[std::min(k, count - 1)].place;
    KernelImu& out = imu_[k];
    out.i = f.i;
    out.j = f.j;
    const int nodes[4] = {structure_.pose_node[f.i], structure_.motion_node[f.i], structure_.pose_node[f.j],
                          structure_.motion_node[f.j]};
    for (int n = 0; n < 4; ++n) {
      out.diagonal[n] = nodes[n] < 0 ? -1 : static_cast<std::int64_t>(cholesky.diagonalOffset(nodes[n]));
      out.unknown[n] = nodes[n] < 0 ? 0 : cholesky.unknown(nodes[n]);
    }
    const auto at = [&](int row, int column) {
      return KernelImu::Place{place[row][column].offset, place[row][column].transposed};
    };
    out.motion_pose_i = at(1, 0), out.motion_pose_j = at(3, 2);
    out.pose_pose = at(2, 0), out.pose_motion = at(2, 1), out.motion_pose = at(3, 0), out.motion_motion = at(3, 1);

    double* rows = imu_constants_.data() + kImuConstantRows * kKernelLanes * (k / kKernelLanes) + k % kKernelLanes;
    const Preintegration& p = *f.preintegration;
    const Matrix15d& W = p.sqrtInformation();  // upper-triangular
    for (int r = 0; r < 15; ++r)
      for (int c = 0; c <= r; ++c)
        rows[kKernelLanes * (kImuInformation + r * (r + 1) / 2 + c)] = W.col(r).head(c + 1).dot(W.col(c).head(c + 1));
    storeRows(p.J_alpha_bg(), rows + kKernelLanes * kImuAlphaBg);
    storeRows(p.J_alpha_ba(), rows + kKernelLanes * kImuAlphaBa);
    storeRows(p.J_beta_bg(), rows + kKernelLanes * kImuBetaBg);
    storeRows(p.J_beta_ba(), rows + kKernelLanes * kImuBetaBa);
    rows[kKernelLanes * kImuDt] = p.dt();
    storeRows(p.J_theta_bg(), rows + kKernelLanes * kImuThetaByGyro);
    storeRows(p.alpha(), rows + kKernelLanes * kImuAlpha);
    storeRows(p.beta(), rows + kKernelLanes * kImuBeta);
    storeRows(Eigen::Quaterniond(p.deltaR()).coeffs(), rows + kKernelLanes * kImuDeltaQ);
    storeRows(p.biasGyro(), rows + kKernelLanes * kImuBiasGyro);
    storeRows(p.biasAccel(), rows + kKernelLanes * kImuBiasAccel);
  }
}

void StructuredSolver::loadImu(const BaProblem& problem) {
  imu_frames_.resize(kImuStateNumbers * problem.frames.size());
  for (std::size_t k = 0; k < problem.frames.size(); ++k) {
    const NavState& state = problem.frames[k].state;
    double* to = imu_frames_.data() + kImuStateNumbers * k;
    copyRowMajor(geometry_[k].R_W_I, to + kImuStateR);
    Eigen::Map<Eigen::Vector4d>(to + kImuStateQ) = state.T_W_I.rotation().coeffs();
    Eigen::Map<Eigen::Vector3d>(to + kImuStateP) = state.T_W_I.t();
    Eigen::Map<Eigen::Vector3d>(to + kImuStateV) = state.v_W;
    Eigen::Map<Eigen::Vector3d>(to + kImuStateBiasGyro) = state.bias_gyro;
    Eigen::Map<Eigen::Vector3d>(to + kImuStateBiasAccel) = state.bias_accel;
  }
  imuKernels(instruction_set_).load(imuArguments(problem), static_cast<int>(problem.imu.size()));
}

void StructuredSolver::loadFrames(const BaProblem& problem) {
  loaded_ = true;
  frames_.resize(problem.frames.size());
  geometry_.resize(problem.frames.size());
  for (std::size_t k = 0; k < frames_.size(); ++k) {
    const BaFrame& f = problem.frames[k];
    FrameGeometry& g = geometry_[k];
    g = FrameGeometry(f.state.T_W_I, f.T_I_C);
    KernelFrame& out = frames_[k];
    copyRowMajor(g.R_C_W, out.R_C_W);
    copyRowMajor(g.R_C_I, out.R_C_I);
    for (int r = 0; r < 3; ++r) {
      std::fill(out.turn[r], out.turn[r] + 8, 0.0);
      std::fill(out.move[r], out.move[r] + 8, 0.0);
      for (int c = 0; c < 3; ++c) out.turn[r][c] = g.R_C_I(r, c), out.move[r][3 + c] = -g.R_C_W(r, c);
    }
    Eigen::Map<Eigen::Vector3d>(out.t_W_I) = g.t_W_I;
    Eigen::Map<Eigen::Vector3d>(out.t_W_C) = g.t_W_C;
    copyRowMajor(g.R_C_I * hat(g.t_I_C), out.lever_C);
    Eigen::Map<Eigen::Vector3d>(out.offset_C) = g.R_C_I * g.t_I_C;
    const int node = structure_.pose_node[k];
    out.diagonal = node < 0 ? -1 : static_cast<std::int64_t>(structure_.cholesky.diagonalOffset(node));
    out.unknown = node < 0 ? 0 : structure_.cholesky.unknown(node);
  }
  for (std::size_t k = 0; k < problem.points.size(); ++k)
    Eigen::Map<Eigen::Vector3d>(points_.data() + 3 * k) = problem.points[structure_.point_at[k]].p_W;
  basis_.resize(problem.planes.size());
  planes_.resize(problem.planes.size());
  for (std::size_t k = 0; k < basis_.size(); ++k) {
    const Plane& plane = problem.planes[k].plane;
    basis_[k] = tangentBasis(plane.n);
    KernelPlane& out = planes_[k];
    Eigen::Map<Eigen::Vector3d>(out.n) = plane.n;
    out.d = plane.d;
    Eigen::Map<Eigen::Matrix<double, 3, 2, Eigen::RowMajor>>(out.basis) = basis_[k];
    const int node = structure_.plane_node[k];
    out.diagonal = static_cast<std::int64_t>(structure_.cholesky.diagonalOffset(node));
    out.unknown = structure_.cholesky.unknown(node);
  }
  loadImu(problem);
}

ImuKernelArguments StructuredSolver::imuArguments(const BaProblem& problem) {
  ImuKernelArguments a;
  a.factors = imu_.data();
  a.constants = imu_constants_.data();
  a.states = imu_states_.data();
  a.frames = imu_frames_.data();
  for (int k = 0; k < 3; ++k) a.gravity[k] = problem.gravity(k);
  return a;
}

HomographyKernelArguments StructuredSolver::homographyArguments() const {
  HomographyKernelArguments a;
  a.frames = frames_.data();
  a.planes = planes_.data();
  a.factors = homographies_.data();
  a.shared_extrinsics = shared_extrinsics_;
  a.sums = homography_sums_.data();
  return a;
}

PointToPlaneKernelArguments StructuredSolver::pointToPlaneArguments() {
  PointToPlaneKernelArguments a;
  a.frames = frames_.data();
  a.planes = planes_.data();
  a.factors = point_to_plane_.data();
  a.shared_extrinsics = shared_extrinsics_;
  a.sums = point_to_plane_sums_.data();
  a.values = values_.data();
  a.gradient = full_gradient_.data();
  return a;
}

PointKernelArguments StructuredSolver::arguments(const BaProblem& problem, double radius) {
  PointKernelArguments a;
  a.frames = frames_.data();
  a.frame_count = static_cast<int>(frames_.size());
  a.observations = observations_.data();
  a.first = structure_.first.data();
  a.points = points_.data();
  a.pair_offset = structure_.pair_offset.data();
  a.huber = problem.huber;
  a.depth_huber = problem.depth_huber;
  a.inverse_radius = 1.0 / radius;
  a.values = values_.data();
  a.eliminated = eliminated_.data();
  a.later_begin = structure_.first.data();
  a.later_end = a.later_begin + 1;
  a.W = W_.data();
  a.point_system = point_system_.data();
  a.point_gradient = point_gradient_.data();
  a.point_damping = point_damping_.data();
  return a;
}

}  // namespace vip_slam
