// rosrun vip_slam_eval evaluate --truth T.tum --estimate E.tum [--planes-truth TP.yaml --planes P.yaml] [--out DIR]
#include <iostream>

#include <CLI/CLI.hpp>

#include "vip_slam_core/types/planes_yaml.h"
#include "vip_slam_eval/evaluation.h"
#include "vip_slam_eval/trajectory_source.h"

int main(int argc, char** argv) {
  using namespace vip_slam;
  CLI::App app{"Judges a trajectory, and a plane map, against ground truth."};
  EvaluationInput input;
  std::string truth, truth_topic, estimate, estimate_topic, covariance, true_planes, planes, points, out;
  std::string alignment = "yaw";
  app.add_option("--truth", truth, "true trajectory: TUM file or bag")->required();
  app.add_option("--truth-topic", truth_topic, "topic of the truth in a bag with several");
  app.add_option("--estimate", estimate, "estimated trajectory: TUM file or bag")->required();
  app.add_option("--estimate-topic", estimate_topic, "topic of the estimate in a bag with several");
  app.add_option("--covariance", covariance, "the estimate's covariances, CSV as run_bag writes it: adds the NEES");
  CLI::Option* true_planes_option = app.add_option("--planes-truth", true_planes, "true planes, YAML");
  CLI::Option* planes_option = app.add_option("--planes", planes, "estimated planes, YAML");
  true_planes_option->needs(planes_option);
  planes_option->needs(true_planes_option);
  app.add_option("--points", points, "map points with their plane, CSV id,x,y,z,plane")->needs(planes_option);
  app.add_option("--align", alignment, "alignment of the picture, the planes and the points")
      ->check(CLI::IsMember({"none", "position", "yaw", "se3"}))
      ->capture_default_str();
  app.add_option("--max-gap", input.max_gap, "largest step of the truth to interpolate over, seconds")
      ->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--gap", input.gap_seconds, "a longer hole in the estimate is reported as a gap, seconds")
      ->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--time-offset", input.time_offset, "seconds to add to the estimate's stamps")->capture_default_str();
  app.add_option("--rpe-seconds", input.rpe_seconds, "intervals of the relative error")->check(CLI::PositiveNumber);
  app.add_option("--rpe-metres", input.rpe_metres, "path lengths of the relative error")->check(CLI::PositiveNumber);
  app.add_option("--title", input.title, "title of the picture; default: the estimate's name");
  app.add_option("--out", out, "folder for metrics.csv, errors.csv, evaluation.svg and the planes' tables");
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    std::cerr << "evaluate: " << error.what() << " (see --help)\n";
    return 2;
  }
  try {
    input.alignment = alignmentFromName(alignment);
    if (input.title.empty()) input.title = estimate;
    input.truth = readTrajectory(truth, truth_topic);
    input.estimate = readTrajectory(estimate, estimate_topic, &input.covariances);
    if (!covariance.empty()) input.covariances = readCovariances(covariance, input.estimate);
    if (!true_planes.empty()) input.true_planes = readPlanesYaml(true_planes);
    if (!planes.empty()) input.planes = readPlanesYaml(planes);
    if (!points.empty()) input.points = readLabelledPoints(points);
    const Evaluation evaluation = evaluate(input);
    if (!out.empty()) writeEvaluation(out, input, evaluation);
    printMetrics(std::cout, metricsOf(input, evaluation));
    if (!out.empty()) std::cout << "written: " << out << "/metrics.csv, errors.csv, evaluation.svg\n";
  } catch (const std::exception& error) {
    std::cerr << "evaluate: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
