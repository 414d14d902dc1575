// The files that a run leaves (docs/outputs.md).
#pragma once

#include <string>
#include <vector>

#include "vip_slam_bringup/runner/bag_reader.h"
#include "vip_slam_bringup/runner/pipeline.h"

namespace vip_slam {

/// What the pipeline itself does not know.
struct RunFacts {
  std::string bag, sensor, variant;
  bool loop_closing = true;
  bool finished = true;
  double processing_time = 0;  ///< seconds, wall clock
};

/// What a user should know of a run that has ended, one sentence each.
std::vector<std::string> runWarnings(const Pipeline& pipeline, const BagReader& reader);

/// Throws std::runtime_error naming the file that cannot be written.
void writeRun(const std::string& folder, const RunFacts& facts, const Pipeline& pipeline, const BagReader& reader,
              const TimingLog& timing);

}  // namespace vip_slam
