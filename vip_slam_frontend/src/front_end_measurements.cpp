// SPDX-License-Identifier: BSD-3-Clause
// What one image gives to the filter: rolling-shutter poses, depth at the stamp, features, stillness, surfaces.
#include <algorithm>
#include <cmath>

#include "vip_slam_core/imu/gyro_correction.h"
#include "vip_slam_frontend/filter/shared_depth.h"
#include "vip_slam_frontend/filter/triangulation.h"

#include "front_end_impl.h"

namespace vip_slam {

namespace {

constexpr double kOfLag = 0.5;  // one sigma of the lag between depth and colour, as a share of it

}  // namespace

std::shared_ptr<const RowPoses> FrontEnd::Impl::rows(const Readout& readout, const NavState& nav) const {
  if (readout.instant()) return nullptr;
  const std::vector<ImuSample> around =
      inertial_.between(std::max(inertial_.oldest(), nav.t + std::min({readout.first, readout.last, 0.0})),
                        std::min(inertial_.newest(), nav.t + std::max({readout.first, readout.last, 0.0})));
  if (around.empty()) return nullptr;
  return std::make_shared<RowPoses>(readout, nav, withGyroCorrection(around, filter_.window().gyro_correction),
                                    extrinsics(), sensor_.gravity);
}

cv::Mat FrontEnd::Impl::depthAtStamp(const DepthReading& depth, const NavState& nav) {
  const Readout readout = Readout::around(sensor_.depth_rolling_shutter, depth.lag);
  if (depth.image.empty() || readout.instant()) return depth.image;
  ScopedTimer timer(timing_, "frontend.depth_rows", nav.t);
  const std::shared_ptr<const RowPoses> poses = rows(readout, nav);
  return poses ? depth_input_.atStamp(depth.image, *poses) : depth.image;
}

std::vector<FilterMeasurement> FrontEnd::Impl::measurements(const Propagation& propagation) const {
  const SE3 T_I_C = extrinsics();
  const Eigen::Matrix3d R_C_I = T_I_C.R().transpose();
  const Eigen::Vector3d& omega = propagation.omega_I;
  const Eigen::Vector3d v_I = propagation.predicted.T_W_I.R().transpose() * propagation.predicted.v_W;
  const Eigen::Vector3d omega_C = R_C_I * omega, v_C = R_C_I * (v_I + omega.cross(T_I_C.t()));
  std::vector<FilterMeasurement> list;
  list.reserve(tracker_.tracks().size());
  for (const Track& track : tracker_.tracks()) {
    const Feature& f = track.feature;
    const Eigen::Vector2d xy = f.xy.cast<double>();
    const Eigen::Vector2d depth_slope = camera_->focal() * track.depth_slope;
    const double rate = depth_slope.isZero() ? 0.0 : depthRate(xy, f.depth, depth_slope, omega_C, v_C);
    const double z = f.depth > 0 ? f.depth : sensor_.depth_noise.max_range;
    const double from_middle = (f.pixel.y() + 0.5) / camera_->height() - 0.5;
    const double shared = f.depth > 0 ? surfaces_.learnt().shared() * f.depth_sigma : 0.0;
    list.push_back({f.id, xy, f.depth, f.depth_sigma, depth_slope, rate, track.whitening, bearingJacobian(*camera_, xy),
                    -from_middle * bearingRate(xy, z, omega_C, v_C), shared});
  }
  return list;
}

std::vector<Eigen::Vector3d> FrontEnd::Impl::trackedPoints() const {
  std::vector<Eigen::Vector3d> points;
  for (const Track& track : tracker_.tracks()) {
    const Feature& f = track.feature;
    const double z = f.depth > 0 ? f.depth : sensor_.depth_noise.max_range;
    points.emplace_back(z * f.xy.x(), z * f.xy.y(), z);
  }
  return points;
}

SurfaceMatches FrontEnd::Impl::matchSurfaces(const ImageStep& step) {
  const int index = filter_.window().indexOf(surfaces_.reference());
  if (index < 0 || step.depth.empty()) return {};
  ScopedTimer timer(timing_, "frontend.surfaces", step.t);
  const SE3 T_odom_ref = cameraPose(filter_.window(), filter_.window().clones[index]);
  SurfaceMatches matches = surfaces_.match(step.depth, step.T_odom_C.inverse() * T_odom_ref, bodies_.regions());
  const double turned = step.propagation.omega_I.norm() * std::abs(step.read.lag);
  // Colour and depth that are not taken together: their stamps, and so the warp to the colour image's, are unsure.
  for (SurfacePair& pair : matches.pairs) pair.shared = std::hypot(pair.shared, kOfLag * turned * pair.q_cur.norm());
  return matches;
}

void FrontEnd::Impl::renewSurfaces(const cv::Mat& depth, std::size_t matched, double t) {
  if (depth.empty()) return;
  // The oldest clone leaves the window with the next image; changed now, this image is tied to both references.
  const bool leaving = filter_.window().indexOf(surfaces_.reference()) <= filter_.window().indexOf(filter_.oldest().id);
  if (!leaving && 2 * matched >= surfaces_.size()) return;
  ScopedTimer timer(timing_, "frontend.surfaces", t);
  surfaces_.setReference(depth, filter_.window().clones.back().id, bodies_.regions());
}

}  // namespace vip_slam
