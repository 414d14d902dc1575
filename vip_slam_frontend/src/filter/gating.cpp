// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/gating.h"

#include <boost/math/distributions/chi_squared.hpp>

namespace vip_slam {

double chiSquareQuantile(double probability, int dof) {
  return boost::math::quantile(boost::math::chi_squared(dof), probability);
}

Gate::Gate(double probability) : table_(200), probability_(probability) {
  for (int dof = 1; dof <= table_.size(); ++dof) table_(dof - 1) = chiSquareQuantile(probability, dof);
}

double Gate::threshold(int dof) const {
  if (dof <= 0) return 0;
  return dof <= table_.size() ? table_(dof - 1) : chiSquareQuantile(probability_, dof);
}

}  // namespace vip_slam
