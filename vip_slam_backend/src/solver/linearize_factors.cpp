// The factors that are no points: IMU, planes, priors. Each adds J^T J and J^T r to the blocks of the reduced system.
#include "structured_solver.h"
#include "vip_slam_backend/factors/plane_prior.h"
#include "vip_slam_backend/factors/point_to_plane.h"

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

void StructuredSolver::linearizeImu(const BaProblem& problem) {
  const NodeSums sums{structure_.cholesky, values_.data(), full_gradient_.data()};
  using RowMajor15x32 = Eigen::Matrix<double, 15, 32, Eigen::RowMajor>;
  Matrix15d J[2];
  alignas(64) double J_both[15 * 32] = {0}, H_both[30 * 32] = {0}, g_both[32];
  Eigen::Map<RowMajor15x32> both(J_both);
  for (std::size_t k = 0; k < problem.imu.size(); ++k) {
    const BaImu& f = problem.imu[k];
    const Matrix15d& W = f.preintegration->sqrtInformation();
    const Eigen::Matrix<double, 15, 1> r =
        W.triangularView<Eigen::Upper>() * f.preintegration->residual(problem.frames[f.i].state,
                                                                      problem.frames[f.j].state, problem.gravity, &J[0],
                                                                      &J[1], false);
    const int nodes[4] = {structure_.pose_node[f.i], structure_.motion_node[f.i], structure_.pose_node[f.j],
                          structure_.motion_node[f.j]};
    both.leftCols<15>() = J[0];
    both.middleCols<15>(15) = J[1];
    homographyKernels().gram(W.data(), J_both, r.data(), H_both, g_both);
    const Eigen::Map<const Eigen::Matrix<double, 32, 30>> H(H_both);  // its lower half is filled
    const Eigen::Map<const Eigen::Matrix<double, 32, 1>> g(g_both);
    const auto& place = structure_.imu[k].place;
    for (int s = 0; s < 2; ++s) {
      const int o = 15 * s;
      sums.add<6>(nodes[2 * s], H.block<6, 6>(o, o), g.segment<6>(o));
      sums.add<9>(nodes[2 * s + 1], H.block<9, 9>(o + 6, o + 6), g.segment<9>(o + 6));
      addBlock<9, 6>(values_.data(), place[2 * s + 1][2 * s], H.block<9, 6>(o + 6, o));
    }
    addBlock<6, 6>(values_.data(), place[2][0], H.block<6, 6>(15, 0));
    addBlock<6, 9>(values_.data(), place[2][1], H.block<6, 9>(15, 6));
    addBlock<9, 6>(values_.data(), place[3][0], H.block<9, 6>(21, 0));
    addBlock<9, 9>(values_.data(), place[3][1], H.block<9, 9>(21, 6));
  }
}

void StructuredSolver::linearizePlanes(const BaProblem& problem) {
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
  homographyKernels().linearize(a, static_cast<int>(problem.homographies.size()));
  for (std::size_t k = 0; k < problem.homography_pairs.size(); ++k) {
    const BaHomographyPair& f = problem.homography_pairs[k];
    const Vector9d h =
        homographyVector(geometry_[f.i], geometry_[f.j], problem.planes[f.plane].plane, &basis_[f.plane], &J);
    const Eigen::Matrix<double, 2, 9> C = homographyRows(f.pair);
    const Eigen::Matrix<double, 2, 15> CJ = C * J;
    H.noalias() = CJ.transpose() * CJ;
    addTriple(structure_.homography_pairs[k], f.i, f.j, f.plane, H, CJ.transpose() * (C * h));
  }
  PlaneInCameraJacobian Jp;
  Eigen::Matrix<double, 9, 9> Hp;
  const auto addPair = [&](const BlockPlace& place, int frame, int plane, const Eigen::Matrix<double, 9, 1>& g) {
    sums.add<6>(structure_.pose_node[frame], Hp.topLeftCorner<6, 6>(), g.head<6>());
    sums.add<3>(structure_.plane_node[plane], Hp.bottomRightCorner<3, 3>(), g.tail<3>());
    addBlock<3, 6>(values_.data(), place, Hp.bottomLeftCorner<3, 6>());
  };
  for (std::size_t k = 0; k < problem.point_to_plane.size(); ++k) {
    const BaPointToPlane& f = problem.point_to_plane[k];
    const Eigen::Vector4d u = planeInCamera(geometry_[f.frame], problem.planes[f.plane].plane, &basis_[f.plane], &Jp);
    const PlaneInCameraJacobian GJ = f.G * Jp;
    Hp.noalias() = Jp.transpose() * GJ;
    addPair(structure_.point_to_plane[k], f.frame, f.plane, GJ.transpose() * u);
  }
  for (std::size_t k = 0; k < problem.plane_points.size(); ++k) {
    const BaPlanePoint& f = problem.plane_points[k];
    const Eigen::Vector4d u = planeInCamera(geometry_[f.frame], problem.planes[f.plane].plane, &basis_[f.plane], &Jp);
    const Eigen::Vector4d p = f.weight * f.p_C.homogeneous();
    const Eigen::Matrix<double, 1, 9> row = p.transpose() * Jp;
    Hp.noalias() = row.transpose() * row;
    addPair(structure_.plane_points[k], f.frame, f.plane, row.transpose() * u.dot(p));
  }
}

