#include "vip_slam_frontend/filter/gating.h"

#include <cmath>

namespace vip_slam {

namespace {

/// Regularised lower incomplete gamma function P(a, x): series below a + 1, continued fraction (Lentz) above.
double gammaP(double a, double x) {
  if (x <= 0) return 0;
  const double scale = std::exp(-x + a * std::log(x) - std::lgamma(a));
  if (x < a + 1) {
    double term = 1.0 / a, sum = term;
    for (int k = 1; k < 1000 && term > 1e-16 * sum; ++k) {
      term *= x / (a + k);
      sum += term;
    }
    return sum * scale;
  }
  double b = x + 1 - a, c = 1e300, d = 1.0 / b, f = d;
  for (int k = 1; k < 1000; ++k) {
    const double an = -k * (k - a);
    b += 2;
    d = 1.0 / (an * d + b);
    c = b + an / c;
    const double step = c * d;
    f *= step;
    if (std::abs(step - 1) < 1e-15) break;
  }
  return 1.0 - scale * f;
}

}  // namespace

double chiSquareQuantile(double probability, int dof) {
  double low = 0, high = dof + 10.0;
  while (gammaP(0.5 * dof, 0.5 * high) < probability) high *= 2;
  for (int i = 0; i < 100 && high - low > 1e-10 * high; ++i) {
    const double middle = 0.5 * (low + high);
    (gammaP(0.5 * dof, 0.5 * middle) < probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

Gate::Gate(double probability) : table_(200), probability_(probability) {
  for (int dof = 1; dof <= table_.size(); ++dof) table_(dof - 1) = chiSquareQuantile(probability, dof);
}

double Gate::threshold(int dof) const {
  if (dof <= 0) return 0;
  return dof <= table_.size() ? table_(dof - 1) : chiSquareQuantile(probability_, dof);
}

}  // namespace vip_slam
