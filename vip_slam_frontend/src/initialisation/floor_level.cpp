// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/initialisation/floor_level.h"

#include <cmath>
#include <map>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam::frontend {

namespace {

// Of a normal against the camera's up. A floor's is off by what the camera looks down, a wall's by 90 degrees less what
// it looks up, which cameras do less.
constexpr double kUpright = 60.0;  // degrees

}  // namespace

const char* levelName(Level level) {
  switch (level) {
    case Level::kAccelerometer:
      return "the accelerometer";
    case Level::kFloor:
      return "a floor that was seen at the start";
    case Level::kCamera:
      break;
  }
  return "the first camera's axes";
}

std::optional<Eigen::Vector3d> upByFloor(const std::vector<SurfacePatch>& on_planes) {
  static const double least = std::cos(kUpright * kDegree);
  std::map<int, int> patches;
  std::optional<Eigen::Vector3d> up;
  int largest = kEnough - 1;
  for (const SurfacePatch& patch : on_planes) {
    if (patch.surface < 0 || -patch.n_C.y() < least || ++patches[patch.surface] <= largest) continue;
    largest = patches[patch.surface];
    up = patch.n_C;
  }
  return up;
}

}  // namespace vip_slam::frontend
