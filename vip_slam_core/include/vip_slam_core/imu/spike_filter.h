// Takes single wrong samples (a bus error, a flipped bit) out of an IMU's stream before anybody integrates it: 30 m/s^2
// for one sample of 5 ms is 15 cm/s that nothing in the noise figures allows for.
//
// A sample is wrong when it leaves the two before by far more than this IMU's samples lately differ from each other,
// and the sample after it is back where they were. It is replaced, both quantities, by the line between its neighbours.
// A shock lasts longer, rings, and spreads the differences; a vibration has them spread already.
//
// What looks ordinary passes at once; a suspect waits for the next sample. What comes out depends on the samples alone,
// not on when they arrive.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "vip_slam_core/imu/imu_types.h"

namespace vip_slam {

class SpikeFilter {
 public:
  /// Stamps must increase. Gives the samples that are settled now, in order: none while a suspect waits, both it and
  /// its successor afterwards. A quantity that is not measured is left at zero.
  std::vector<ImuSample> add(const ImuSample& sample);
  /// Stamp of the newest sample that was given, settled or not, s; minus infinity before the first.
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
    /// What three quarters of them stay below: an odd spike among them does not count.
    double usual() const;

   private:
    static constexpr std::size_t kWindow = 16;
    std::array<double, kWindow> ring_{};
    std::size_t count_ = 0;
  };

  bool suspicious(const ImuSample& sample) const;
  bool agree(const ImuSample& a, const ImuSample& b) const;
  void remember(const ImuSample& sample);

  std::optional<ImuSample> last_;     ///< the newest that was settled
  std::optional<ImuSample> suspect_;  ///< after last_
  Differences gyro_, accel_;          ///< as they came, spikes and all
  bool calm_ = false;                 ///< last_ agrees with the one before: the flank and the top of a shock do not
  std::size_t spikes_ = 0;
};

}  // namespace vip_slam
