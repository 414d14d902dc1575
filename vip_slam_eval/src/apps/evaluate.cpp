// SPDX-License-Identifier: BSD-3-Clause
// rosrun vip_slam_eval evaluate --truth T.tum --estimate E.tum [--planes-truth TP.yaml --planes P.yaml] [--out DIR]
#include <iostream>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/types/planes_yaml.h"
#include "vip_slam_core/util/command_line.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_eval/io/trajectory_source.h"
#include "vip_slam_eval/io/trajectory_text.h"
#include "vip_slam_eval/report/evaluation.h"

namespace {

/// A truth whose quaternions stand in the other order than its format's is read again in that order, and named.
void mendQuaternions(const std::string& path, vip_slam::EvaluationInput* input) {
  using vip_slam::kDegree;
  const auto scalar_first = vip_slam::scalarFirst(path);
  if (!scalar_first) return;
  const vip_slam::Trajectory reread = vip_slam::rereadQuaternions(input->truth, !*scalar_first);
  const vip_slam::QuaternionOrder order =
      vip_slam::quaternionOrder(input->truth, reread, input->estimate, input->time_offset, input->max_gap);
  if (!order.swapped) return;
  input->truth = reread;
  std::cerr << vip_slam::formatted(
      "evaluate: warning: %s: quaternions are read as %s, not as %s as its format has them: turns of %.1f degrees fit "
      "the estimate's to %.1f degrees then, otherwise to %.1f (the same is seen when the estimate's are in the wrong "
      "order)\n",
      path.c_str(), *scalar_first ? "qx qy qz qw" : "qw qx qy qz", *scalar_first ? "qw qx qy qz" : "qx qy qz qw",
      order.turning / kDegree, order.misfit_swapped / kDegree, order.misfit / kDegree);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace vip_slam;
  CommandLine line("evaluate", "Judges a trajectory, and a plane map, against ground truth.");
  EvaluationInput input;
  std::string truth, truth_topic, truth_times, estimate, estimate_topic, covariance, true_planes, planes, points, out;
  std::string alignment = "yaw";
  bool no_gravity = false;
  line.option("truth", truth, "true trajectory: TUM, EuRoC's csv, KITTI's poses (with --truth-times) or bag");
  line.required("truth");
  line.option("truth-topic", truth_topic, "topic of the truth in a bag with several");
  line.option("truth-times", truth_times, "stamps in seconds, one in a line for each of KITTI's poses");
  line.option("estimate", estimate, "estimated trajectory: TUM file or bag");
  line.required("estimate");
  line.option("estimate-topic", estimate_topic, "topic of the estimate in a bag with several");
  line.option("covariance", covariance, "the estimate's covariances, CSV as run_bag writes it: adds the NEES");
  line.flag("no-gravity", no_gravity,
            "the estimate had no IMU with gyroscope: its tilt is part of the start and is aligned for the NEES");
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
    input.level = !no_gravity;
    input.alignment = alignmentFromName(alignment);
    if (input.title.empty()) input.title = estimate;
    input.truth = readTrajectory(truth, truth_topic, nullptr, truth_times);
    std::string ran_back;
    input.estimate = readTrajectory(estimate, estimate_topic, &input.covariances, "", &ran_back);
    if (!ran_back.empty()) std::cerr << "evaluate: warning: " << ran_back << "\n";
    mendQuaternions(truth, &input);
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
