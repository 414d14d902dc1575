// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/runner/trial_run.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "vip_slam_bringup/runner/bag_reader.h"
#include "vip_slam_bringup/runner/pipeline.h"
#include "vip_slam_bringup/runner/run_output.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/timing.h"

namespace vip_slam {
namespace {

/// What is advised of the moment of depth; empty: nothing. The rest of the calibration has checks of its own.
std::string depthDelayDifference(const FrontEnd& front_end) {
  const CalibrationEstimate given = front_end.givenCalibration(), found = front_end.calibration();
  CalibrationEstimate only = given;
  only.depth_delay = found.depth_delay;
  only.sigma_depth_delay = found.sigma_depth_delay;
  const std::vector<std::string> differences = calibrationDifferences(given, only);
  return differences.empty() ? "" : differences.front();
}

}  // namespace

Findings trialRun(BagSet bags, SensorConfig sensor, double seconds) {
  BagReaderOptions reading;
  reading.duration = seconds;
  PipelineOptions options;
  options.mapping = false;
  BagReader reader(std::move(bags), sensor, reading);
  TimingLog timing;
  Pipeline pipeline(options, sensor, &timing);
  reader.start();
  while (const auto event = reader.next()) pipeline.add(*event);
  pipeline.finish();

  Findings all;
  const FrontEndCounters& counters = pipeline.frontEnd().counters();
  const auto contradicting =
      static_cast<std::size_t>(std::min(counters.images, counters.imu_faults + counters.imu_contradicted));
  if (counters.imuIsWrong())
    all.push_back({Severity::kError, "odometry",
                   formatted("the IMU and what is seen contradict each other in %zu of %zu images, why is not known",
                             contradicting, static_cast<std::size_t>(counters.images)),
                   "are depth and colour of one moment, does something fill the view that moves, are axes, signs and "
                   "units right?"});
  for (const std::string& missing : {missingPoses(pipeline), otherStates(pipeline.states())})
    if (!missing.empty()) all.push_back({Severity::kWarning, "odometry", missing, "poses are less sure there"});
  const std::string late = depthDelayDifference(pipeline.frontEnd());
  if (!late.empty())
    all.push_back(
        {Severity::kWarning, "depth delay", late, "a delay that goes with a filter in the driver is not constant"});
  if (all.empty())
    all.push_back({Severity::kGood, "odometry", formatted("%zu images tracked", pipeline.odometry().size()), ""});
  return all;
}

}  // namespace vip_slam
