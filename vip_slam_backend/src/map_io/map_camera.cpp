// Whether a stored map and the present camera go together.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "vip_slam_backend/map_io/map_file.h"

namespace vip_slam {
namespace {

constexpr double kMostFocal = 0.01;  // share by which focal lengths may differ: calibrations of one camera do

bool differ(double a, double b) { return std::abs(a - b) > kMostFocal * std::max(a, b); }

std::string describe(const CameraIntrinsics& camera) {
  char text[96];
  std::snprintf(text, sizeof text, "%d x %d pixels, fx %.1f, fy %.1f", camera.width, camera.height, camera.fx,
                camera.fy);
  return text;
}

}  // namespace

void requireCamera(const StoredMap& stored, const CameraIntrinsics& camera, const std::string& path) {
  if (!stored.camera) return;
  const CameraIntrinsics& made = *stored.camera;
  if (made.width == camera.width && made.height == camera.height && !differ(made.fx, camera.fx) &&
      !differ(made.fy, camera.fy))
    return;
  throw std::runtime_error(path + ": made with images of " + describe(made) + ", but the camera now has " +
                           describe(camera) + "; expected the same");
}

}  // namespace vip_slam
