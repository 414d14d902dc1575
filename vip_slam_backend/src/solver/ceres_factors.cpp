// SPDX-License-Identifier: BSD-3-Clause
#include "ceres_factors.h"

#include "vip_slam_backend/factors/plane_prior.h"
#include "vip_slam_backend/factors/point_to_plane.h"
#include "vip_slam_backend/factors/relative_pose.h"
#include "vip_slam_backend/factors/reprojection.h"

namespace vip_slam {
namespace {

template <int R, int C>
using RowMajor = Eigen::Matrix<double, R, C, C == 1 ? Eigen::ColMajor : Eigen::RowMajor>;

FrameGeometry frameOf(const double* x, const SE3& T_I_C) { return FrameGeometry(poseOf(x), T_I_C); }

// Tangent (rows x 6) into the ambient row-major rows x 7 of the lifted pose manifold.
template <int R, class Derived>
void writePose(double* jacobian, const Eigen::MatrixBase<Derived>& J) {
  if (!jacobian) return;
  Eigen::Map<RowMajor<R, 7>> out(jacobian);
  out.template leftCols<6>() = J;
  out.col(6).setZero();
}

template <int R, class Derived>
void writePlane(double* jacobian, const Eigen::MatrixBase<Derived>& J, const Eigen::Matrix<double, 3, 2>& basis) {
  if (!jacobian) return;
  Eigen::Map<RowMajor<R, 4>> out(jacobian);
  out.template leftCols<3>() = J.template leftCols<2>() * basis.transpose();
  out.col(3) = J.col(2);
}

class ReprojectionCost : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  ReprojectionCost(const SE3& T_I_C, const BaObservation& o) : T_I_C_(T_I_C), o_(o) {}
  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    Eigen::Vector2d r = Eigen::Vector2d::Zero();
    Eigen::Matrix<double, 2, 6> Jx = Eigen::Matrix<double, 2, 6>::Zero();
    Eigen::Matrix<double, 2, 3> Jp = Eigen::Matrix<double, 2, 3>::Zero();
    reprojectionResidual(frameOf(x[0], T_I_C_), Eigen::Map<const Eigen::Vector3d>(x[1]), Eigen::Vector2d(o_.x, o_.y),
                         o_.weight, &r, J ? &Jx : nullptr, J ? &Jp : nullptr);
    Eigen::Map<Eigen::Vector2d>(residuals, 2) = r;
    if (J) {
      writePose<2>(J[0], Jx);
      if (J[1]) Eigen::Map<RowMajor<2, 3>>(J[1], 2, 3) = Jp;
    }
    return true;
  }

 private:
  SE3 T_I_C_;
  BaObservation o_;
};

class ReprojectionDepthCost : public ceres::SizedCostFunction<3, 7, 3> {
 public:
  ReprojectionDepthCost(const SE3& T_I_C, const BaObservation& o) : T_I_C_(T_I_C), o_(o) {}
  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    Eigen::Map<Eigen::Vector3d> r(residuals);
    r.setZero();
    const FrameGeometry frame = frameOf(x[0], T_I_C_);
    const Eigen::Map<const Eigen::Vector3d> p(x[1]);
    Eigen::Matrix<double, 3, 6> Jx = Eigen::Matrix<double, 3, 6>::Zero();
    Eigen::Matrix<double, 3, 3> Jp = Eigen::Matrix<double, 3, 3>::Zero();
    Eigen::Vector2d pixel;
    Eigen::Matrix<double, 2, 6> J2x;
    Eigen::Matrix<double, 2, 3> J2p;
    if (reprojectionResidual(frame, p, Eigen::Vector2d(o_.x, o_.y), o_.weight, &pixel, J ? &J2x : nullptr,
                             J ? &J2p : nullptr)) {
      Eigen::Matrix<double, 1, 6> J1x;
      Eigen::Matrix<double, 1, 3> J1p;
      r.head<2>() = pixel;
      r(2) = depthResidual(frame, p, o_.depth, o_.depth_weight, J ? &J1x : nullptr, J ? &J1p : nullptr);
      if (J) {
        Jx << J2x, J1x;
        Jp << J2p, J1p;
      }
    }
    if (J) {
      writePose<3>(J[0], Jx);
      if (J[1]) Eigen::Map<RowMajor<3, 3>>(J[1], 3, 3) = Jp;
    }
    return true;
  }

 private:
  SE3 T_I_C_;
  BaObservation o_;
};

