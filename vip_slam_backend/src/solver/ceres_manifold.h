// SPDX-License-Identifier: BSD-3-Clause
// ceres::Manifold is there since Ceres 2.1. Before it (Ubuntu 20.04 has 1.14, 22.04 has 2.0) the same comes as a
// LocalParameterization, which needs no Minus.
#pragma once

#include <ceres/ceres.h>
#include <ceres/version.h>

#if CERES_VERSION_MAJOR > 2 || (CERES_VERSION_MAJOR == 2 && CERES_VERSION_MINOR >= 1)
#define VIP_SLAM_CERES_MANIFOLDS 1
#else
#define VIP_SLAM_CERES_MANIFOLDS 0
#endif

namespace vip_slam {

#if VIP_SLAM_CERES_MANIFOLDS
using CeresManifold = ceres::Manifold;

inline void setManifold(ceres::Problem* problem, double* block, CeresManifold* manifold) {
  problem->SetManifold(block, manifold);
}
#else
class CeresManifold : public ceres::LocalParameterization {
 public:
  virtual int AmbientSize() const = 0;
  virtual int TangentSize() const = 0;
  virtual bool PlusJacobian(const double* x, double* jacobian) const = 0;
  virtual bool Minus(const double* y, const double* x, double* y_minus_x) const = 0;
  virtual bool MinusJacobian(const double* x, double* jacobian) const = 0;

  int GlobalSize() const override { return AmbientSize(); }
  int LocalSize() const override { return TangentSize(); }
  bool ComputeJacobian(const double* x, double* jacobian) const override { return PlusJacobian(x, jacobian); }
};

inline void setManifold(ceres::Problem* problem, double* block, CeresManifold* manifold) {
  problem->SetParameterization(block, manifold);
}
#endif

}  // namespace vip_slam
