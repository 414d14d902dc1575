// SPDX-License-Identifier: BSD-3-Clause
// Plane and association metrics as rows of a table and as CSV.
#pragma once

#include <string>

#include "vip_slam_eval/metrics/association_metrics.h"
#include "vip_slam_eval/metrics/plane_metrics.h"
#include "vip_slam_eval/report/metric_table.h"

namespace vip_slam {

void appendPlaneMetrics(MetricTable* table, const PlaneMetrics& planes);
void appendAssociationMetrics(MetricTable* table, const AssociationMetrics& associations);

/// One row per estimate: the true plane it matches, errors, overlap and area.
std::string planeMatchesCsv(const PlaneMetrics& planes);
/// One row per true plane: whether it counts, was found, how many estimates match it, area seen and covered.
std::string truePlanesCsv(const PlaneMetrics& planes);

}  // namespace vip_slam
