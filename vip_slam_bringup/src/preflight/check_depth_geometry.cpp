// SPDX-License-Identifier: BSD-3-Clause
// Registered depth that lies in the image of the colour camera without its lens: by its camera_info, and by its edges.
#include <cmath>
#include <optional>

#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_core/sensor/depth_to_colour.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr double kMatters = 2.0;  // px of distortion

/// +1: the depth edges lie where the camera without its lens has them, -1: where the colour image has them, 0: not
/// told.
int verdictOfEdges(const DepthEdgeRecord& edges) {
  const std::size_t n = edges.as_colour.size();
  if (n < 5) return 0;
  double mean = 0, level = 0, square = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double gain = edges.as_undistorted[i] - edges.as_colour[i];
    mean += gain / double(n);
    square += gain * gain / double(n);
    level += 0.5 * (edges.as_undistorted[i] + edges.as_colour[i]) / double(n);
  }
  const double sigma = std::sqrt(std::max(0.0, square - mean * mean) / double(n - 1));
  if (std::abs(mean) < 0.15 * level || std::abs(mean) < 4 * sigma) return 0;
  return mean > 0 ? 1 : -1;
}

constexpr double kFar = 0.04;  // of the image's width: torn, not merely beside

bool elsewhere(const EdgeShift& s, int width) {
  constexpr int kLeastImages = 4;
  return s.images >= kLeastImages && s.sigmas > 7 && s.unmoved < 0.3 && s.shift.norm() > kFar * width;
}

/// Stretches in which the image is not that of the depth, or an image that lies beside it throughout.
std::optional<Finding> shiftFinding(const Recording& r) {
  const EdgeShiftRecord& e = r.edge_shifts;
  if (r.color.sizes.size() != 1 || r.color.stamps.empty()) return std::nullopt;
  const int width = r.color.sizes.begin()->first;
  const EdgeShift* first = nullptr;
  double end = 0;
  for (std::size_t i = 0; i < e.seconds.size(); ++i) {
    if (!elsewhere(e.seconds[i], width)) continue;
    if (!first) first = &e.seconds[i];
    end = i + 1 < e.seconds.size() ? e.seconds[i + 1].t : -1;
  }
  if (first) {
    const double start = r.color.stamps.front();
    std::string when = first == &e.seconds.front() ? "" : formatted(" from %.1f s on", first->t - start);
    if (end > 0) when = formatted(" from %.1f to %.1f s", first->t - start, end - start);
    return Finding{
        Severity::kError, "colour and depth",
        formatted("do not fit%s: edges of the image lie (%.0f, %.0f) px beside those of depth", when.c_str(),
                  first->shift.x(), first->shift.y()),
        "torn images, with rows or columns wrapped round? look at them; a lost packet on USB, or a wrong step"};
  }
  // Beside it throughout, near and far edges alike: else a chance fit of a pattern that repeats.
  const Eigen::Vector2d& beside = e.all.shift;
  const double cell = width / 160.0, least = std::max(2.5, 0.006 * width);
  if (e.all.sigmas < 7 || beside.norm() < least) return std::nullopt;
  for (const EdgeShift* part : {&e.near, &e.far})
    if (part->sigmas < 7 || (part->shift - beside).norm() > std::max(1.5, 0.75 * cell)) return std::nullopt;
  const std::string measured =
      formatted("its edges lie (%.1f, %.1f) px beside those of the colour image", -beside.x(), -beside.y());
  if (!r.depth.frame_id.empty() && r.depth.frame_id != r.color.frame_id)
    return Finding{Severity::kError, "depth image",
                   measured + ": it is not registered, its frame is " + r.depth.frame_id,
                   "switch on the driver's depth registration (align_depth, depth_registration, depth_to_rgb), or set "
                   "depth/registered: false with depth_camera and T_color_depth"};
  return Finding{Severity::kWarning, "depth image", measured,
                 "is it registered to colour (align_depth)? are its holes filled from one side (switch hole filling "
                 "off)? what is advised of depth/shift is not to be entered before"};
}

}  // namespace

Findings checkDepthGeometry(const Recording& r) {
  if (const auto beside = shiftFinding(r)) return {*beside};
  const CameraIntrinsics& colour = r.sensor.intrinsics_from_camera_info ? r.color_camera : r.sensor.camera;
  if (r.sensor.topics.depth.empty() || !r.sensor.depth_registered) return {};
  const double most = largestDistortion(colour);
  if (most < kMatters) return {};
  const bool said = r.sensor.depth_undistorted;
  const int edges = verdictOfEdges(r.depth_edges);
  const std::string measured =
      formatted("depth edges lie on image edges %s the colour image's distortion (up to %.0f px)",
                edges > 0 ? "without" : "with", most);
  if (edges != 0 && (edges > 0) == said) return {{Severity::kGood, "depth image", measured, ""}};
  if (edges > 0)
    return {{Severity::kWarning, "depth image", measured,
             "set depth/undistorted: true in the sensor file, or take the rectified colour image"}};
  if (edges < 0) return {{Severity::kWarning, "depth image", measured, "set depth/undistorted: false"}};
  if (!said && r.depth_camera.width > 0 && largestDistortion(r.depth_camera) == 0)
    return {{Severity::kWarning, "depth camera_info",
             formatted("has no distortion, that of colour has up to %.0f px", most),
             "when the driver aligns depth to undistorted colour: depth/undistorted: true, or the rectified colour "
             "image; a scene with edges in the corners tells"}};
  return {};
}

}  // namespace vip_slam
