// SPDX-License-Identifier: BSD-3-Clause
// Random numbers that are the same on every machine, which the standard distributions do not guarantee.
#pragma once

#include <cmath>
#include <cstdint>

namespace vip_slam {

/// splitmix64 with uniform and normal deviates.
class Rng {
 public:
  explicit Rng(std::uint64_t seed) : state_(seed * 0x9E3779B97F4A7C15ull + 0xD1B54A32D192ED03ull) {}

  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ull);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return z ^ (z >> 31);
  }
  /// [0, 1[
  double uniform() { return static_cast<double>(next() >> 11) * 0x1.0p-53; }
  double uniform(double a, double b) { return a + (b - a) * uniform(); }
  int integer(int n) { return static_cast<int>(next() % static_cast<std::uint64_t>(n)); }
  double gauss() {
    if (have_spare_) {
      have_spare_ = false;
      return spare_;
    }
    double u = uniform();
    while (u <= 0) u = uniform();
    const double r = std::sqrt(-2 * std::log(u)), a = 6.283185307179586 * uniform();
    spare_ = r * std::sin(a);
    have_spare_ = true;
    return r * std::cos(a);
  }

 private:
  std::uint64_t state_;
  double spare_ = 0;
  bool have_spare_ = false;
};

}  // namespace vip_slam
