// SPDX-License-Identifier: BSD-3-Clause
// Benchmark of the plane module alone: the front end tracks and selects keyframes, whose poses are the true ones.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "vip_slam_bringup/runner/pipeline_options.h"
#include "vip_slam_bringup/runner/plane_history.h"
#include "vip_slam_core/trajectory/tum_io.h"
#include "vip_slam_core/types/true_plane.h"
#include "vip_slam_core/util/timing.h"
#include "vip_slam_eval/metrics/association_metrics.h"
#include "vip_slam_eval/metrics/plane_metrics.h"
#include "vip_slam_eval/report/metric_table.h"
#include "vip_slam_planes/plane_mapper.h"

namespace vip_slam {

struct PlaneBenchmarkInput {
  std::string bag, sensor;                            ///< sensor: a shipped name or a file
  Trajectory truth;                                   ///< of the IMU
  std::optional<std::vector<TruePlane>> true_planes;  ///< without them planes and points are not judged
  PipelineOptions options;                            ///< of front end and planes
  double start = 0;                                   ///< seconds to skip
  double duration = -1;                               ///< seconds; negative: to the end
};

struct PlaneBenchmarkResult {
  std::size_t images = 0, keyframes = 0;
  std::vector<PlaneEstimate> planes;
  std::vector<PlaneRecord> history;  ///< after each keyframe
  std::vector<LabelledPoint> points;
  std::optional<PlaneMetrics> metrics;  ///< with true planes only, like the next
  std::optional<AssociationMetrics> associations;
  PlaneMapperCounters counters;
};

/// Stages "planes.update" (the total cost of a keyframe) and "planes.grow" go to `timing` (not null). Throws
/// std::runtime_error naming what cannot be read, or when the truth covers no keyframe.
PlaneBenchmarkResult runPlaneBenchmark(const PlaneBenchmarkInput& input, TimingLog* timing);

MetricTable metricsOf(const PlaneBenchmarkResult& result, const TimingLog& timing);

}  // namespace vip_slam
