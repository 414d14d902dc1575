// Drops single samples of an IMU stream whose stamp is too late: taken as they are, one of them would make all samples
// up to its stamp out of order, a gap of that length. A sample that comes after a gap, or is the first of all, waits
// for the next one, which tells a wrong stamp (the next one's lies before it) from a true gap.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "vip_slam_core/imu/imu_types.h"

namespace vip_slam {

class StampFilter {
 public:
  explicit StampFilter(double gap_seconds) : gap_seconds_(gap_seconds) {}

  /// `sample` must be later than newest() and differ from waiting(). Returns the samples that are decided now, in
  /// order.
  std::vector<ImuSample> add(const ImuSample& sample);
  /// Stamp of the newest decided sample, s; minus infinity before the first.
  double newest() const { return newest_; }
  /// Stamp of the sample that waits, if there is one.
  std::optional<double> waiting() const { return waits_ ? std::optional<double>(waits_->t) : std::nullopt; }
  std::size_t dropped() const { return dropped_; }
  /// Forgets the stream; the count stays.
  void clear();

 private:
  void decide(const ImuSample& sample, std::vector<ImuSample>* decided);

  double gap_seconds_;
  double newest_ = -std::numeric_limits<double>::infinity();
  double step_ = std::numeric_limits<double>::infinity();  ///< between the last two decided samples, s
  std::optional<ImuSample> waits_;
  std::size_t dropped_ = 0;
};

}  // namespace vip_slam
