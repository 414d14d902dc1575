// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/motion/vibration.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "vip_slam_sim/rng.h"

namespace vip_slam {
namespace {

struct Band {
  double middle, width;      ///< Hz, of a normal density
  double accel[3], gyro[3];  ///< root mean square, m/s^2 and rad/s
};

/// Measured spectra: the rotors' those of EuRoC V1_01_easy in flight (ADIS16448, from 20 Hz on), the hand's those of an
/// iPhone carried through an office (from 8 Hz on).
std::vector<Band> bandsOf(const std::string& kind) {
  if (kind == "rotors")
    return {{27.7, 0.7, {0.12, 0.25, 0.06}, {0.012, 0.004, 0.007}},
            {93, 6, {0.85, 0.32, 0.70}, {0.011, 0.038, 0.020}},
            {55, 20, {0.45, 0.25, 0.30}, {0.005, 0.009, 0.007}}};
  if (kind == "hand")
    return {{11, 2.5, {0.13, 0.05, 0.12}, {0.020, 0.042, 0.012}},
            {22, 5, {0.035, 0.015, 0.025}, {0.003, 0.005, 0.002}}};
  throw std::invalid_argument("vibration: '" + kind + "', expected rotors or hand");
}

constexpr int kTones = 16;  ///< of a band

}  // namespace

Vibration::Vibration(const std::string& kind, int seed) {
  Rng rng(static_cast<std::uint64_t>(seed) * 3571 + 23);
  const auto phases = [&] {
    const double x = rng.uniform(), y = rng.uniform(), z = rng.uniform();
    return Eigen::Vector3d(2 * M_PI * Eigen::Vector3d(x, y, z));
  };
  const double share = std::sqrt(2.0 / kTones);  // amplitude of one tone for a root mean square of 1 of all
  for (const Band& band : bandsOf(kind))
    for (int k = 0; k < kTones; ++k) {
      Tone tone;
      tone.omega = 2 * M_PI * std::max(band.middle + band.width * rng.gauss(), 0.3 * band.middle);
      tone.p = share / (tone.omega * tone.omega) * Eigen::Map<const Eigen::Vector3d>(band.accel);
      tone.turn = share / tone.omega * Eigen::Map<const Eigen::Vector3d>(band.gyro);
      tone.phase_p = phases();
      tone.phase_turn = phases();
      tones_.push_back(tone);
    }
}

VibrationState Vibration::at(double t) const {
  VibrationState s;
  s.p = s.v = s.a = s.turn = s.rate = s.acceleration = Eigen::Vector3d::Zero();
  const auto add = [t](const Tone& tone, const Eigen::Vector3d& amplitude, const Eigen::Vector3d& phase,
                       Eigen::Vector3d* x, Eigen::Vector3d* dx, Eigen::Vector3d* ddx) {
    for (int k = 0; k < 3; ++k) {
      const double sine = std::sin(tone.omega * t + phase[k]), cosine = std::cos(tone.omega * t + phase[k]);
      (*x)[k] += amplitude[k] * sine;
      (*dx)[k] += amplitude[k] * tone.omega * cosine;
      (*ddx)[k] -= amplitude[k] * tone.omega * tone.omega * sine;
    }
  };
  for (const Tone& tone : tones_) {
    add(tone, tone.p, tone.phase_p, &s.p, &s.v, &s.a);
    add(tone, tone.turn, tone.phase_turn, &s.turn, &s.rate, &s.acceleration);
  }
  return s;
}

}  // namespace vip_slam
