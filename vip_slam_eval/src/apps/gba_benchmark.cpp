// SPDX-License-Identifier: BSD-3-Clause
// gba_benchmark --out DIR: the paper's Table III and its time-over-keyframes figure on a simulated map.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <sstream>
#include <string>
#include <vector>

#include "vip_slam_core/util/atomic_file.h"
#include "vip_slam_core/util/command_line.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/output_folder.h"
#include "vip_slam_eval/gba_benchmark/gba_benchmark.h"
#include "vip_slam_eval/plot/line_plot.h"

using namespace vip_slam;

namespace {

constexpr Variant kVariants[] = {Variant::kVi, Variant::kViP, Variant::kViCp, Variant::kVip};
constexpr int kMaxCeresRuns = 3;     // each takes a second
constexpr int kMaxRunsOfFigure = 5;  // per point of the figures over keyframes

std::vector<GbaSetup> everyVariant(const std::string& solver, int threads) {
  std::vector<GbaSetup> setups;
  for (const Variant v : kVariants) setups.push_back({v, solver, threads});
  return setups;
}

class Benchmark {
 public:
  Benchmark(const SimulatedMapOptions& options, int iterations, int repeats)
      : options_(options), iterations_(iterations), repeats_(repeats), map_(simulateMap(options)) {}

  void describe();
  /// The table's columns and their ratios.
  void table();
  /// Time over the number of keyframes, for prefixes of the same map and along a corridor. Writes the plots to `out`.
  void figures(const std::string& out);
  std::string markdown() const { return md_.str(); }
  std::string tableCsv() const { return gbaTableCsv(all_); }

 private:
  std::vector<GbaRun> timed(const char* title, const std::vector<GbaSetup>& setups, int runs);
  void print(const char* title, const std::vector<GbaRun>& rows) {
    md_ << "\n## " << title << "\n\n" << gbaTableMarkdown(rows);
  }
  void ratio(const char* what, const GbaRun& slow, const GbaRun& fast, const char* aim);
  void overKeyframes(const std::string& out, std::ostringstream* csv);
  void overCorridor(const std::string& out, std::ostringstream* csv);