class DepthCost : public ceres::SizedCostFunction<1, 7, 3> {
 public:
  DepthCost(const SE3& T_I_C, const BaObservation& o) : T_I_C_(T_I_C), o_(o) {}
  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    const FrameGeometry frame = frameOf(x[0], T_I_C_);
    const Eigen::Map<const Eigen::Vector3d> p(x[1]);
    Eigen::Matrix<double, 1, 6> Jx = Eigen::Matrix<double, 1, 6>::Zero();
    Eigen::Matrix<double, 1, 3> Jp = Eigen::Matrix<double, 1, 3>::Zero();
    // Switched off together with the pixel rows of the same observation.
    const bool in_front = frame.R_C_W.row(2).dot(p - frame.t_W_C) >= kMinProjectionDepth;
    residuals[0] =
        in_front ? depthResidual(frame, p, o_.depth, o_.depth_weight, J ? &Jx : nullptr, J ? &Jp : nullptr) : 0;
    if (J) {
      writePose<1>(J[0], Jx);
      if (J[1]) Eigen::Map<Eigen::Matrix<double, 1, 3, Eigen::RowMajor>>(J[1], 1, 3) = Jp;
    }
    return true;
  }

 private:
  SE3 T_I_C_;
  BaObservation o_;
};

class ImuCost : public ceres::SizedCostFunction<15, 7, 9, 7, 9> {
 public:
  ImuCost(std::shared_ptr<const Preintegration> p, const Eigen::Vector3d& g)
      : preintegration_(std::move(p)), gravity_(g) {}
  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    NavState state[2];
    for (int s = 0; s < 2; ++s) {
      const double *pose = x[2 * s], *motion = x[2 * s + 1];
      state[s].T_W_I = poseOf(pose);
      state[s].v_W = Eigen::Map<const Eigen::Vector3d>(motion);
      state[s].bias_gyro = Eigen::Map<const Eigen::Vector3d>(motion + 3);
      state[s].bias_accel = Eigen::Map<const Eigen::Vector3d>(motion + 6);
    }
    Matrix15d Js[2];
    Eigen::Map<Eigen::Matrix<double, 15, 1>>(residuals, 15) =
        preintegration_->residual(state[0], state[1], gravity_, J ? &Js[0] : nullptr, J ? &Js[1] : nullptr);
    if (J)
      for (int s = 0; s < 2; ++s) {
        writePose<15>(J[2 * s], Js[s].leftCols<6>());
        if (J[2 * s + 1]) Eigen::Map<RowMajor<15, 9>>(J[2 * s + 1], 15, 9) = Js[s].rightCols<9>();
      }
    return true;
  }

 private:
  std::shared_ptr<const Preintegration> preintegration_;
  Eigen::Vector3d gravity_;
};

// R rows times vec(H): the compressed factor (9, rows L^T) or one pair (2, C_l).
template <int R>
class HomographyCost : public ceres::SizedCostFunction<R, 7, 7, 4> {
 public:
  HomographyCost(const SE3& T_I_C_i, const SE3& T_I_C_j, const Eigen::Matrix<double, R, 9>& rows)
      : T_I_C_i_(T_I_C_i), T_I_C_j_(T_I_C_j), rows_(rows) {}
  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    const Plane plane = planeOf(x[2]);
    Eigen::Matrix<double, 3, 2> basis;
    HomographyJacobian Jh;
    if (J) basis = tangentBasis(plane.n);
    Eigen::Map<Eigen::Matrix<double, R, 1>>(residuals, R) =
        rows_ * homographyVector(frameOf(x[0], T_I_C_i_), frameOf(x[1], T_I_C_j_), plane, &basis, J ? &Jh : nullptr);
    if (J) {
      const Eigen::Matrix<double, R, 15> LJ = rows_ * Jh;
      writePose<R>(J[0], LJ.template middleCols<6>(0));
      writePose<R>(J[1], LJ.template middleCols<6>(6));
      writePlane<R>(J[2], LJ.template middleCols<3>(12), basis);
    }
    return true;
  }

 private:
  SE3 T_I_C_i_, T_I_C_j_;
  Eigen::Matrix<double, R, 9> rows_;
};

template <int R>
class PointToPlaneCost : public ceres::SizedCostFunction<R, 7, 4> {
 public:
  PointToPlaneCost(const SE3& T_I_C, const Eigen::Matrix<double, R, 4>& rows) : T_I_C_(T_I_C), rows_(rows) {}
  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    const Plane plane = planeOf(x[1]);
    Eigen::Matrix<double, 3, 2> basis;
    PlaneInCameraJacobian Ju;
    if (J) basis = tangentBasis(plane.n);
    Eigen::Map<Eigen::Matrix<double, R, 1>>(residuals, R) =
        rows_ * planeInCamera(frameOf(x[0], T_I_C_), plane, &basis, J ? &Ju : nullptr);
    if (J) {
      const Eigen::Matrix<double, R, 9> LJ = rows_ * Ju;
      writePose<R>(J[0], LJ.template leftCols<6>());
      writePlane<R>(J[1], LJ.template rightCols<3>(), basis);
    }
    return true;
  }

 private:
  SE3 T_I_C_;
  Eigen::Matrix<double, R, 4> rows_;
};

