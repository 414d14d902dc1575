// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/report/plane_tables.h"

#include <cmath>
#include <locale>
#include <sstream>

#include "vip_slam_core/geometry/angle.h"

namespace vip_slam {

void appendPlaneMetrics(MetricTable* table, const PlaneMetrics& p) {
  const auto put = [table](const char* name, double value, const char* unit) {
    table->push_back({"planes", name, value, unit});
  };
  put("expected", double(p.expected), "");
  put("found", double(p.found), "");
  put("recall", 100 * p.recall, "%");
  put("estimated", double(p.estimated), "");
  put("duplicates", double(p.duplicates), "");
  put("false", double(p.false_planes), "");
  put("large false", double(p.large_false_planes), "");
  put("slanted taken as level or upright", double(p.forced_planes), "");
  if (p.normal.count == 0) return;  // no plane was found: an error of 0 would be misleading
  put("normal error mean", p.normal.mean, "deg");
  put("normal error median", p.normal.median, "deg");
  put("normal error max", p.normal.max, "deg");
  put("distance error mean", p.distance.mean, "m");
  put("distance error median", p.distance.median, "m");
  put("distance error max", p.distance.max, "m");
}

void appendAssociationMetrics(MetricTable* table, const AssociationMetrics& a) {
  table->push_back({"points on planes", "associated", double(a.labelled), ""});
  table->push_back({"points on planes", "precision", 100 * a.precision, "%"});
  table->push_back({"points on planes", "recall", 100 * a.recall, "%"});
}

std::string planeMatchesCsv(const PlaneMetrics& planes) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << "estimate,truth,normal_error_deg,distance_error_m,overlap_m2,area_m2\n";
  for (const PlaneMatch& m : planes.matches) {
    out << m.estimate << ',' << (m.truth ? std::to_string(m.truth) : "none") << ',' << m.normal_error / kDegree << ','
        << m.distance_error << ',' << m.overlap << ',' << m.area << '\n';
  }
  return out.str();
}

std::string truePlanesCsv(const PlaneMetrics& planes) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << "truth,counts,found,represented_by,visible_m2,covered_m2\n";
  for (const TruePlaneResult& t : planes.truths) {
    out << t.id << ',' << t.counts << ',' << t.found << ',' << t.represented_by << ',' << t.visible_area << ','
        << t.covered_area << '\n';
  }
  return out.str();
}

}  // namespace vip_slam