  const SimulatedMapOptions options_;
  const int iterations_, repeats_;
  const SimulatedMap map_;
  std::ostringstream md_;
  std::vector<GbaRun> all_;
};

void Benchmark::describe() {
  md_ << "# Global bundle adjustment of the four variants\n\n"
      << options_.keyframes << " keyframes, " << options_.plane_points << " points on planes ("
      << map_.plane_observations << " observations), " << options_.free_points << " free points ("
      << map_.free_observations << " observations), seed " << options_.seed << ", " << iterations_
      << " iterations, median of " << repeats_ << " runs (Ceres: " << kMaxCeresRuns
      << ") that take turns with those of the other columns.\n\nThe structured solver eliminates the points while it "
         "evaluates the Jacobians, so its elimination counts there; Ceres counts it as linear solving. Only sums "
         "compare across solvers. `Sum` is the solver's, as in the paper; `Sum from map to map` adds the gathering of "
         "the factors with their compression, and the way back.\n";
}

std::vector<GbaRun> Benchmark::timed(const char* title, const std::vector<GbaSetup>& setups, int runs) {
  std::vector<GbaRun> rows = runGba(map_, setups, iterations_, runs);
  for (const GbaRun& run : rows)
    std::fprintf(stderr, "%s, %s: %.1f ms, RMSE %.4f m\n", title, variantName(run.setup.variant), run.summary.total_ms,
                 run.rmse);
  all_.insert(all_.end(), rows.begin(), rows.end());
  return rows;
}

void Benchmark::ratio(const char* what, const GbaRun& slow, const GbaRun& fast, const char* aim) {
  md_ << formatted("| %s | %.2f | %.2f | %s |\n", what, slow.summary.total_ms / fast.summary.total_ms,
                   slow.wholeMs() / fast.wholeMs(), aim);
}

void Benchmark::table() {
  std::vector<GbaSetup> setups = everyVariant("structured", 1);
  setups.push_back({Variant::kVip, "structured", 1, HomographyHosts::kFirstViews});
  setups.push_back({Variant::kVip, "structured", 1, HomographyHosts::kSharedMiddle});
  std::vector<GbaRun> own = timed("structured, one thread", setups, repeats_);
  const GbaRun first = own[4], middle = own[5];
  own.resize(4);
  print("Structured solver, one thread", own);
  const auto own2 = timed("structured, two threads", everyVariant("structured", 2), repeats_);
  print("Structured solver, two threads", own2);
  print("VIP with first views as hosts, structured solver, one thread", {first});
  print("VIP with hosts from the middle of tracks, as the live system, structured solver, one thread", {middle});
  const auto stock = timed("stock Ceres, one thread", everyVariant("ceres", 1), std::min(repeats_, kMaxCeresRuns));
  print("Stock Ceres (SPARSE_SCHUR), one thread", stock);

  md_ << "\n## Ratios\n\n| ratio | of the solver | from map to map | aim (paper) |\n|---|---:|---:|---|\n";
  ratio("VI / VIP, structured", own[0], own[3], "3 (2.84)");
  ratio("VI / VIP with first views as hosts, structured", own[0], first, "-");
  ratio("VI / VIP with hosts from the middle of tracks (live system), structured", own[0], middle, "-");
  ratio("P / CP, structured", own[1], own[2], "3 (2.0)");
  ratio("VI on stock Ceres / VIP, structured", stock[0], own[3], "8 (2.84)");
  ratio("VI / VIP, stock Ceres", stock[0], stock[3], "- (2.84)");
  ratio("P / CP, stock Ceres", stock[1], stock[2], "- (2.0)");
  ratio("VIP on stock Ceres / VIP, structured", stock[3], own[3], "-");
  ratio("VI, one thread / two threads, structured", own[0], own2[0], "1");
  ratio("VIP, one thread / two threads, structured", own[3], own2[3], "1");
  md_ << formatted("\nRMSE of VIP / RMSE of VI: %.2f (paper 0.84, aim 1 or less)\n", own[3].rmse / own[0].rmse);
}

void Benchmark::figures(const std::string& out) {
  std::ostringstream csv;
  csv << "map,keyframes,variant,solver,total_ms\n";
  overKeyframes(out, &csv);
  overCorridor(out, &csv);
  writeText(out + "/time_over_keyframes.csv", csv.str());
  md_ << "\n![time over keyframes](time_over_keyframes.png)\n\n![time along a corridor](time_over_corridor.png)\n";
}

void Benchmark::overKeyframes(const std::string& out, std::ostringstream* csv) {
  std::vector<PlotSeries> series;
  for (const Variant v : kVariants) series.push_back({std::string(variantName(v)) + ", structured", {}, {}});
  series.push_back({"vi, Ceres", {}, {}});
  const auto add = [&](PlotSeries* to, int n, const GbaRun& run) {
    to->x.push_back(n);
    to->y.push_back(run.summary.total_ms);
    *csv << "rooms," << n << ',' << variantName(run.setup.variant) << ',' << run.setup.solver << ','
         << run.summary.total_ms << '\n';
  };
  for (int n = 30; n <= options_.keyframes; n += std::max(10, (options_.keyframes - 30) / 6)) {
    const SimulatedMap part = prefix(map_, n);
    const int runs = std::min(repeats_, kMaxRunsOfFigure);
    const std::vector<GbaRun> own = runGba(part, everyVariant("structured", 1), iterations_, runs);
    for (std::size_t v = 0; v < own.size(); ++v) add(&series[v], n, own[v]);
    add(&series.back(), n, runGba(part, {{Variant::kVi, "ceres"}}, iterations_, 1).front());
  }
  writeLinePlot(out + "/time_over_keyframes.png", "Global bundle adjustment, two rooms there and back", "keyframes",
                "ms", series);
}

// A corridor: the cost should grow with its length and no faster.
void Benchmark::overCorridor(const std::string& out, std::ostringstream* csv) {
  std::vector<PlotSeries> series{{"vi, structured", {}, {}}, {"vip, structured", {}, {}}};
  md_ << "\n## Corridor\n\n| keyframes | vi (ms) | vip (ms) | vip per keyframe (us) | points | homographies | residual "
         "| Jacobians | linear | pre-processor |\n|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
  for (const int n : {100, 200, 400, 800}) {
    SimulatedMapOptions corridor = options_;
    corridor.world = "corridor";
    corridor.keyframes = n;
    corridor.plane_points = 10 * n;
    corridor.free_points = 6 * n;
    const std::vector<GbaRun> runs = runGba(simulateMap(corridor), {{Variant::kVi}, {Variant::kVip}}, iterations_,
                                            std::min(repeats_, kMaxRunsOfFigure));
    for (std::size_t k = 0; k < runs.size(); ++k) {
      const double ms = runs[k].summary.total_ms;
      series[k].x.push_back(n);
      series[k].y.push_back(ms);
      *csv << "corridor," << n << ',' << variantName(runs[k].setup.variant) << ",structured," << ms << '\n';
    }
    const GbaRun& vip = runs[1];
    const SolverSummary& s = vip.summary;
    md_ << formatted("| %d | %.1f | %.1f | %.0f | %zu | %zu | %.1f | %.1f | %.1f | %.1f |\n", n,
                     runs[0].summary.total_ms, s.total_ms, 1e3 * s.total_ms / n, vip.points, vip.homographies,
                     s.residual_ms, s.jacobian_ms, s.linear_ms, s.preprocess_ms);
  }
  writeLinePlot(out + "/time_over_corridor.png", "Global bundle adjustment along a corridor", "keyframes", "ms",
                series);
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine line("gba_benchmark", "Times the global bundle adjustment of the four variants on one simulated map");
  std::string out;
  SimulatedMapOptions options;
  int iterations = 10, repeats = 21;
  bool quick = false;
  line.option("out", out, "directory for table.md, table.csv, time_over_keyframes.csv and .png");
  line.required("out");
  line.option("keyframes", options.keyframes, "keyframes of the table", between(20, 2000));
  line.option("plane-points", options.plane_points, "points on planes", between(50, 100000));
  line.option("free-points", options.free_points, "points on no plane", between(50, 100000));
  line.option("seed", options.seed, "seed of the simulation");
  line.option("iterations", iterations, "Levenberg-Marquardt iterations", between(1, 1000));
  line.option("repeats", repeats, "runs per figure, 3 at most for Ceres; the median counts", between(1, 100));
  line.flag("quick", quick, "the table only, not the figure over keyframes");
  if (const auto status = line.parse(argc, argv)) return *status;
  try {
    vip_slam::prepareOutputFolder(out);
    Benchmark benchmark(options, iterations, repeats);
    benchmark.describe();
    benchmark.table();
    if (!quick) benchmark.figures(out);
    writeText(out + "/table.md", benchmark.markdown());
    writeText(out + "/table.csv", benchmark.tableCsv());
    std::printf("%s\n", benchmark.markdown().c_str());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "gba_benchmark: %s\n", e.what());
    return 1;
  }
  return 0;
}
