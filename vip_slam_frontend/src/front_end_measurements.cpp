// What one image gives to the filter: rolling-shutter poses, depth at the stamp, features, stillness, surfaces.
#include <algorithm>
#include <cmath>
#include <map>

#include "vip_slam_core/imu/gyro_correction.h"
#include "vip_slam_core/util/statistics.h"
#include "vip_slam_frontend/filter/triangulation.h"

#include "front_end_impl.h"

namespace vip_slam {

namespace {

constexpr double kOfLag = 0.5;  // one sigma of the lag between depth and colour, as a share of it

}  // namespace

std::shared_ptr<const RowPoses> FrontEnd::Impl::rows(const Readout& readout, const NavState& nav) const {
  if (readout.instant()) return nullptr;
  const std::vector<ImuSample> around =
      inertial_.between(std::max(inertial_.oldest(), nav.t + std::min(readout.first, 0.0)),
                        std::min(inertial_.newest(), nav.t + std::max(readout.last, 0.0)));
  if (around.empty()) return nullptr;
  return std::make_shared<RowPoses>(readout, nav, withGyroCorrection(around, filter_.window().gyro_correction),
                                    extrinsics(), sensor_.gravity);
}

cv::Mat FrontEnd::Impl::depthAtStamp(const DepthReading& depth, const NavState& nav) {
  const Readout readout = Readout::around(sensor_.depth_rolling_shutter, depth.lag);
  if (depth.image.empty() || readout.instant()) return depth.image;
  ScopedTimer timer(timing_, "frontend.depth_rows", nav.t);
  if (!depth_rows_) depth_rows_ = std::make_unique<DepthRows>(camera_);  // most sensors never need its tables
  const std::shared_ptr<const RowPoses> poses = rows(readout, nav);
  return poses ? depth_rows_->atStamp(depth.image, *poses) : depth.image;
}

std::vector<FilterMeasurement> FrontEnd::Impl::measurements() const {
  std::vector<FilterMeasurement> list;
  list.reserve(tracker_.tracks().size());
  for (const Track& track : tracker_.tracks()) {
    const Feature& f = track.feature;
    const Eigen::Vector2d xy = f.xy.cast<double>();
    const Eigen::Vector2d depth_slope = camera_->focal() * track.depth_slope;
    list.push_back({f.id, xy, f.depth, f.depth_sigma, depth_slope, track.whitening, bearingJacobian(*camera_, xy)});
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

bool FrontEnd::Impl::decideStillness(double previous_t_imu, double t_imu) {
  if (moving_.any()) moving_imu_t_ = t_imu;
  const bool image_counts = !movedLately(t_imu);  // features on a body that pauses do not show that the camera stands
  const ZuptOptions& options = options_.filter.zupt;
  PixelList now;
  for (const Track& track : tracker_.tracks()) now.emplace_back(track.feature.id, track.feature.pixel);
  const auto disparity = [&now](const PixelList& then) {
    std::map<LandmarkId, Eigen::Vector2f> pixels(then.begin(), then.end());
    std::vector<float> moved;
    for (const auto& item : now) {
      const auto it = pixels.find(item.first);
      if (it != pixels.end()) moved.push_back((it->second - item.second).norm());
    }
    if (moved.size() < 5) return -1.0;
    return static_cast<double>(upperMedian(std::move(moved)));
  };
  StillnessCues cues;
  // Back to the last image at least: in a longer gap between images the camera may have moved and stopped again.
  double since = std::min(t_imu - options.window, previous_t_imu);
  since = std::max(inertial_.oldest(), since);
  // An image alone does not tell standing from a wall that moves along.
  if (!inertial_.measured(since, t_imu)) return false;
  cues.imu = imuSpread(inertial_.between(since, t_imu), &sensor_.imu_noise);
  cues.tracks = image_counts ? static_cast<int>(now.size()) : 0;
  cues.speed = filter_.nav().v_W.norm();
  cues.px_per_metre = leastImageMotion(trackedPoints(), camera_->focal());
  while (recent_pixels_.size() > 1 && t_imu - recent_pixels_[1].first >= options.window - 1e-6) {
    recent_pixels_.pop_front();
  }
  if (!recent_pixels_.empty()) cues.disparity_px = disparity(recent_pixels_.front().second);
  if (still_ && image_counts) cues.anchor_disparity_px = disparity(still_anchor_);
  recent_pixels_.emplace_back(t_imu, now);
  const bool still = stillness_.update(cues);
  // Without features in common with the anchor image (the lights went out) the motion since it is unknown: renew it.
  const bool anchor_gone = still_ && cues.anchor_disparity_px < 0 && cues.tracks > options.min_tracks;
  if (still && (!still_ || anchor_gone)) still_anchor_ = std::move(now);
  return still;
}

SurfaceMatches FrontEnd::Impl::matchSurfaces(const cv::Mat& depth, const SE3& T_odom_C, double turned, double t) {
  const int index = filter_.window().indexOf(surfaces_.reference());
  if (index < 0 || depth.empty() || !options_.filter.use_surfaces) return {};
  ScopedTimer timer(timing_, "frontend.surfaces", t);
  const SE3 T_odom_ref = cameraPose(filter_.window(), filter_.window().clones[index]);
  SurfaceMatches matches = surfaces_.match(depth, T_odom_C.inverse() * T_odom_ref, moving_);
  // Colour and depth that are not taken together: their stamps, and so the warp to the colour image's, are unsure.
  for (SurfacePair& pair : matches.pairs) pair.shared = std::hypot(pair.shared, kOfLag * turned * pair.q_cur.norm());
  return matches;
}

void FrontEnd::Impl::renewSurfaces(const cv::Mat& depth, std::size_t matched, double t) {
  if (depth.empty() || !options_.filter.use_surfaces) return;
  // At index 0 the reference leaves the window with the next image; changed now, this image is tied to both references.
  const bool leaving = filter_.window().indexOf(surfaces_.reference()) <= 0;
  if (!leaving && 2 * matched >= surfaces_.size()) return;
  ScopedTimer timer(timing_, "frontend.surfaces", t);
  surfaces_.setReference(depth, filter_.window().clones.back().id, moving_);
}

}  // namespace vip_slam
