// SPDX-License-Identifier: BSD-3-Clause
#include "track_noise.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "vip_slam_backend/factors/reprojection.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/statistics.h"

namespace vip_slam {
namespace {

constexpr int kMinViews = 5;            // of a track: its landmark has then been adjusted over as many keyframes
constexpr std::size_t kMinTracks = 30;  // for a stable median
constexpr double kClearly = 2.0, kLargest = 8.0;  // a factor below kClearly is not significant; upper limit

}  // namespace

double trackNoiseFactor(const LandmarkViews& views, const std::vector<FrameGeometry>& frames) {
  std::vector<double> ratios, of_the_map;  // chi2 per dof of a track's views with each other, and with the map
  for (int l = 0; l < views.size(); ++l) {
    if (!views.standsForLandmark(l)) continue;
    // A re-acquired landmark is a compromise of several tracks, whose corners differ by about half a pixel. A track's
    // own noise is the scatter of its views about the point that fits this track best.
    int seen = 0;
    double squared = 0;
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    for (const LandmarkView* v = views.begin(l); v != views.end(l); ++v) {
      Eigen::Vector2d r;
      Eigen::Matrix<double, 2, 6> J_pose;
      Eigen::Matrix<double, 2, 3> J;
      if (!v->own_track || v->slides ||
          !reprojectionResidual(frames[v->frame], views.landmark(l).p_W, v->xy.cast<double>(), 1.0 / v->sigma, &r,
                                &J_pose, &J))
        continue;
      ++seen;
      squared += r.squaredNorm();
      H.noalias() += J.transpose() * J;
      g.noalias() += J.transpose() * r;
    }
    if (seen < kMinViews) continue;
    H.diagonal() *= 1.0 + 1e-9;  // with all views from one place the depth is not observable
    const double explained = g.dot(H.ldlt().solve(g));
    if (!std::isfinite(explained)) continue;
    ratios.push_back(std::max(0.0, squared - explained) / (2 * seen - 3));  // the point takes three degrees of freedom
    of_the_map.push_back(squared / (2 * seen - 3));
  }
  if (ratios.size() < kMinTracks) return 1;
  if (!(std::sqrt(upperMedian(std::move(ratios))) > kClearly)) return 1;
  // An error shared by the views of a track moves their common point, so their mutual agreement underestimates it.
  return std::clamp(std::sqrt(upperMedian(std::move(of_the_map))), kClearly, kLargest);
}

std::string trackNoiseDifference(double factor) {
  if (factor <= 1) return "";
  return formatted(
      "pixels of tracks miss the map by %.1f times what their noise explains, and count for as much less: is the "
      "lens calibrated (camera/distortion), the readout known (color/rolling_shutter), colour registered with "
      "depth, and depth of the same moment? check_bag tells some of it",
      factor);
}

}  // namespace vip_slam
