#include "track_noise.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <Eigen/Cholesky>

#include "vip_slam_backend/factors/reprojection.h"

namespace vip_slam {
namespace {

constexpr int kLeastViews = 5;            // of a track: so many keyframes ago its landmark was made, and adjusted since
constexpr std::size_t kLeastTracks = 30;  // below it the median is one of a few
constexpr double kClearly = 2.0, kLargest = 8.0;  // a factor below the one is none

/// Root of the median; reorders.
double rootOfMedian(std::vector<double>* ratios) {
  const auto middle = ratios->begin() + static_cast<std::ptrdiff_t>(ratios->size() / 2);
  std::nth_element(ratios->begin(), middle, ratios->end());
  return std::sqrt(*middle);
}

}  // namespace

double trackNoiseFactor(const LandmarkViews& views, const std::vector<FrameGeometry>& frames) {
  std::vector<double> ratios, of_the_map;  // of how the views of a track agree, and of how they agree with the map
  for (int l = 0; l < views.size(); ++l) {
    if (!views.standsForLandmark(l)) continue;
    // Landmarks that were found again are where several tracks have them together, a corner of half a pixel off each;
    // what a track's noise explains is how its views agree, with the point where this one has it.
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
    if (seen < kLeastViews) continue;
    H.diagonal() *= 1.0 + 1e-9;  // all views from one place leave the depth open
    const double explained = g.dot(H.ldlt().solve(g));
    if (!std::isfinite(explained)) continue;
    ratios.push_back(std::max(0.0, squared - explained) / (2 * seen - 3));  // the point takes three
    of_the_map.push_back(squared / (2 * seen - 3));
  }
  if (ratios.size() < kLeastTracks) return 1;
  if (!(rootOfMedian(&ratios) > kClearly)) return 1;
  // An error that the views of a track share moves their point along, so that they agree better than they are right.
  return std::clamp(rootOfMedian(&of_the_map), kClearly, kLargest);
}

std::string trackNoiseDifference(double factor) {
  if (factor <= 1) return "";
  char text[320];
  std::snprintf(
      text, sizeof text,
      "pixels of tracks miss the map by %.1f times what their noise explains, and count for as much less: is the "
      "lens calibrated (camera/distortion), the readout known (color/rolling_shutter), colour registered with "
      "depth, and depth of the same moment? check_bag tells some of it",
      factor);
  return text;
}

}  // namespace vip_slam
