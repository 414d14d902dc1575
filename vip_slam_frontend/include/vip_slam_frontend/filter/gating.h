// Chi-square gate on measurement rows before they enter the filter.
#pragma once

#include <Eigen/Core>

namespace vip_slam {

/// Quantile of the chi-square distribution, probability in ]0, 1[, dof >= 1.
double chiSquareQuantile(double probability, int dof);

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
