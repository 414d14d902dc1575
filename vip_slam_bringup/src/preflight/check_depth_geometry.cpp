// Registered depth that lies in the image of the colour camera without its lens: by its camera_info, and by its edges.
#include <cmath>

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

}  // namespace

Findings checkDepthGeometry(const Recording& r) {
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
