// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/gba_benchmark/gba_benchmark.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>

#include "vip_slam_backend/optimisation/problem_builder.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/statistics.h"
#include "vip_slam_eval/metrics/trajectory_metrics.h"

namespace vip_slam {

namespace {

double msSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

double rmseOf(const SimulatedMap& map, const BuiltProblem& built, const BaProblem& problem) {
  std::vector<PosePair> pairs;
  for (std::size_t f = 0; f < built.frames.size(); ++f)
    if (built.frames[f] != 0)
      pairs.push_back({static_cast<double>(f), map.truth.at(built.frames[f]).T_W_I, problem.frames[f].state.T_W_I});
  return absoluteError(pairs, Alignment::kSe3).position.rmse;
}

BuilderSettings builderSettings(const SimulatedMap& map, const GbaSetup& setup) {
  BuilderSettings settings;
  settings.variant = setup.variant;
  settings.focal = map.focal;
  settings.shared_hosts = setup.hosts != HomographyHosts::kFirstViews;
  settings.middle_hosts = setup.hosts == HomographyHosts::kSharedMiddle;
  settings.measurement.pixel_sigma = map.pixel_sigma;
  // The simulation has no outliers: plain least squares, so that neither solver spends time on robust losses.
  settings.measurement.huber = settings.measurement.depth_huber = 0;
  settings.measurement.outlier_chi2 = 1e6;
  return settings;
}

// The runs of one setup.
struct Repeats {
  GbaRun run;
  std::vector<SolverSummary> summaries;
  std::vector<double> build, store;

  /// `adjusted`, a copy of `map`, receives the optimised values.
  void once(const SimulatedMap& map, int iterations, Map* adjusted) {
    SolverOptions options;
    options.max_iterations = iterations;
    options.keep_iterating = true;
    options.threads = run.setup.threads;
    auto start = std::chrono::steady_clock::now();
    BuiltProblem built = buildProblem(map.map, globalScope(map.map), builderSettings(map, run.setup));
    build.push_back(msSince(start));
    if (summaries.empty()) {
      run.keyframes = static_cast<int>(map.map.keyframes().size());
      run.rmse_before = rmseOf(map, built, built.problem);
      run.points = built.problem.points.size();
      run.planes = built.problem.planes.size();
      run.homographies = built.problem.homographies.size();
      run.homography_pairs = built.problem.homography_pairs.size();
      run.point_to_plane = built.problem.point_to_plane.size() + built.problem.plane_samples.size();
    }
    // A new solver each time: nothing is kept from the run before.
    summaries.push_back(makeSolver(run.setup.solver)->solve(built.problem, options));
    run.rmse = rmseOf(map, built, built.problem);
    start = std::chrono::steady_clock::now();
    storeProblem(built, map.noise, adjusted);
    store.push_back(msSince(start));
  }

