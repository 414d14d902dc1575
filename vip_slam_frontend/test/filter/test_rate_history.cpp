// SPDX-License-Identifier: BSD-3-Clause
// Separates the body's rotation from the gyro's noise.
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "vip_slam_frontend/filter/rate_history.h"

namespace vip_slam {
namespace {

// At any image and IMU rate noise is not mistaken for motion, nor motion for noise.
TEST(RateHistory, TellsMotionFromNoise) {
  const double rates[][2] = {{30, 200}, {30, 1000}, {90, 200}, {60, 100}, {50, 100}};  // images, IMU
  for (const auto& [images, imu] : rates) {
    for (const bool moves : {false, true}) {
      std::mt19937 random(5);
      std::normal_distribution<double> noise(0.0, 1e-4 * std::sqrt(imu));
      const auto rate = [&](double t) { return Eigen::Vector3d((moves ? 0.5 : 0.001) * std::sin(6 * t), 0.02, -0.1); };
      RateHistory history;
      std::vector<ImuSample> all;
      for (int i = 0; i < 6 * imu; ++i) {
        all.emplace_back();
        all.back().t = (i + 0.3) / imu;
        all.back().gyro = rate(all.back().t) + Eigen::Vector3d(noise(random), noise(random), noise(random));
      }
      std::size_t next = 1;
      const auto at = [&](double t) {
        while (all[next].t < t) ++next;
        const ImuSample &a = all[next - 1], &b = all[next];
        ImuSample s = a;
        s.t = t;
        s.gyro = a.gyro + (t - a.t) / (b.t - a.t) * (b.gyro - a.gyro);
        return s;
      };
      int told = 0, checked = 0;
      for (int k = 1; k / images < 5; ++k) {
        std::vector<ImuSample> samples = {at(k / images)};
        while (all[next].t < (k + 1) / images) samples.push_back(all[next++]);
        samples.push_back(at((k + 1) / images));
        history.add(samples);
        if (k / images < 2) continue;
        ++checked;
        told += history.changes();
      }
      const std::string name = std::to_string(int(images)) + " Hz and " + std::to_string(int(imu)) + " Hz";
      if (moves) {
        EXPECT_EQ(told, checked) << name;
      } else {
        EXPECT_EQ(told, 0) << name;
      }
    }
  }
}

}  // namespace
}  // namespace vip_slam
