// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/sequence/camera_model_error.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_sim/rng.h"

namespace vip_slam {
namespace {

// What calibrations get wrong, in the proportion of one to another.
constexpr double kFocal = 1e-3, kAspect = 5e-4;       ///< shares
constexpr double kCentre = 0.5;                       ///< px
constexpr double kRadial = 4e-3, kTangential = 4e-4;  ///< of normalised coordinates

}  // namespace

double CameraModelError::difference(const CameraIntrinsics& a, const CameraIntrinsics& b) {
  const auto from = makeCamera(a), to = makeCamera(b);
  double sum = 0;
  int count = 0;
  for (int i = 0; i <= 16; ++i)
    for (int k = 0; k <= 12; ++k) {
      const Eigen::Vector2d uv((a.width - 1) * i / 16.0, (a.height - 1) * k / 12.0);
      Eigen::Vector2d xy;
      if (!from->undistort(uv, &xy)) continue;
      sum += (to->distort(xy) - uv).squaredNorm();
      ++count;
    }
  return std::sqrt(sum / std::max(count, 1));
}

CameraIntrinsics CameraModelError::trueCamera(const CameraIntrinsics& stated) const {
  if (px_ <= 0) return stated;
  CameraIntrinsics base = stated;
  if (base.model == DistortionModel::kNone) {
    base.model = DistortionModel::kRadTan;
    base.distortion.assign(5, 0.0);
  }
  const auto changed = [&](double amount) {
    Rng rng(seed_ * 6151 + 11);
    CameraIntrinsics c = base;
    const double focal = amount * kFocal * rng.gauss(), aspect = amount * kAspect * rng.gauss();
    c.fx *= 1 + focal + aspect;
    c.fy *= 1 + focal - aspect;
    c.cx += amount * kCentre * rng.gauss();
    c.cy += amount * kCentre * rng.gauss();
    for (std::size_t i = 0; i < c.distortion.size() && i < 4; ++i) {
      const bool tangential = c.model == DistortionModel::kRadTan && i >= 2;
      c.distortion[i] += amount * (tangential ? kTangential : kRadial) * rng.gauss();
    }
    return c;
  };
  double amount = 1;
  for (int pass = 0; pass < 8; ++pass) amount *= px_ / difference(stated, changed(amount));
  return changed(amount);
}

}  // namespace vip_slam
