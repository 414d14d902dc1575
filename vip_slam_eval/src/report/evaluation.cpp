#include "vip_slam_eval/evaluation.h"

#include <cmath>
#include <filesystem>
#include <iomanip>
#include <locale>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "vip_slam_core/util/atomic_file.h"

namespace vip_slam {
namespace {

constexpr double kDegrees = 180.0 / M_PI;

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
  table->push_back({group, "position rmse", error.position.rmse, "m"});
  table->push_back({group, "rotation rmse", error.rotation.rmse, "deg"});
}

std::string errorsCsv(const Evaluation& evaluation) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << "t,x,y,z,position_m,rotation_deg\n" << std::fixed;
  for (const PoseError& e : evaluation.shown.errors) {
    out << std::setprecision(9) << e.t << std::setprecision(6) << ',' << e.position.x() << ',' << e.position.y() << ','
        << e.position.z() << ',' << e.position.norm() << ',' << e.rotation * kDegrees << '\n';
  }
  return out.str();
}

std::string matchesCsv(const PlaneMetrics& planes) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << "estimate,truth,normal_error_deg,distance_error_m,overlap_m2,area_m2\n";
  for (const PlaneMatch& m : planes.matches) {
    out << m.estimate << ',' << (m.truth ? std::to_string(m.truth) : "none") << ',' << m.normal_error * kDegrees << ','
        << m.distance_error << ',' << m.overlap << ',' << m.area << '\n';
  }
  return out.str();
}

std::string truthsCsv(const PlaneMetrics& planes) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << "truth,counts,found,represented_by,visible_m2,covered_m2\n";
  for (const TruePlaneResult& t : planes.truths) {
    out << t.id << ',' << t.counts << ',' << t.found << ',' << t.represented_by << ',' << t.visible_area << ','
        << t.covered_area << '\n';
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
    result.nees = nees(input.truth, input.covariances, input.max_gap, input.time_offset);
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
  table.push_back({"ATE, position aligned", "position rmse", evaluation.position.position.rmse, "m"});
  table.push_back({"ATE, position aligned", "rotation rmse", evaluation.position.rotation.rmse, "deg"});
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
  if (evaluation.planes) {
    const PlaneMetrics& p = *evaluation.planes;
    table.push_back({"planes", "expected", double(p.expected), ""});
    table.push_back({"planes", "found", double(p.found), ""});
    table.push_back({"planes", "recall", 100 * p.recall, "%"});
    table.push_back({"planes", "estimated", double(p.estimated), ""});
    table.push_back({"planes", "duplicates", double(p.duplicates), ""});
    table.push_back({"planes", "false", double(p.false_planes), ""});
    table.push_back({"planes", "normal error mean", p.normal.mean, "deg"});
    table.push_back({"planes", "normal error max", p.normal.max, "deg"});
    table.push_back({"planes", "distance error mean", p.distance.mean, "m"});
    table.push_back({"planes", "distance error max", p.distance.max, "m"});
  }
  if (evaluation.associations) {
    const AssociationMetrics& a = *evaluation.associations;
    table.push_back({"points on planes", "associated", double(a.labelled), ""});
    table.push_back({"points on planes", "precision", 100 * a.precision, "%"});
    table.push_back({"points on planes", "recall", 100 * a.recall, "%"});
  }
  return table;
}

void writeEvaluation(const std::string& folder, const EvaluationInput& input, const Evaluation& evaluation) {
  std::vector<std::pair<std::string, std::string>> contents;
  std::ostringstream metrics;
  writeMetricsCsv(metrics, metricsOf(input, evaluation));
  contents.emplace_back("metrics.csv", metrics.str());
  contents.emplace_back("errors.csv", errorsCsv(evaluation));
  if (evaluation.planes) {
    contents.emplace_back("planes.csv", matchesCsv(*evaluation.planes));
    contents.emplace_back("true_planes.csv", truthsCsv(*evaluation.planes));
  }
  contents.emplace_back("evaluation.svg", evaluationPicture(input, evaluation));

  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw std::runtime_error(folder + ": cannot be created: " + error.message());
  std::vector<std::unique_ptr<AtomicFile>> files;
  for (const auto& [name, text] : contents) {
    files.push_back(std::make_unique<AtomicFile>((std::filesystem::path(folder) / name).string()));
    files.back()->stream() << text << std::flush;
    if (!files.back()->stream()) throw std::runtime_error(folder + "/" + name + ": writing failed, is the disk full?");
  }
  for (const auto& file : files) file->commit();
}

}  // namespace vip_slam
