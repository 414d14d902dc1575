// SPDX-License-Identifier: BSD-3-Clause
// All factors except those of points: IMU, planes, priors. Each adds J^T J and J^T r to the blocks of the reduced
// system.
#include "structured_solver.h"
#include "vip_slam_backend/factors/plane_prior.h"
#include "vip_slam_backend/factors/point_to_plane.h"
#include "vip_slam_backend/factors/relative_pose.h"

namespace vip_slam {
namespace {

template <int R, int C>
void addBlock(double* values, const BlockPlace& place, const Eigen::Matrix<double, R, C>& block) {
  if (place.offset < 0) return;
  if (place.transposed) {
    Eigen::Map<Eigen::Matrix<double, C, R>, 0, Eigen::OuterStride<>>(
        values + place.offset, Eigen::OuterStride<>(SparseCholesky::leading(C))) += block.transpose();
  } else {
    Eigen::Map<Eigen::Matrix<double, R, C>, 0, Eigen::OuterStride<>>(
        values + place.offset, Eigen::OuterStride<>(SparseCholesky::leading(R))) += block;
  }
}

// Diagonal block and gradient of one node.
struct NodeSums {
  const SparseCholesky& cholesky;
  double *values, *gradient;

  template <int N>
  void add(int node, const Eigen::Matrix<double, N, N>& H, const Eigen::Matrix<double, N, 1>& g) const {
    if (node < 0) return;
    Eigen::Map<Eigen::Matrix<double, N, N>, 0, Eigen::OuterStride<>>(
        values + cholesky.diagonalOffset(node), Eigen::OuterStride<>(SparseCholesky::leading(N))) += H;
    const int u = cholesky.unknown(node);
    Eigen::Map<Eigen::Matrix<double, N, 1>>(gradient + u) += g;
  }
};

}  // namespace

// Computes the rotation residual's terms with trigonometric functions here, since the vectorised kernels have none.
double StructuredSolver::linearizeImu(const BaProblem& problem) {
  for (std::size_t k = 0; k < problem.imu.size(); ++k) {
    const Preintegration& p = *problem.imu[k].preintegration;
    double* rows = imu_states_.data() + kImuStateRows * kKernelLanes * (k / kKernelLanes) + k % kKernelLanes;
    Eigen::Vector3d r_theta;
    for (int c = 0; c < 3; ++c) r_theta(c) = rows[kKernelLanes * (kImuResidual + c)];
    const Eigen::Vector3d dbg = problem.frames[problem.imu[k].i].state.bias_gyro - p.biasGyro();
    const Eigen::Matrix3d Jr_inv = rightJacobianInverseSO3(r_theta);
    const Eigen::Matrix3d theta_bg = -expSO3(-r_theta) * rightJacobianSO3(p.J_theta_bg() * dbg) * p.J_theta_bg();
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) {
        rows[kKernelLanes * (kImuInverseJr + 3 * r + c)] = Jr_inv(r, c);
        rows[kKernelLanes * (kImuThetaBg + 3 * r + c)] = theta_bg(r, c);
      }
  }
  ImuKernelArguments a = imuArguments(problem);
  a.values = values_.data();
  a.gradient = full_gradient_.data();
  return imuKernels(instruction_set_).linearize(a, static_cast<int>(problem.imu.size()));
}

double StructuredSolver::linearizePlanes(const BaProblem& problem) {
  const NodeSums sums{structure_.cholesky, values_.data(), full_gradient_.data()};
  const auto addTriple = [&](const SystemStructure::TriplePlaces& place, int i, int j, int plane,
                             const Eigen::Matrix<double, 15, 15>& H, const Eigen::Matrix<double, 15, 1>& g) {
    sums.add<6>(structure_.pose_node[i], H.block<6, 6>(0, 0), g.segment<6>(0));
    sums.add<6>(structure_.pose_node[j], H.block<6, 6>(6, 6), g.segment<6>(6));
    sums.add<3>(structure_.plane_node[plane], H.block<3, 3>(12, 12), g.segment<3>(12));
    addBlock<6, 6>(values_.data(), place.ji, H.block<6, 6>(6, 0));
    addBlock<3, 6>(values_.data(), place.pi, H.block<3, 6>(12, 0));
    addBlock<3, 6>(values_.data(), place.pj, H.block<3, 6>(12, 6));
  };
  Eigen::Matrix<double, 15, 15> H;
  HomographyJacobian J;
  HomographyKernelArguments a = homographyArguments();
  a.values = values_.data();
  a.gradient = full_gradient_.data();
  double cost = homographyKernels(instruction_set_).linearize(a, static_cast<int>(problem.homographies.size()));
  cost += pointToPlaneKernels(instruction_set_)
              .linearize(pointToPlaneArguments(), static_cast<int>(problem.point_to_plane.size()));
  for (std::size_t k = 0; k < problem.homography_pairs.size(); ++k) {
    const BaHomographyPair& f = problem.homography_pairs[k];
    const Vector9d h =
        homographyVector(geometry_[f.i], geometry_[f.j], problem.planes[f.plane].plane, &basis_[f.plane], &J);
    const Eigen::Matrix<double, 2, 9> C = homographyRows(f.pair);
    const Eigen::Matrix<double, 2, 15> CJ = C * J;
    H.noalias() = CJ.transpose() * CJ;
    const Eigen::Vector2d r = C * h;
    cost += r.squaredNorm();
    addTriple(structure_.homography_pairs[k], f.i, f.j, f.plane, H, CJ.transpose() * r);
  }
  PlaneInCameraJacobian Jp;
  Eigen::Matrix<double, 9, 9> Hp;
  const auto addPair = [&](const BlockPlace& place, int frame, int plane, const Eigen::Matrix<double, 9, 1>& g) {
    sums.add<6>(structure_.pose_node[frame], Hp.topLeftCorner<6, 6>(), g.head<6>());
    sums.add<3>(structure_.plane_node[plane], Hp.bottomRightCorner<3, 3>(), g.tail<3>());
    addBlock<3, 6>(values_.data(), place, Hp.bottomLeftCorner<3, 6>());
  };
  for (std::size_t k = 0; k < problem.plane_samples.size(); ++k) {
    const BaPlaneSample& f = problem.plane_samples[k];
    const Eigen::Vector4d u = planeInCamera(geometry_[f.frame], problem.planes[f.plane].plane, &basis_[f.plane], &Jp);
    const Eigen::Vector4d p = f.weight * f.p_C.homogeneous();
    const Eigen::Matrix<double, 1, 9> row = p.transpose() * Jp;
    Hp.noalias() = row.transpose() * row;
    const double r = u.dot(p);
    cost += r * r;
    addPair(structure_.plane_samples[k], f.frame, f.plane, row.transpose() * r);
  }
  return cost;
}

