// SPDX-License-Identifier: BSD-3-Clause
// The complete evaluation of one run: everything that the command `evaluate` prints, writes and draws.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "vip_slam_eval/metrics/association_metrics.h"
#include "vip_slam_eval/metrics/plane_metrics.h"
#include "vip_slam_eval/metrics/trajectory_consistency.h"
#include "vip_slam_eval/metrics/trajectory_metrics.h"
#include "vip_slam_eval/report/metric_table.h"

namespace vip_slam {

struct EvaluationInput {
  std::string title;
  Trajectory truth, estimate;
  std::vector<PoseWithCovariance> covariances;  ///< empty: no NEES
  std::optional<std::vector<TruePlane>> true_planes;
  std::optional<std::vector<PlaneEstimate>> planes;
  std::optional<std::vector<LabelledPoint>> points;

  Alignment alignment = Alignment::kYaw;  ///< used for the picture, the planes and the points
  double max_gap = 0.1;                   ///< seconds; true poses further apart are not interpolated
  double gap_seconds = 0.5;               ///< a longer interval without an estimate is a gap
  double time_offset = 0;                 ///< t_truth = t_estimate + time_offset
  bool level = true;                      ///< see joinedErrors()
  std::vector<double> rpe_seconds = {1.0, 10.0};
  std::vector<double> rpe_metres = {1.0, 5.0, 10.0};
};

struct Evaluation {
  std::vector<PosePair> pairs;
  AbsoluteError se3, yaw, position;  ///< ATE by alignment
  AbsoluteError shown;               ///< by the chosen alignment
  std::vector<RelativeError> over_time, over_distance;
  Coverage coverage;
  std::optional<Nees> nees;
  std::optional<PlaneMetrics> planes;
  std::optional<AssociationMetrics> associations;
};

/// Throws std::runtime_error when estimate and truth do not overlap in time.
Evaluation evaluate(const EvaluationInput& input);

MetricTable metricsOf(const EvaluationInput& input, const Evaluation& evaluation);
/// Trajectory over the truth from above, errors and height over time, planes when given. An SVG document.
std::string evaluationPicture(const EvaluationInput& input, const Evaluation& evaluation);
/// Creates `folder` when needed and leaves metrics.csv, errors.csv, evaluation.svg and, with planes, planes.csv and
/// true_planes.csv; none of them when one cannot be written.
void writeEvaluation(const std::string& folder, const EvaluationInput& input, const Evaluation& evaluation);

}  // namespace vip_slam
