// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/types/camera_correction.h"

#include <cmath>

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr double kLargestOffset = 10;    // m
constexpr double kLargestScale = 0.5;    // of depth, from 1
constexpr double kLargestBearing = 0.2;  // share of the focal length
constexpr double kLargestShift = 100;    // px

/// "" when all values are within the limit; else what is wrong, with the first that is not.
template <class Derived>
std::string beyond(const char* what, const Eigen::MatrixBase<Derived>& values, double limit, const char* unit) {
  for (Eigen::Index k = 0; k < values.size(); ++k)
    if (!(std::abs(values(k)) <= limit)) return formatted("%s %g%s, at most %g", what, values(k), unit, limit);
  return "";
}

/// Maps (x, y, 1) with the bearing correction `from` to those with `to`.
Eigen::Matrix3f bearingChange(const BearingCorrection& from, const BearingCorrection& to) {
  return (to.matrix() * from.matrix().inverse()).cast<float>();
}

/// The same for depth points, which lie at the pixel of their reading: a depth image shifted to the right moves them to
/// the left.
Eigen::Matrix3f pointChange(const CameraCorrection& from, const CameraCorrection& to) {
  Eigen::Matrix3d back = Eigen::Matrix3d::Identity();
  back.col(2).head<2>() = from.shift.bearing - to.shift.bearing;
  return (to.bearing.matrix() * back * from.bearing.matrix().inverse()).cast<float>();
}

}  // namespace

std::string validateCameraCorrection(const CameraCorrection& correction) {
  using Number = Eigen::Matrix<double, 1, 1>;
  for (const std::string& problem :
       {beyond("depth offset of", Number(correction.offset), kLargestOffset, " m"),
        beyond("depth scaled by 1 and", Number(correction.scale - 1), kLargestScale, ""),
        beyond("bearings changed by", correction.bearing.value, kLargestBearing, ""),
        beyond("depth image shifted by", correction.shift.px, kLargestShift, " px"),
        beyond("depth image shifted by", correction.shift.bearing, kLargestBearing, " of the focal length")})
    if (!problem.empty()) return problem;
  const std::string curve = validateDepthCurve(correction.curve);
  return curve.empty() ? "" : "depth curve: " + curve;
}

RelativeMotion withDepthScale(const RelativeMotion& motion, double factor) {
  RelativeMotion scaled = motion;
  scaled.T_a_b = SE3(motion.T_a_b.R(), factor * motion.T_a_b.t());
  return scaled;
}

KeyframePtr withCameraCorrection(const KeyframePtr& keyframe, const CameraCorrection& correction) {
  if (keyframe->frame.camera_correction == correction) return keyframe;
  const DepthChange change(keyframe->frame.camera_correction, correction);
  auto corrected = std::make_shared<Keyframe>(*keyframe);
  corrected->frame.camera_correction = correction;
  corrected->motion = withDepthScale(keyframe->motion, correction.scale / keyframe->frame.camera_correction.scale);
  const Eigen::Matrix3f turn = bearingChange(keyframe->frame.camera_correction.bearing, correction.bearing);
  const Eigen::Vector2d shift = correction.shift.px - keyframe->frame.camera_correction.shift.px;
  DepthGrid& grid = corrected->frame.depth_grid;
  if (!shift.isZero()) {
    for (Feature& f : corrected->frame.features) f.depth = shiftedDepthAt(grid, f.pixel.cast<double>(), f.depth, shift);
    grid = shiftedDepthGrid(grid, shift);
  }
  for (Feature& f : corrected->frame.features) {
    f.depth = change(f.depth);
    f.xy = (turn * f.xy.homogeneous()).head<2>();
  }
  for (float& z : grid.z) z = change(z);
  return corrected;
}

void setCameraCorrection(const CameraCorrection& correction, PlaneObservation* observation) {
  if (observation->camera_correction == correction) return;
  const DepthChange change(observation->camera_correction, correction);
  const Eigen::Matrix3f turn = pointChange(observation->camera_correction, correction);
  observation->camera_correction = correction;
  if (observation->points.empty()) return;
  observation->G.setZero();
  for (PlaneSample& point : observation->points) {
    if (point.p_C.z() > 0) point.p_C *= change(point.p_C.z()) / point.p_C.z();
    point.p_C = turn * point.p_C;
    const Eigen::Vector4d p = point.p_C.cast<double>().homogeneous();
    observation->G += observation->weight_scale / (double(point.sigma) * double(point.sigma)) * p * p.transpose();
  }
}

}  // namespace vip_slam
