// SPDX-License-Identifier: BSD-3-Clause
// Checks that a stored map fits the present camera.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "vip_slam_backend/map_io/map_file.h"

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr double kMaxFocal = 0.01;   // relative difference of focal lengths, as between calibrations of one camera
constexpr double kMaxCentre = 0.05;  // difference of principal points as a share of the width

bool differ(double a, double b) { return std::abs(a - b) > kMaxFocal * std::max(a, b); }

bool isFisheye(const CameraIntrinsics& camera) { return camera.model == DistortionModel::kEquidistant; }

std::string describe(const CameraIntrinsics& camera) {
  return formatted("%d x %d pixels, fx %.1f, fy %.1f, cx %.1f, cy %.1f%s", camera.width, camera.height, camera.fx,
                   camera.fy, camera.cx, camera.cy, isFisheye(camera) ? ", fisheye" : "");
}

}  // namespace

void requireCamera(const StoredMap& stored, const CameraIntrinsics& camera, const std::string& path) {
  if (!stored.camera) return;
  const CameraIntrinsics& made = *stored.camera;
  // The depth grids of stored keyframes are interpreted with the present camera's intrinsics.
  const double centre = std::hypot(made.cx - camera.cx, made.cy - camera.cy);
  if (made.width == camera.width && made.height == camera.height && !differ(made.fx, camera.fx) &&
      !differ(made.fy, camera.fy) && centre <= kMaxCentre * camera.width && isFisheye(made) == isFisheye(camera))
    return;
  throw std::runtime_error(path + ": made with images of " + describe(made) + ", but the camera now has " +
                           describe(camera) +
                           formatted("; expected the same size and lens, focal lengths within %g %% and the centre "
                                     "within %g %% of the width",
                                     100 * kMaxFocal, 100 * kMaxCentre));
}

}  // namespace vip_slam