class PlanePriorCost : public ceres::SizedCostFunction<2, 4> {
 public:
  PlanePriorCost(PlaneKind kind, double weight) : kind_(kind), weight_(weight) {}
  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    const Plane plane = planeOf(x[0]);
    const Eigen::Matrix<double, 3, 2> basis = tangentBasis(plane.n);
    Eigen::Matrix<double, 2, 3> Jp;
    Eigen::Map<Eigen::Vector2d>(residuals, 2) = planePriorResidual(kind_, plane, weight_, &basis, &Jp);
    if (J) writePlane<2>(J[0], Jp, basis);
    return true;
  }

 private:
  PlaneKind kind_;
  double weight_;
};

class RelativePoseCost : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  explicit RelativePoseCost(const BaRelativePose& f) : f_(f) {}
  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    Matrix6d J_i, J_j;
    Eigen::Map<Vector6d>(residuals, 6) =
        f_.sqrt_information *
        relativePoseResidual(poseOf(x[0]), poseOf(x[1]), f_.T_i_j, J ? &J_i : nullptr, J ? &J_j : nullptr);
    if (J) {
      writePose<6>(J[0], f_.sqrt_information * J_i);
      writePose<6>(J[1], f_.sqrt_information * J_j);
    }
    return true;
  }

 private:
  BaRelativePose f_;
};

class GaugeCost : public ceres::SizedCostFunction<6, 7> {
 public:
  explicit GaugeCost(const GaugePrior& prior) : prior_(prior) {}
  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    Matrix6d Jx;
    Eigen::Map<Vector6d>(residuals, 6) = gaugeResidual(prior_, poseOf(x[0]), J ? &Jx : nullptr);
    if (J) writePose<6>(J[0], Jx);
    return true;
  }

 private:
  GaugePrior prior_;
};

class MotionPriorCost : public ceres::SizedCostFunction<9, 9> {
 public:
  explicit MotionPriorCost(const MotionPrior& prior) : prior_(prior) {}
  bool Evaluate(double const* const* x, double* residuals, double** J) const override {
    NavState state;
    state.v_W = Eigen::Map<const Eigen::Vector3d>(x[0]);
    state.bias_gyro = Eigen::Map<const Eigen::Vector3d>(x[0] + 3);
    state.bias_accel = Eigen::Map<const Eigen::Vector3d>(x[0] + 6);
    Eigen::Map<Eigen::Matrix<double, 9, 1>>(residuals, 9) = motionPriorResidual(prior_, state);
    if (J && J[0]) Eigen::Map<RowMajor<9, 9>>(J[0], 9, 9) = motionPriorWeights(prior_).asDiagonal().toDenseMatrix();
    return true;
  }

 private:
  MotionPrior prior_;
};

}  // namespace

ceres::CostFunction* makeReprojectionCost(const SE3& T_I_C, const BaObservation& o, bool with_depth) {
  if (with_depth) return new ReprojectionDepthCost(T_I_C, o);
  return new ReprojectionCost(T_I_C, o);
}
ceres::CostFunction* makeDepthCost(const SE3& T_I_C, const BaObservation& o) { return new DepthCost(T_I_C, o); }
ceres::CostFunction* makeImuCost(std::shared_ptr<const Preintegration> preintegration, const Eigen::Vector3d& gravity) {
  return new ImuCost(std::move(preintegration), gravity);
}
ceres::CostFunction* makeHomographyCost(const SE3& T_I_C_i, const SE3& T_I_C_j, const Matrix9d& G) {
  Matrix9d rows;
  decomposeHomography(G, &rows);
  return new HomographyCost<9>(T_I_C_i, T_I_C_j, rows);
}
ceres::CostFunction* makeHomographyPairCost(const SE3& T_I_C_i, const SE3& T_I_C_j, const HomographyPair& pair) {
  return new HomographyCost<2>(T_I_C_i, T_I_C_j, homographyRows(pair));
}
ceres::CostFunction* makePointToPlaneCost(const SE3& T_I_C, const Eigen::Matrix4d& G) {
  Eigen::Matrix4d rows;
  decomposePointToPlane(G, &rows);
  return new PointToPlaneCost<4>(T_I_C, rows);
}
ceres::CostFunction* makePlaneSampleCost(const SE3& T_I_C, const Eigen::Vector3d& p_C, double weight) {
  return new PointToPlaneCost<1>(T_I_C, weight * p_C.homogeneous().transpose());
}
ceres::CostFunction* makePlanePriorCost(PlaneKind kind, double weight) { return new PlanePriorCost(kind, weight); }
ceres::CostFunction* makeRelativePoseCost(const BaRelativePose& factor) { return new RelativePoseCost(factor); }
ceres::CostFunction* makeGaugeCost(const GaugePrior& prior) { return new GaugeCost(prior); }
ceres::CostFunction* makeMotionPriorCost(const MotionPrior& prior) { return new MotionPriorCost(prior); }

}  // namespace vip_slam
