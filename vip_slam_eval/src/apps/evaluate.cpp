// rosrun vip_slam_eval evaluate --truth T.tum --estimate E.tum [--planes-truth TP.yaml --planes P.yaml] [--out DIR]
#include <iostream>

#include "vip_slam_core/types/planes_yaml.h"
#include "vip_slam_core/util/command_line.h"
#include "vip_slam_eval/io/trajectory_source.h"
#include "vip_slam_eval/report/evaluation.h"

int main(int argc, char** argv) {
  using namespace vip_slam;
  CommandLine line("evaluate", "Judges a trajectory, and a plane map, against ground truth.");
  EvaluationInput input;
  std::string truth, truth_topic, estimate, estimate_topic, covariance, true_planes, planes, points, out;
  std::string alignment = "yaw";
  line.option("truth", truth, "true trajectory: TUM file or bag");
  line.required("truth");
  line.option("truth-topic", truth_topic, "topic of the truth in a bag with several");
  line.option("estimate", estimate, "estimated trajectory: TUM file or bag");
  line.required("estimate");
  line.option("estimate-topic", estimate_topic, "topic of the estimate in a bag with several");
  line.option("covariance", covariance, "the estimate's covariances, CSV as run_bag writes it: adds the NEES");
  line.option("planes-truth", true_planes, "true planes, YAML");
  line.option("planes", planes, "estimated planes, YAML");
  line.needs("planes-truth", "planes");
  line.needs("planes", "planes-truth");
  line.option("points", points, "map points with their plane, CSV id,x,y,z,plane,keyframes");
  line.needs("points", "planes");
  line.option("align", alignment, "alignment of the picture, the planes and the points: se3, yaw, position or none",
              oneOf("none, position, yaw, se3"));
  line.option("max-gap", input.max_gap, "largest step of the truth to interpolate over, seconds", above(0.0));
  line.option("gap", input.gap_seconds, "a longer hole in the estimate is reported as a gap, seconds", above(0.0));
  line.option("time-offset", input.time_offset, "seconds to add to the estimate's stamps");
  line.option("rpe-seconds", input.rpe_seconds, "intervals of the relative error", each(above(0.0)));
  line.option("rpe-metres", input.rpe_metres, "path lengths of the relative error", each(above(0.0)));
  line.option("title", input.title, "title of the picture; default: the estimate's name");
  line.option("out", out, "folder for metrics.csv, errors.csv, evaluation.svg and the planes' tables");
  if (const auto status = line.parse(argc, argv)) return *status;
  try {
    input.alignment = alignmentFromName(alignment);
    if (input.title.empty()) input.title = estimate;
    input.truth = readTrajectory(truth, truth_topic);
    input.estimate = readTrajectory(estimate, estimate_topic, &input.covariances);
    if (!covariance.empty()) input.covariances = readCovariances(covariance, input.estimate);
    if (!true_planes.empty()) input.true_planes = readTruePlanesYaml(true_planes);
    if (!planes.empty()) input.planes = readPlanesYaml(planes);
    if (!points.empty()) input.points = readLabelledPoints(points);
    const Evaluation evaluation = evaluate(input);
    if (!out.empty()) writeEvaluation(out, input, evaluation);
    printMetrics(std::cout, metricsOf(input, evaluation));
    if (!out.empty())
      std::cout << "written: " << out << "/metrics.csv, errors.csv, evaluation.svg"
                << (evaluation.planes ? ", planes.csv, true_planes.csv" : "") << "\n";
  } catch (const std::exception& error) {
    std::cerr << "evaluate: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
