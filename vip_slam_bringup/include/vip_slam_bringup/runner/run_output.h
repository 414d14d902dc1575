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

/// Warnings for the user after a run, one sentence each.
std::vector<std::string> runWarnings(const Pipeline& pipeline, const BagReader& reader);

/// Throws std::runtime_error naming the file that cannot be written.
void writeRun(const std::string& folder, const RunFacts& facts, const Pipeline& pipeline, const BagReader& reader,
              const TimingLog& timing);

}  // namespace vip_slam