double StructuredSolver::linearizeRelativePoses(const BaProblem& problem) {
  double cost = 0;
  const NodeSums sums{structure_.cholesky, values_.data(), full_gradient_.data()};
  Matrix6d J_i, J_j, block;
  for (std::size_t k = 0; k < problem.relative_poses.size(); ++k) {
    const BaRelativePose& f = problem.relative_poses[k];
    const auto U = f.sqrt_information.triangularView<Eigen::Upper>();
    Vector6d r =
        relativePoseResidual(problem.frames[f.i].state.T_W_I, problem.frames[f.j].state.T_W_I, f.T_i_j, &J_i, &J_j);
    r = U * r;
    J_i = U * J_i;
    J_j = U * J_j;
    cost += r.squaredNorm();
    block.noalias() = J_i.transpose() * J_i;
    sums.add<6>(structure_.pose_node[f.i], block, J_i.transpose() * r);
    block.noalias() = J_j.transpose() * J_j;
    sums.add<6>(structure_.pose_node[f.j], block, J_j.transpose() * r);
    block.noalias() = J_j.transpose() * J_i;
    addBlock<6, 6>(values_.data(), structure_.relative_poses[k], block);
  }
  return cost;
}

double StructuredSolver::linearizePriors(const BaProblem& problem) {
  double cost = 0;
  const NodeSums sums{structure_.cholesky, values_.data(), full_gradient_.data()};
  for (const BaGauge& f : problem.gauges) {
    Matrix6d J;
    const Vector6d r = gaugeResidual(f.prior, problem.frames[f.frame].state.T_W_I, &J);
    cost += r.squaredNorm();
    sums.add<6>(structure_.pose_node[f.frame], J.transpose() * J, J.transpose() * r);
  }
  for (const BaMotionPrior& f : problem.motion_priors) {
    const Eigen::Matrix<double, 9, 1> w = motionPriorWeights(f.prior);
    const Eigen::Matrix<double, 9, 1> r = motionPriorResidual(f.prior, problem.frames[f.frame].state);
    cost += r.squaredNorm();
    sums.add<9>(structure_.motion_node[f.frame], w.cwiseProduct(w).asDiagonal().toDenseMatrix(), w.cwiseProduct(r));
  }
  for (std::size_t p = 0; p < problem.planes.size(); ++p) {
    const BaPlane& plane = problem.planes[p];
    if (!(plane.prior_weight > 0) || plane.kind == PlaneKind::kGeneral) continue;
    Eigen::Matrix<double, 2, 3> J;
    const Eigen::Vector2d r = planePriorResidual(plane.kind, plane.plane, plane.prior_weight, &basis_[p], &J);
    cost += r.squaredNorm();
    sums.add<3>(structure_.plane_node[p], J.transpose() * J, J.transpose() * r);
  }
  return cost;
}

double StructuredSolver::factorCost(const BaProblem& problem) {
  double cost = 0;
  cost += imuKernels(instruction_set_).cost(imuArguments(problem), static_cast<int>(problem.imu.size()));
  cost +=
      homographyKernels(instruction_set_).cost(homographyArguments(), static_cast<int>(problem.homographies.size()));
  for (const BaHomographyPair& f : problem.homography_pairs)
    cost += (homographyRows(f.pair) * homographyVector(geometry_[f.i], geometry_[f.j], problem.planes[f.plane].plane))
                .squaredNorm();
  for (const BaPointToPlane& f : problem.point_to_plane) {
    const Eigen::Vector4d u = planeInCamera(geometry_[f.frame], problem.planes[f.plane].plane);
    cost += u.dot(f.G * u);
  }
  for (const BaPlaneSample& f : problem.plane_samples) {
    const double r =
        f.weight * planeInCamera(geometry_[f.frame], problem.planes[f.plane].plane).dot(f.p_C.homogeneous());
    cost += r * r;
  }
  for (const BaRelativePose& f : problem.relative_poses) {
    const Vector6d r = relativePoseResidual(problem.frames[f.i].state.T_W_I, problem.frames[f.j].state.T_W_I, f.T_i_j);
    cost += (f.sqrt_information.triangularView<Eigen::Upper>() * r).squaredNorm();
  }
  for (const BaGauge& f : problem.gauges)
    cost += gaugeResidual(f.prior, problem.frames[f.frame].state.T_W_I).squaredNorm();
  for (const BaMotionPrior& f : problem.motion_priors)
    cost += motionPriorResidual(f.prior, problem.frames[f.frame].state).squaredNorm();
  for (const BaPlane& p : problem.planes) cost += planePriorResidual(p.kind, p.plane, p.prior_weight).squaredNorm();
  return cost;
}

}  // namespace vip_slam
