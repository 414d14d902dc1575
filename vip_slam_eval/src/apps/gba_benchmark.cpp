// gba_benchmark --out DIR: the paper's Table III and its time-over-keyframes figure on a simulated map.
#include <cstdio>
#include <exception>
#include <sstream>

#include "vip_slam_core/util/atomic_file.h"
#include "vip_slam_core/util/command_line.h"
#include "vip_slam_core/util/output_folder.h"
#include "vip_slam_eval/gba_benchmark/gba_benchmark.h"
#include "vip_slam_eval/plot/line_plot.h"

using namespace vip_slam;

namespace {

void writeText(const std::string& path, const std::string& text) {
  AtomicFile file(path);
  file.stream() << text;
  file.commit();
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
    const SimulatedMap map = simulateMap(options);
    const Variant variants[] = {Variant::kVi, Variant::kViP, Variant::kViCp, Variant::kVip};
    std::ostringstream md;
    md << "# Global bundle adjustment of the four variants\n\n"
       << options.keyframes << " keyframes, " << options.plane_points << " points on planes (" << map.plane_observations
       << " observations), " << options.free_points << " free points (" << map.free_observations
       << " observations), seed " << options.seed << ", " << iterations << " iterations, median of " << repeats
       << " runs (Ceres: 3) that take turns with those of the other columns.\n\nThe structured solver eliminates the "
          "points while it evaluates the Jacobians, so its elimination "
          "counts "
          "there; Ceres counts it as linear solving. Only sums compare across solvers. `Sum` is the solver's, as in "
          "the "
          "paper; `Sum from map to map` adds the gathering of the factors with their compression, and the way back.\n";
    std::vector<GbaRun> all;
    const auto timed = [&](const char* title, const std::vector<GbaSetup>& setups, int runs) {
      std::vector<GbaRun> rows = runGba(map, setups, iterations, runs);
      for (const GbaRun& run : rows)
        std::fprintf(stderr, "%s, %s: %.1f ms, RMSE %.4f m\n", title, variantName(run.setup.variant),
                     run.summary.total_ms, run.rmse);
      all.insert(all.end(), rows.begin(), rows.end());
      return rows;
    };
    const auto print = [&](const char* title, const std::vector<GbaRun>& rows) {
      md << "\n## " << title << "\n\n" << gbaTableMarkdown(rows);
    };
    const auto everyVariant = [&](const char* solver, int threads) {
      std::vector<GbaSetup> setups;
      for (const Variant v : variants) setups.push_back({v, solver, threads});
      return setups;
    };
    std::vector<GbaSetup> setups = everyVariant("structured", 1);
    setups.push_back({Variant::kVip, "structured", 1, HomographyHosts::kFirstViews});
    setups.push_back({Variant::kVip, "structured", 1, HomographyHosts::kSharedMiddle});
    std::vector<GbaRun> own = timed("structured, one thread", setups, repeats);
    const GbaRun middle = own[5], first = own[4];
    own.resize(4);
    print("Structured solver, one thread", own);
    const auto own2 = timed("structured, two threads", everyVariant("structured", 2), repeats);
    print("Structured solver, two threads", own2);
    print("VIP with first views as hosts, structured solver, one thread", {first});
    print("VIP with hosts from the middle of tracks, as the live system, structured solver, one thread", {middle});
    const auto stock = timed("stock Ceres, one thread", everyVariant("ceres", 1), std::min(repeats, 3));
    print("Stock Ceres (SPARSE_SCHUR), one thread", stock);
    const auto ratio = [&](const char* what, const GbaRun& slow, const GbaRun& fast, const char* aim) {
      char row[200];
      std::snprintf(row, sizeof(row), "| %s | %.2f | %.2f | %s |\n", what,
                    slow.summary.total_ms / fast.summary.total_ms, slow.wholeMs() / fast.wholeMs(), aim);
      md << row;
    };
    md << "\n## Ratios\n\n| ratio | of the solver | from map to map | aim (paper) |\n|---|---:|---:|---|\n";
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
    char rmse[80];
    std::snprintf(rmse, sizeof(rmse), "\nRMSE of VIP / RMSE of VI: %.2f (paper 0.84, aim 1 or less)\n",
                  own[3].rmse / own[0].rmse);
    md << rmse;

    if (!quick) {
      std::vector<PlotSeries> series;
      std::ostringstream csv;
      csv << "map,keyframes,variant,solver,total_ms\n";
      for (const Variant v : variants) series.push_back({std::string(variantName(v)) + ", structured", {}, {}});
      series.push_back({"vi, Ceres", {}, {}});
      for (int n = 30; n <= options.keyframes; n += std::max(10, (options.keyframes - 30) / 6)) {
        const SimulatedMap part = prefix(map, n);
        const std::vector<GbaRun> runs = runGba(part, everyVariant("structured", 1), iterations, std::min(repeats, 5));
        for (int v = 0; v < 4; ++v) {
          const double ms = runs[v].summary.total_ms;
          series[v].x.push_back(n);
          series[v].y.push_back(ms);
          csv << "rooms," << n << ',' << variantName(variants[v]) << ",structured," << ms << '\n';
        }
        const GbaRun run = runGba(part, {{Variant::kVi, "ceres"}}, iterations, 1).front();
        series[4].x.push_back(n);
        series[4].y.push_back(run.summary.total_ms);
        csv << "rooms," << n << ",vi,ceres," << run.summary.total_ms << '\n';
      }
      writeLinePlot(out + "/time_over_keyframes.png", "Global bundle adjustment, two rooms there and back", "keyframes",
                    "ms", series);
      // A corridor: the cost should grow with its length and no faster.
      std::vector<PlotSeries> straight(2);
      straight[0].name = "vi, structured";
      straight[1].name = "vip, structured";
      md << "\n## Corridor\n\n| keyframes | vi (ms) | vip (ms) | vip per keyframe (us) | points | homographies | "
            "residual "
            "| Jacobians | linear | pre-processor |\n|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
      for (const int n : {100, 200, 400, 800}) {
        SimulatedMapOptions corridor = options;
        corridor.world = "corridor";
        corridor.keyframes = n;
        corridor.plane_points = 10 * n;
        corridor.free_points = 6 * n;
        const SimulatedMap map_n = simulateMap(corridor);
        const std::vector<GbaRun> runs =
            runGba(map_n, {{Variant::kVi}, {Variant::kVip}}, iterations, std::min(repeats, 5));
        for (int k = 0; k < 2; ++k) {
          const double ms = runs[k].summary.total_ms;
          straight[k].x.push_back(n);
          straight[k].y.push_back(ms);
          csv << "corridor," << n << ',' << variantName(runs[k].setup.variant) << ",structured," << ms << '\n';
        }
        char row[200];
        const GbaRun& run = runs[1];
        const SolverSummary& s = run.summary;
        std::snprintf(row, sizeof(row), "| %d | %.1f | %.1f | %.0f | %zu | %zu | %.1f | %.1f | %.1f | %.1f |\n", n,
                      runs[0].summary.total_ms, s.total_ms, 1e3 * s.total_ms / n, run.points, run.homographies,
                      s.residual_ms, s.jacobian_ms, s.linear_ms, s.preprocess_ms);
        md << row;
      }
      writeLinePlot(out + "/time_over_corridor.png", "Global bundle adjustment along a corridor", "keyframes", "ms",
                    straight);
      writeText(out + "/time_over_keyframes.csv", csv.str());
      md << "\n![time over keyframes](time_over_keyframes.png)\n\n![time along a corridor](time_over_corridor.png)\n";
    }
    writeText(out + "/table.md", md.str());
    writeText(out + "/table.csv", gbaTableCsv(all));
    std::printf("%s\n", md.str().c_str());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "gba_benchmark: %s\n", e.what());
    return 1;
  }
  return 0;
}
