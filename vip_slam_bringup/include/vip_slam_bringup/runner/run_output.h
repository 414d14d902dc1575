// SPDX-License-Identifier: BSD-3-Clause
// The output files of a run (docs/outputs.md).
#pragma once

#include <string>
#include <vector>

#include "vip_slam_bringup/runner/bag_reader.h"
#include "vip_slam_bringup/runner/pipeline.h"

namespace vip_slam {

/// Facts about the run that the pipeline itself does not have.
struct RunFacts {
  std::string bag, sensor, variant;
  bool loop_closing = true;
  bool finished = true;
  double processing_time = 0;  ///< seconds, wall clock
};

/// A warning about poses missing after the first one, for longer than a moment; else empty.
std::string missingPoses(const Pipeline& pipeline);
/// The share of the images after the first pose in any state but TRACKING, by states, and the longest stretch of these
/// with its reason; empty up to 2 %.
std::string otherStates(const std::vector<StateChange>& states);
/// Warnings for the user after a run, one sentence each.
std::vector<std::string> runWarnings(const Pipeline& pipeline, const BagReader& reader);

/// Throws std::runtime_error naming the file that cannot be written.
void writeRun(const std::string& folder, const RunFacts& facts, const Pipeline& pipeline, const BagReader& reader,
              const TimingLog& timing);

}  // namespace vip_slam
