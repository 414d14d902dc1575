// Central differences for the tests of analytic Jacobians.
#pragma once

#include <functional>

#include <Eigen/Core>

namespace vip_slam::testing {

/// d f / d delta at delta = 0, column by column; f takes a perturbation of size `dimension`.
template <class F>
Eigen::MatrixXd numericJacobian(F&& f, int dimension, double step = 1e-6) {
  Eigen::VectorXd delta = Eigen::VectorXd::Zero(dimension);
  Eigen::MatrixXd J;
  for (int k = 0; k < dimension; ++k) {
    delta[k] = step;
    const Eigen::VectorXd plus = f(delta);
    delta[k] = -step;
    const Eigen::VectorXd minus = f(delta);
    delta[k] = 0;
    if (k == 0) J.resize(plus.size(), dimension);
    J.col(k) = (plus - minus) / (2 * step);
  }
  return J;
}

/// max |a - b| / max(1, max |b|)
inline double relativeError(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return (a - b).cwiseAbs().maxCoeff() / std::max(1.0, b.cwiseAbs().maxCoeff());
}

}  // namespace vip_slam::testing
