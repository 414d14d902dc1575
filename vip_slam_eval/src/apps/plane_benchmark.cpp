// SPDX-License-Identifier: BSD-3-Clause
// rosrun vip_slam_eval plane_benchmark BAG --sensor S --truth T.tum [--planes-truth P.yaml] [--out DIR]
// Evaluates the plane module alone, with true poses; of a real recording how steady its planes are.
#include <filesystem>
#include <iostream>

#include <opencv2/core/utility.hpp>

#include "vip_slam_core/types/planes_yaml.h"
#include "vip_slam_core/util/atomic_file.h"
#include "vip_slam_core/util/command_line.h"
#include "vip_slam_core/util/output_folder.h"
#include "vip_slam_eval/plane_benchmark/plane_benchmark.h"
#include "vip_slam_eval/report/plane_tables.h"

namespace {

using namespace vip_slam;

void write(const std::string& folder, const PlaneBenchmarkResult& result, const MetricTable& table,
           const TimingLog& timing) {
  const std::filesystem::path out(folder);
  std::ostringstream metrics;
  writeMetricsCsv(metrics, table);
  writeText(out / "metrics.csv", metrics.str());
  if (result.metrics) {
    writeText(out / "planes.csv", planeMatchesCsv(*result.metrics));
    writeText(out / "true_planes.csv", truePlanesCsv(*result.metrics));
    writeLabelledPoints((out / "points.csv").string(), result.points);
  }
  writePlanesYaml((out / "planes.yaml").string(), result.planes);
  writePlaneHistory((out / "plane_history.csv").string(), result.history);
  timing.writeCsv((out / "timing.csv").string());
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine line("plane_benchmark",
                   "Runs the plane module over a bag with true poses and judges its planes and point associations.");
  PlaneBenchmarkInput input;
  std::string truth, true_planes, out;
  std::vector<std::string> settings;
  line.argument("bag", input.bag, "the recording");
  line.option("sensor", input.sensor, "a shipped sensor or a sensor YAML file");
  line.required("sensor");
  line.option("truth", truth, "true trajectory of the IMU, TUM");
  line.required("truth");
  line.option("planes-truth", true_planes, "true planes, YAML; without it planes are not judged");
  line.option("out", out,
              "folder for metrics.csv, planes.yaml, plane_history.csv, timing.csv, and where the true planes are known "
              "planes.csv, true_planes.csv, points.csv");
  line.option("set", settings, "one option as group/key=value, as for run_bag; repeatable");
  line.option("start", input.start, "seconds to skip at the beginning", between(0.0, 1e6));
  line.option("duration", input.duration, "seconds to process; default: to the end", above(0.0));
  if (const auto status = line.parse(argc, argv)) return *status;
  cv::setNumThreads(1);
  try {
    setOptions(input.options, splitSettings(settings));
    input.truth = readTum(truth);
    if (!true_planes.empty()) input.true_planes = readTruePlanesYaml(true_planes);
    if (!out.empty()) prepareOutputFolder(out);
    TimingLog timing;
    const PlaneBenchmarkResult result = runPlaneBenchmark(input, &timing);
    const MetricTable table = metricsOf(result, timing);
    printMetrics(std::cout, table);
    if (!out.empty()) write(out, result, table, timing);
  } catch (const std::exception& error) {
    std::cerr << "plane_benchmark: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
