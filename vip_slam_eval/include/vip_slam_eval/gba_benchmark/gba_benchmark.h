// SPDX-License-Identifier: BSD-3-Clause
// The paper's Table III and time-over-keyframes figure: four variants and two solvers on one map, with the time of
// each part.
#pragma once

#include <string>
#include <vector>

#include "vip_slam_backend/back_end_options.h"
#include "vip_slam_backend/solver/ba_solver.h"
#include "vip_slam_eval/gba_benchmark/simulated_map.h"

namespace vip_slam {

/// Which keyframes host the homographies: each landmark's first view, a few views shared by many landmarks, or, as in
/// the live system, a few shared views from the middle of the landmarks' tracks.
enum class HomographyHosts { kFirstViews, kShared, kSharedMiddle };

struct GbaSetup {
  Variant variant = Variant::kVi;
  std::string solver = "structured";
  int threads = 1;
  HomographyHosts hosts = HomographyHosts::kShared;
};

struct GbaRun {
  GbaSetup setup;
  int keyframes = 0;
  std::size_t points = 0, planes = 0, homographies = 0, homography_pairs = 0, point_to_plane = 0;
  double build_ms = 0;    ///< map to problem, compression included; median
  double store_ms = 0;    ///< problem to map, points on planes included; median
  SolverSummary summary;  ///< of the run with the median total time
  /// Total time: map to problem, optimisation and problem to map.
  double wholeMs() const { return build_ms + summary.total_ms + store_ms; }
  double rmse_before = 0, rmse = 0;  ///< ATE of the keyframes after rigid alignment, metres
};

/// Runs each setup `repeats` times from the same start and keeps its run with the median time. The setups take turns,
/// so that a processor which is slow for a while is slow for all of them.
std::vector<GbaRun> runGba(const SimulatedMap& map, const std::vector<GbaSetup>& setups, int iterations, int repeats);

/// The map of the first `keyframes` keyframes.
SimulatedMap prefix(const SimulatedMap& map, int keyframes);

std::string gbaTableMarkdown(const std::vector<GbaRun>& runs);
std::string gbaTableCsv(const std::vector<GbaRun>& runs);

}  // namespace vip_slam
