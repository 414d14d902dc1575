// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_eval/report/evaluation.h"
#include "vip_slam_eval/report/svg.h"

namespace vip_slam {
namespace {

constexpr double kPageWidth = 1500, kPageHeight = 900;

struct Box {
  double x0 = std::numeric_limits<double>::infinity(), x1 = -x0, y0 = x0, y1 = -x0;
  void add(double x, double y) {
    x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
  }
  void pad(double fraction) {
    const double by = fraction * std::max({x1 - x0, y1 - y0, 0.1});
    x0 -= by, x1 += by, y0 -= by, y1 += by;
  }
};

// Top view. Walls become lines; ceilings, which would hide everything, are left out.
void drawPlanesFromAbove(SvgAxes* axes, const std::vector<PlaneEstimate>& planes, const SvgStyle& line,
                         const SvgStyle& area) {
  for (const PlaneEstimate& plane : planes) {
    if (plane.plane.n.z() < -0.5) continue;
    const bool flat = plane.plane.n.z() > 0.5;
    for (const PlanePolygon& polygon : plane.polygons) {
      std::vector<std::vector<Eigen::Vector2d>> rings(1);
      for (const Eigen::Vector3d& p : polygon.outer) rings[0].push_back(p.head<2>());
      for (const Ring& hole : polygon.holes) {
        rings.emplace_back();
        for (const Eigen::Vector3d& p : hole) rings.back().push_back(p.head<2>());
      }
      axes->polygon(rings, flat ? area : line);
    }
  }
}

// Which evaluated poses follow a gap in the estimate: no line is drawn to them.
std::vector<char> followsGap(const EvaluationInput& input, const Evaluation& evaluation) {
  std::vector<char> after(evaluation.pairs.size(), 0);
  for (std::size_t i = 1; i < after.size(); ++i) {
    after[i] = evaluation.pairs[i].t - evaluation.pairs[i - 1].t > input.gap_seconds;
  }
  return after;
}

// The estimate, coloured by position error, as one polyline per run of equal colour.
void drawColoured(SvgAxes* axes, const std::vector<Eigen::Vector2d>& points, const std::vector<double>& errors,
                  double worst, const std::vector<char>& after_gap) {
  constexpr int kLevels = 24;
  std::vector<Eigen::Vector2d> run;
  int level = -1;
  const auto flush = [&] {
    if (run.size() > 1) axes->polyline(run, {colourScale(double(level) / (kLevels - 1)), "none", 2.2, 1.0, ""});
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    const int next = std::clamp(static_cast<int>(errors[i] / worst * kLevels), 0, kLevels - 1);
    if (after_gap[i]) {
      flush();
      run.assign(1, points[i]);
    } else if (next != level && !run.empty()) {
      run.push_back(points[i]);
      flush();
      run.assign(1, points[i]);
    } else {
      run.push_back(points[i]);
    }
    level = next;
  }
  flush();
}

void drawScale(SvgPage* page, double x, double y, double height, double worst) {
  constexpr int kSteps = 48;
  for (int k = 0; k < kSteps; ++k) {
    page->rectangle(x, y + height * (kSteps - 1 - k) / kSteps, 12, height / kSteps + 0.6,
                    {"none", colourScale(double(k) / (kSteps - 1)), 0, 1.0, ""});
  }
  page->text(x + 16, y + 9, shortNumber(100 * worst, 3) + " cm", 11);
  page->text(x + 16, y + height, "0", 11);
  page->text(x - 4, y - 22, "error, up to what", 11);
  page->text(x - 4, y - 8, "95 % are within", 11);
}

void drawTopView(SvgPage* page, const EvaluationInput& input, const Evaluation& evaluation) {
  SvgAxes axes(page, 70, 100, 780, 730);
  std::vector<Eigen::Vector2d> truth, estimate;
  std::vector<double> errors;
  Box box;
  const std::size_t thin = std::max<std::size_t>(1, input.truth.size() / 6000);
  for (std::size_t i = 0; i < input.truth.size(); i += thin) {
    truth.push_back(input.truth[i].T_W_B.t().head<2>());
    box.add(truth.back().x(), truth.back().y());
  }
  for (std::size_t i = 0; i < evaluation.pairs.size(); ++i) {
    estimate.push_back((evaluation.shown.T_W_M * evaluation.pairs[i].T_M_B).t().head<2>());
    errors.push_back(evaluation.shown.errors[i].position.norm());
    box.add(estimate.back().x(), estimate.back().y());
  }
  const auto addPlanes = [&box](const std::vector<PlaneEstimate>& planes) {
    for (const PlaneEstimate& plane : planes) {
      for (const PlanePolygon& polygon : plane.polygons) {
        for (const Eigen::Vector3d& p : polygon.outer) box.add(p.x(), p.y());
      }
    }
  };
  std::vector<PlaneEstimate> planes, seen;
  if (input.planes) planes = transformPlanes(evaluation.shown.T_W_M, *input.planes);
  if (input.true_planes) {
    for (const TruePlane& plane : *input.true_planes) {
      if (plane.seen_seconds != 0) seen.push_back(plane);
    }
  }
  addPlanes(planes);
  addPlanes(seen);
  box.pad(0.04);
  axes.range(box.x0, box.x1, box.y0, box.y1, true);
  axes.draw("From above", "x [m]", "y [m]");
  drawPlanesFromAbove(&axes, seen, {"#9a9a9a", "none", 1.2, 1.0, ""}, {"none", "#000", 0, 0.035, ""});
  drawPlanesFromAbove(&axes, planes, {"#d95f02", "none", 2.0, 0.85, ""}, {"#7570b3", "#7570b3", 1.0, 0.13, ""});
  axes.polyline(truth, {"#000", "none", 1.0, 0.55, "5 3"});
  const double worst = std::max(1e-6, evaluation.shown.position.p95);
  drawColoured(&axes, estimate, errors, worst, followsGap(input, evaluation));
  const Eigen::Vector2d start = axes.map(estimate.front()), end = axes.map(estimate.back());
  page->circle(start.x(), start.y(), 5, {"#fff", "#1b9e77", 1.5, 1.0, ""});
  page->circle(end.x(), end.y(), 5, {"#fff", "#d62728", 1.5, 1.0, ""});
  drawScale(page, 868, 130, 220, worst);

  double x = 72;
  const double y = 884;
  const auto entry = [&](const std::string& text, const SvgStyle& style, bool dot = false) {
    if (dot)
      page->circle(x + 10, y - 4, 5, style);
    else
      page->line(x, y - 4, x + 22, y - 4, style);
    page->text(x + 28, y, text, 12);
    x += 46 + 7.2 * double(text.size());
  };
  entry("truth", {"#000", "none", 1.2, 0.7, "5 3"});
  entry("estimate", {colourScale(0.4), "none", 2.4, 1.0, ""});
  entry("start", {"#fff", "#1b9e77", 1.5, 1.0, ""}, true);
  entry("end", {"#fff", "#d62728", 1.5, 1.0, ""}, true);
  if (!seen.empty()) entry("true walls", {"#9a9a9a", "none", 1.4, 1.0, ""});
  if (!planes.empty()) {
    entry("estimated walls", {"#d95f02", "none", 2.2, 0.9, ""});
    entry("estimated floors", {"#7570b3", "none", 6.0, 0.4, ""});
  }
}

// A curve over the time since the first evaluated pose.
struct Curve {
  std::vector<double> values;
  SvgStyle style;
  std::string name;
};

void drawOverTime(SvgPage* page, double top, const EvaluationInput& input, const Evaluation& evaluation,
                  const std::string& title, const std::string& label, const std::vector<Curve>& curves,
                  bool from_zero) {
  SvgAxes axes(page, 1010, top, 460, 190);
  const double t0 = evaluation.pairs.front().t;
  double low = from_zero ? 0 : std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  for (const Curve& curve : curves) {
    for (const double value : curve.values) low = std::min(low, value), high = std::max(high, value);
  }
  const double margin = 0.06 * std::max(1e-9, high - low);
  axes.range(0, evaluation.pairs.back().t - t0, from_zero ? 0 : low - margin, high + margin);
  axes.draw(title, "time [s]", label);
  const std::vector<char> after_gap = followsGap(input, evaluation);
  for (const Gap& gap : evaluation.coverage.gaps) {
    const double begin = std::max(gap.begin - t0 - input.time_offset, axes.x0());
    const double end = std::min(gap.end - t0 - input.time_offset, axes.x1());
    if (end <= begin) continue;
    axes.polygon({{{begin, axes.y0()}, {end, axes.y0()}, {end, axes.y1()}, {begin, axes.y1()}}},
                 {"none", "#d62728", 0, 0.15, ""});
  }
  double name_x = 1466;
  for (auto curve = curves.rbegin(); curve != curves.rend(); ++curve) {
    if (curve->name.empty()) continue;
    page->text(name_x, top - 8, curve->name, 12, SvgAnchor::kEnd, curve->style.stroke, true);
    name_x -= 14 + 7.4 * double(curve->name.size());
  }
  for (const Curve& curve : curves) {
    std::vector<Eigen::Vector2d> points;
    for (std::size_t i = 0; i < curve.values.size(); ++i) {
      if (after_gap[i]) {
        axes.polyline(points, curve.style);
        points.clear();
      }
      points.emplace_back(evaluation.pairs[i].t - t0, curve.values[i]);
    }
    axes.polyline(points, curve.style);
  }
}

}  // namespace

std::string evaluationPicture(const EvaluationInput& input, const Evaluation& evaluation) {
  SvgPage page(kPageWidth, kPageHeight);
  page.text(70, 38, input.title, 22, SvgAnchor::kStart, "#111", true);
  std::string summary = "ATE " + shortNumber(100 * evaluation.se3.position.rmse, 3) + " cm (SE3), " +
                        shortNumber(100 * evaluation.yaw.position.rmse, 3) + " cm (yaw), rotation " +
                        shortNumber(evaluation.yaw.rotation.rmse, 3) + " deg over " +
                        shortNumber(truePathLength(evaluation.pairs), 3) + " m, " +
                        shortNumber(100 * evaluation.coverage.fraction, 4) + " % of the time covered";
  if (evaluation.planes) {
    const PlaneMetrics& p = *evaluation.planes;
    summary += "; planes " + std::to_string(p.found) + " of " + std::to_string(p.expected) + " found, " +
               std::to_string(p.duplicates) + " duplicates, " + std::to_string(p.false_planes) + " false";
  }
  page.text(70, 64, summary, 14, SvgAnchor::kStart, "#444");
  drawTopView(&page, input, evaluation);

  std::vector<double> position, rotation, true_z, estimated_z;
  for (std::size_t i = 0; i < evaluation.pairs.size(); ++i) {
    const PoseError& e = evaluation.shown.errors[i];
    position.push_back(100 * e.position.norm());
    rotation.push_back(e.rotation / kDegree);
    true_z.push_back(evaluation.pairs[i].T_W_B.t().z());
    estimated_z.push_back(true_z.back() + e.position.z());
  }
  drawOverTime(&page, 100, input, evaluation, "Position error", "[cm]",
               {{position, {"#3b528b", "none", 1.4, 1.0, ""}, ""}}, true);
  drawOverTime(&page, 370, input, evaluation, "Rotation error", "[deg]",
               {{rotation, {"#d95f02", "none", 1.4, 1.0, ""}, ""}}, true);
  drawOverTime(
      &page, 640, input, evaluation, "Height", "z [m]",
      {{true_z, {"#777", "none", 2.4, 0.6, ""}, "truth"}, {estimated_z, {"#21918c", "none", 1.2, 1.0, ""}, "estimate"}},
      false);
  return page.str();
}

}  // namespace vip_slam
