// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/report/evaluation.h"

#include <cmath>
#include <filesystem>
#include <iomanip>
#include <locale>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/util/atomic_file.h"
#include "vip_slam_core/util/output_folder.h"
#include "vip_slam_eval/report/plane_tables.h"

namespace vip_slam {
namespace {

void addStatistics(MetricTable* table, const std::string& group, const std::string& what, const ErrorStatistics& s,
                   const std::string& unit) {
  table->push_back({group, what + " rmse", s.rmse, unit});
  table->push_back({group, what + " median", s.median, unit});
  table->push_back({group, what + " 95 %", s.p95, unit});
  table->push_back({group, what + " max", s.max, unit});
}

void addRelative(MetricTable* table, const RelativeError& error, const std::string& unit) {
  const std::string group = "RPE over " + shortNumber(error.delta) + " " + unit;
  table->push_back({group, "pairs", double(error.position.count), ""});
  if (error.position.count == 0) return;
  table->push_back({group, "position mean", error.position.mean, "m"});
  table->push_back({group, "position rmse", error.position.rmse, "m"});
  table->push_back({group, "position max", error.position.max, "m"});
  table->push_back({group, "rotation mean", error.rotation.mean, "deg"});
  table->push_back({group, "rotation rmse", error.rotation.rmse, "deg"});
  table->push_back({group, "rotation max", error.rotation.max, "deg"});
}

std::string errorsCsv(const Evaluation& evaluation) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << "t,x,y,z,position_m,rotation_deg\n" << std::fixed;
  for (const PoseError& e : evaluation.shown.errors) {
    out << std::setprecision(9) << e.t << std::setprecision(6) << ',' << e.position.x() << ',' << e.position.y() << ','
        << e.position.z() << ',' << e.position.norm() << ',' << e.rotation / kDegree << '\n';
  }
  return out.str();
}

}  // namespace

Evaluation evaluate(const EvaluationInput& input) {
  Evaluation result;
  result.pairs = associate(input.truth, input.estimate, input.max_gap, input.time_offset);
  if (result.pairs.empty()) {
    throw std::runtime_error("no estimated pose (" + std::to_string(input.estimate.size()) +
                             ") falls into the time of the truth (" + std::to_string(input.truth.size()) +
                             " poses), expected the same clock");
  }
  result.se3 = absoluteError(result.pairs, Alignment::kSe3);
  result.yaw = absoluteError(result.pairs, Alignment::kYaw);
  result.position = absoluteError(result.pairs, Alignment::kPosition);
  result.shown = absoluteError(result.pairs, input.alignment);
  for (const double s : input.rpe_seconds) result.over_time.push_back(relativeErrorOverTime(result.pairs, s));
  for (const double m : input.rpe_metres) result.over_distance.push_back(relativeErrorOverDistance(result.pairs, m));
  result.coverage = coverage(input.truth, input.estimate, input.gap_seconds, input.time_offset);
  if (!input.covariances.empty()) {
    result.nees = nees(input.truth, input.covariances, input.max_gap, input.time_offset, input.level);
  }
  if (input.true_planes && input.planes) {
    result.planes = planeMetrics(*input.true_planes, transformPlanes(result.shown.T_W_M, *input.planes));
    if (input.points) {
      std::vector<LabelledPoint> points = *input.points;
      for (LabelledPoint& point : points) point.p_W = result.shown.T_W_M * point.p_W;
      result.associations = associationMetrics(points, *input.true_planes, *result.planes);
    }
  }
  return result;
}

MetricTable metricsOf(const EvaluationInput& input, const Evaluation& evaluation) {
  MetricTable table;
  table.push_back({"trajectory", "poses judged", double(evaluation.pairs.size()), ""});
  table.push_back({"trajectory", "poses without truth", double(input.estimate.size() - evaluation.pairs.size()), ""});
  table.push_back({"trajectory", "true path", truePathLength(evaluation.pairs), "m"});
  table.push_back({"trajectory", "time covered", 100 * evaluation.coverage.fraction, "%"});
  table.push_back({"trajectory", "gaps", double(evaluation.coverage.gaps.size()), ""});
  table.push_back({"trajectory", "longest gap", evaluation.coverage.longest_gap, "s"});

  addStatistics(&table, "ATE, SE3 aligned", "position", evaluation.se3.position, "m");
  table.push_back({"ATE, SE3 aligned", "rotation rmse", evaluation.se3.rotation.rmse, "deg"});
  addStatistics(&table, "ATE, position and yaw aligned", "position", evaluation.yaw.position, "m");
  table.push_back({"ATE, position and yaw aligned", "rotation rmse", evaluation.yaw.rotation.rmse, "deg"});
  table.push_back(
      {"ATE, position aligned, yaw as in the odometry", "position rmse", evaluation.position.position.rmse, "m"});
  table.push_back(
      {"ATE, position aligned, yaw as in the odometry", "rotation rmse", evaluation.position.rotation.rmse, "deg"});
  for (const RelativeError& error : evaluation.over_time) addRelative(&table, error, "s");
  for (const RelativeError& error : evaluation.over_distance) addRelative(&table, error, "m");

  if (evaluation.nees) {
    const Nees& n = *evaluation.nees;
    table.push_back({"NEES", "pose mean (honest: 6)", n.pose.mean, ""});
    table.push_back({"NEES", "position mean (honest: 3)", n.position.mean, ""});
    table.push_back({"NEES", "rotation mean (honest: 3)", n.rotation.mean, ""});
    table.push_back({"NEES", "within the 95 % bound", 100 * n.within_95, "%"});
    table.push_back({"NEES", "unusable covariances", double(n.unusable), ""});
  }
  if (evaluation.planes) appendPlaneMetrics(&table, *evaluation.planes);
  if (evaluation.associations) appendAssociationMetrics(&table, *evaluation.associations);
  return table;
}

void writeEvaluation(const std::string& folder, const EvaluationInput& input, const Evaluation& evaluation) {
  std::vector<std::pair<std::string, std::string>> contents;
  std::ostringstream metrics;
  writeMetricsCsv(metrics, metricsOf(input, evaluation));
  contents.emplace_back("metrics.csv", metrics.str());
  contents.emplace_back("errors.csv", errorsCsv(evaluation));
  if (evaluation.planes) {
    contents.emplace_back("planes.csv", planeMatchesCsv(*evaluation.planes));
    contents.emplace_back("true_planes.csv", truePlanesCsv(*evaluation.planes));
  }
  contents.emplace_back("evaluation.svg", evaluationPicture(input, evaluation));

  prepareOutputFolder(folder);
  std::vector<std::unique_ptr<AtomicFile>> files;
  for (const auto& [name, text] : contents) {
    files.push_back(std::make_unique<AtomicFile>((std::filesystem::path(folder) / name).string()));
    files.back()->stream() << text << std::flush;
    if (!files.back()->stream()) throw std::runtime_error(folder + "/" + name + ": writing failed, is the disk full?");
  }
  for (const auto& file : files) file->commit();
  if (evaluation.planes) return;
  for (const char* of_an_earlier_one : {"planes.csv", "true_planes.csv"}) {
    std::error_code ignored;
    std::filesystem::remove(std::filesystem::path(folder) / of_an_earlier_one, ignored);
  }
}

}  // namespace vip_slam