  GbaRun middle() {
    run.build_ms = upperMedian(build);
    run.store_ms = upperMedian(store);
    std::sort(summaries.begin(), summaries.end(),
              [](const SolverSummary& a, const SolverSummary& b) { return a.total_ms < b.total_ms; });
    run.summary = summaries[summaries.size() / 2];
    return run;
  }
};

}  // namespace

std::vector<GbaRun> runGba(const SimulatedMap& map, const std::vector<GbaSetup>& setups, int iterations, int repeats) {
  std::vector<Repeats> all(setups.size());
  for (std::size_t s = 0; s < setups.size(); ++s) all[s].run.setup = setups[s];
  Map adjusted = map.map;
  for (int k = 0; k < repeats; ++k)
    for (Repeats& of_setup : all) of_setup.once(map, iterations, &adjusted);
  std::vector<GbaRun> runs;
  for (Repeats& of_setup : all) runs.push_back(of_setup.middle());
  return runs;
}

SimulatedMap prefix(const SimulatedMap& map, int keyframes) {
  SimulatedMap out = map;
  while (static_cast<int>(out.map.keyframes().size()) > keyframes) {
    const KeyframeId last = out.map.newestKeyframe();
    out.map.removeKeyframe(last, out.noise, 3.0);
    out.truth.erase(last);
  }
  return out;
}

namespace {

struct Row {
  const char* name;
  const char* format;
  double (*value)(const GbaRun&);
};

const Row kRows[] = {
    {"Keyframes", "%.0f", [](const GbaRun& r) { return double(r.keyframes); }},
    {"Points", "%.0f", [](const GbaRun& r) { return double(r.points); }},
    {"Planes", "%.0f", [](const GbaRun& r) { return double(r.planes); }},
    {"Pixel + depth observations", "%.0f", [](const GbaRun& r) { return double(r.summary.observations); }},
    {"Homographies", "%.0f", [](const GbaRun& r) { return double(r.homographies + r.homography_pairs); }},
    {"Point-to-plane factors", "%.0f", [](const GbaRun& r) { return double(r.point_to_plane); }},
    {"Residual blocks", "%.0f", [](const GbaRun& r) { return double(r.summary.residual_blocks); }},
    {"Parameters", "%.0f", [](const GbaRun& r) { return double(r.summary.parameters); }},
    {"Iterations", "%.0f", [](const GbaRun& r) { return double(r.summary.iterations); }},
    {"Residual (ms)", "%.1f", [](const GbaRun& r) { return r.summary.residual_ms; }},
    {"Jacobians (ms)", "%.1f", [](const GbaRun& r) { return r.summary.jacobian_ms; }},
    {"Linear (ms)", "%.1f", [](const GbaRun& r) { return r.summary.linear_ms; }},
    {"Pre-processor (ms)", "%.1f", [](const GbaRun& r) { return r.summary.preprocess_ms; }},
    {"Post-processor (ms)", "%.1f", [](const GbaRun& r) { return r.summary.postprocess_ms; }},
    {"Sum (ms)", "%.1f", [](const GbaRun& r) { return r.summary.total_ms; }},
    {"Map to problem (ms)", "%.1f", [](const GbaRun& r) { return r.build_ms; }},
    {"Problem to map (ms)", "%.1f", [](const GbaRun& r) { return r.store_ms; }},
    {"Sum from map to map (ms)", "%.1f", [](const GbaRun& r) { return r.wholeMs(); }},
    {"Final cost", "%.1f", [](const GbaRun& r) { return r.summary.final_cost; }},
    {"RMSE before (m)", "%.4f", [](const GbaRun& r) { return r.rmse_before; }},
    {"RMSE (m)", "%.4f", [](const GbaRun& r) { return r.rmse; }},
};

const char* hostsName(HomographyHosts hosts) {
  switch (hosts) {
    case HomographyHosts::kFirstViews:
      return "first views";
    case HomographyHosts::kShared:
      return "shared";
    case HomographyHosts::kSharedMiddle:
      return "shared, middle of tracks";
  }
  return "";
}

}  // namespace

std::string gbaTableMarkdown(const std::vector<GbaRun>& runs) {
  std::ostringstream out;
  out << "| |";
  for (const GbaRun& run : runs) out << ' ' << variantName(run.setup.variant) << " |";
  out << "\n|---|";
  for (std::size_t k = 0; k < runs.size(); ++k) out << "---:|";
  out << '\n';
  for (const Row& row : kRows) {
    out << "| " << row.name << " |";
    for (const GbaRun& run : runs) out << ' ' << formatted(row.format, row.value(run)) << " |";
    out << '\n';
  }
  return out.str();
}

std::string gbaTableCsv(const std::vector<GbaRun>& runs) {
  std::ostringstream out;
  out << "variant,solver,threads,hosts";
  for (const Row& row : kRows) out << ',' << row.name;
  out << '\n';
  for (const GbaRun& run : runs) {
    out << variantName(run.setup.variant) << ',' << run.setup.solver << ',' << run.setup.threads << ",\""
        << hostsName(run.setup.hosts) << '"';
    for (const Row& row : kRows) out << ',' << formatted(row.format, row.value(run));
    out << '\n';
  }
  return out.str();
}

}  // namespace vip_slam
