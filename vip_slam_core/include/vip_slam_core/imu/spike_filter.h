// SPDX-License-Identifier: BSD-3-Clause
// Replaces single wrong samples (a bus error, a flipped bit) of an IMU's stream before integration: 30 m/s^2 during one
// sample of 5 ms is 15 cm/s, far beyond the noise model.
//
// A sample is wrong when it differs from the two before by far more than this IMU's samples have recently differed from
// each other, and the sample after it agrees with those before. Both its gyro and accelerometer values are replaced by
// interpolation between its neighbours. A shock lasts longer and rings, which raises the usual differences; with a
// vibration they are large already.
//
// An ordinary sample passes at once; a suspect waits for the next sample. The output depends on the samples alone, not
// on when they arrive.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "vip_slam_core/imu/imu_types.h"

namespace vip_slam {

class SpikeFilter {
 public:
  /// Stamps must increase. Returns the samples that are decided now, in order: none while a suspect waits, both it and
  /// its successor afterwards. A quantity that is not measured is left at zero.
  std::vector<ImuSample> add(const ImuSample& sample);
  /// Stamp of the newest sample added, decided or not, s; minus infinity before the first.
  double newest() const;
  std::size_t spikes() const { return spikes_; }
  /// Forgets the stream; the count stays.
  void clear();

 private:
  /// The differences between the newest samples of one quantity.
  class Differences {
   public:
    void add(double difference);
    void clear() { count_ = 0; }
    bool full() const { return count_ >= kWindow; }
    /// Their upper quartile, which an occasional spike does not affect.
    double usual() const;

   private:
    static constexpr std::size_t kWindow = 16;
    std::array<double, kWindow> ring_{};
    std::size_t count_ = 0;
  };

  bool suspicious(const ImuSample& sample) const;
  bool agree(const ImuSample& a, const ImuSample& b) const;
  void remember(const ImuSample& sample);

  std::optional<ImuSample> last_;     ///< the newest decided sample
  std::optional<ImuSample> suspect_;  ///< the sample after last_, waiting for the next
  Differences gyro_, accel_;          ///< of the raw samples, including spikes
  bool calm_ = false;                 ///< last_ agrees with the one before; not so at the flank and peak of a shock
  std::size_t spikes_ = 0;
};

}  // namespace vip_slam
