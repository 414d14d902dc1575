// Chi-square gate on measurement rows before they enter the filter.
#pragma once

#include <Eigen/Core>

namespace vip_slam {

/// Quantile of the chi-square distribution, probability in ]0, 1[, dof >= 1.
double chiSquareQuantile(double probability, int dof);

/// r^T (H P H^T + I)^-1 r with P = R^-1 R^-T; H and r whitened.
double mahalanobis(const Eigen::MatrixXd& R, const Eigen::MatrixXd& H, const Eigen::VectorXd& r);

/// Remembers the quantiles of one probability.
class Gate {
 public:
  explicit Gate(double probability);
  double threshold(int dof) const;

 private:
  Eigen::VectorXd table_;
  double probability_;
};

}  // namespace vip_slam