void StructuredSolver::linearizePriors(const BaProblem& problem) {
  const NodeSums sums{structure_.cholesky, values_.data(), full_gradient_.data()};
  for (const BaGauge& f : problem.gauges) {
    Matrix6d J;
    const Vector6d r = gaugeResidual(f.prior, problem.frames[f.frame].state.T_W_I, &J);
    sums.add<6>(structure_.pose_node[f.frame], J.transpose() * J, J.transpose() * r);
  }
  for (const BaMotionPrior& f : problem.motion_priors) {
    const Eigen::Matrix<double, 9, 1> w = motionPriorWeights(f.prior);
    const Eigen::Matrix<double, 9, 1> r = motionPriorResidual(f.prior, problem.frames[f.frame].state);
    sums.add<9>(structure_.motion_node[f.frame], w.cwiseProduct(w).asDiagonal().toDenseMatrix(), w.cwiseProduct(r));
  }
  for (std::size_t p = 0; p < problem.planes.size(); ++p) {
    const BaPlane& plane = problem.planes[p];
    if (!(plane.prior_weight > 0) || plane.kind == PlaneKind::kGeneral) continue;
    Eigen::Matrix<double, 2, 3> J;
    const Eigen::Vector2d r = planePriorResidual(plane.kind, plane.plane, plane.prior_weight, &basis_[p], &J);
    sums.add<3>(structure_.plane_node[p], J.transpose() * J, J.transpose() * r);
  }
}

double StructuredSolver::factorCost(const BaProblem& problem) const {
  double cost = 0;
  for (const BaImu& f : problem.imu)
    cost +=
        f.preintegration->residual(problem.frames[f.i].state, problem.frames[f.j].state, problem.gravity).squaredNorm();
  cost += homographyKernels().cost(homographyArguments(), static_cast<int>(problem.homographies.size()));
  for (const BaHomographyPair& f : problem.homography_pairs)
    cost += (homographyRows(f.pair) * homographyVector(geometry_[f.i], geometry_[f.j], problem.planes[f.plane].plane))
                .squaredNorm();
  for (const BaPointToPlane& f : problem.point_to_plane) {
    const Eigen::Vector4d u = planeInCamera(geometry_[f.frame], problem.planes[f.plane].plane);
    cost += u.dot(f.G * u);
  }
  for (const BaPlanePoint& f : problem.plane_points) {
    const double r =
        f.weight * planeInCamera(geometry_[f.frame], problem.planes[f.plane].plane).dot(f.p_C.homogeneous());
    cost += r * r;
  }
  for (const BaGauge& f : problem.gauges)
    cost += gaugeResidual(f.prior, problem.frames[f.frame].state.T_W_I).squaredNorm();
  for (const BaMotionPrior& f : problem.motion_priors)
    cost += motionPriorResidual(f.prior, problem.frames[f.frame].state).squaredNorm();
  for (const BaPlane& p : problem.planes) cost += planePriorResidual(p.kind, p.plane, p.prior_weight).squaredNorm();
  return cost;
}

}  // namespace vip_slam
