// The steps of one image: check, predict, track, estimate, hand on.
#include <algorithm>
#include <cmath>
#include <map>

#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/imu/gyro_correction.h"
#include "vip_slam_core/imu/preintegration.h"
#include "vip_slam_frontend/filter/triangulation.h"

#include "front_end_impl.h"
#include "vip_slam_core/depth/grid_spacing.h"

namespace vip_slam {

namespace {

// Features gated away in this many images in a row: the estimate has left the measurements.
constexpr int kGatedImages = 30;
// What a gyro at the end of its range leaves out, one sigma, as a share of that.
constexpr double kBeyondRange = 0.3;

}  // namespace

FrameOutput FrontEnd::Impl::process(const FrameInput& input, const FrontEnd::PoseReady& on_pose) {
  ScopedTimer timer(timing_, "frontend.total", input.t);
  ++counters_.images;
  followDepthShift();
  DepthReading depth;
  const std::string problem = checkInput(input, &depth);
  if (!problem.empty()) return unusable(input.t, problem);
  const double t_imu = input.t + timeOffset();
  if (!imu_.covers(t_imu)) {
    ++counters_.imu_missing;
    return unusable(input.t, imu_.empty() ? "no IMU yet" : "the IMU does not cover the image");
  }
  last_image_t_ = input.t;
  if (filter_.started() && repeatsLastImage(input.gray, t_imu)) return repeatedImage(input.t, t_imu);
  // What is rendered without noise repeats by itself while it stands.
  if (filter_.started() && (!same_depth_ || depth_epoch_ != epoch_)) {
    T_odom_depth_ = filter_.nav().T_W_I * extrinsics();
    depth_epoch_ = epoch_;
  }
  same_depth_ = !depth.image.empty() && frozen_depth_.repeats(input.depth);
  if (same_depth_ && filter_.started() && !still_ && movesByImu(t_imu, T_odom_depth_)) {
    ++counters_.repeated_depth;
    depth.image.release();
  }
  // The tracker keeps images for later comparison; the caller may reuse his.
  const cv::Mat gray = input.gray.clone();
  if (filter_.started()) {
    const double gap = t_imu - last_imu_t_;
    if (gap <= options_.recovery.max_image_gap) return trackImage(input.t, t_imu, gray, depth, on_pose);
    reset("no image for " + std::to_string(gap).substr(0, 4) + " s");
  }
  return initialise(input.t, t_imu, gray, depth);
}

SE3 FrontEnd::Impl::gyroRotation(double t0, double t1) const {
  const std::vector<ImuSample> samples = imu_.between(t0, t1);
  if (samples.size() < 2) return SE3();
  const Preintegration pre(samples, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), sensor_.imu_noise);
  const Eigen::Matrix3d R_I_C = extrinsics().R();
  return SE3(Eigen::Matrix3d(R_I_C.transpose() * pre.deltaR().transpose() * R_I_C), Eigen::Vector3d::Zero());
}

std::shared_ptr<const RowPoses> FrontEnd::Impl::rows(const Readout& readout, const NavState& nav) const {
  if (readout.instant()) return nullptr;
  const std::vector<ImuSample> around = imu_.between(std::max(imu_.oldest(), nav.t + std::min(readout.first, 0.0)),
                                                     std::min(imu_.newest(), nav.t + std::max(readout.last, 0.0)));
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

FrameOutput FrontEnd::Impl::initialise(double t, double t_imu, const cv::Mat& gray, const DepthReading& depth_read) {
  const bool first = phase_ == Phase::kWaiting;
  phase_ = Phase::kInitialising;
  const SE3 rotation = first ? SE3() : gyroRotation(last_imu_t_, t_imu);
  last_imu_t_ = t_imu;
  // How it moves along is not known yet; upright as the accelerometer says, so that gravity is no acceleration.
  NavState turning;
  turning.t = t_imu;
  if (const std::optional<ImuSample> sample = imu_.at(t_imu); sample && sample->accel.norm() > 1.0) {
    turning.T_W_I = SE3(gravityAlignedRotation(sample->accel), Eigen::Vector3d::Zero());
  }
  const cv::Mat depth = depthAtStamp(depth_read, turning);
  tracker_.track(gray, depth, {rotation, 0, 0}, false, SE3(), colourRows(turning), t);
  tracker_.replenish(SE3(), true, t);
  const int stride = strideOn(camera_->width(), camera_->height(), options_.frame_grid_stride);
  // After a restart more is known of them than the configuration says.
  initialiser_.setMounting(extrinsics(), filter_.mounting().gyro_correction);
  std::optional<FilterPrior> prior =
      initialiser_.add({t_imu, measurements(), makeDepthGrid(depth, stride, sensor_.depth_noise)}, imu_);
  if (!prior) {
    const std::string why = status_.state == TrackingState::kInitialising && !status_.reason.empty() && first
                                ? status_.reason + "; " + initialiser_.reason()
                                : initialiser_.reason();
    status_ = {TrackingState::kInitialising, why};
    return statusOnly(t, status_.state, status_.reason);
  }
  startAtBase(sensor_.T_base_imu, &*prior);
  const std::optional<ImuSample> here = imu_.at(t_imu);
  const Eigen::Vector3d omega = here ? Eigen::Vector3d(here->gyro - prior->state.bias_gyro) : Eigen::Vector3d::Zero();
  filter_.start(*prior, next_clone_++, omega);
  if (prior->standing) {
    stillness_.begin(imuSpread(imu_.between(t_imu - options_.initialisation.standing_seconds, t_imu)));
  }
  initialiser_.reset();
  phase_ = Phase::kTracking;
  started_imu_t_ = t_imu;
  status_ = {TrackingState::kTracking, ""};
  last_good_t_ = last_held_t_ = last_metric_t_ = last_points_t_ = last_agreed_t_ = t;
  doubt_imu_t_ = t_imu;  // the velocity itself has to prove right first
  shock_imu_t_ = -1e300;
  last_good_variance_ = filter_.covariance().block<3, 3>(3, 3).diagonal().maxCoeff();
  // The tracks' references were taken under unknown poses: begin them here.
  const SE3 T_odom_C = filter_.nav().T_W_I * extrinsics();
  tracker_.restartReferences(T_odom_C, colourRows(filter_.nav()));
  return makeOutput(t, t_imu, "first");
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
  const bool image_counts = !movedLately(t_imu);  // what pauses says nothing about standing still
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
    std::nth_element(moved.begin(), moved.begin() + moved.size() / 2, moved.end());
    return static_cast<double>(moved[moved.size() / 2]);
  };
  StillnessCues cues;
  // Back to the last image at least: while there was none it may have gone elsewhere and stopped again.
  const double since = std::min(t_imu - options.window, previous_t_imu);
  cues.imu = imuSpread(imu_.between(std::max(imu_.oldest(), since), t_imu), &sensor_.imu_noise);
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
  // Of an anchor whose features are gone (the lights went out) nothing tells any more what adds up since.
  const bool anchor_gone = still_ && cues.anchor_disparity_px < 0 && cues.tracks > options.min_tracks;
  if (still && (!still_ || anchor_gone)) still_anchor_ = std::move(now);
  return still;
}

SurfaceMatches FrontEnd::Impl::matchSurfaces(const cv::Mat& depth, const SE3& T_odom_C, double t) const {
  const int index = filter_.window().indexOf(surfaces_.reference());
  if (index < 0 || depth.empty() || !options_.filter.use_surfaces) return {};
  ScopedTimer timer(timing_, "frontend.surfaces", t);
  const SE3 T_odom_ref = cameraPose(filter_.window(), filter_.window().clones[index]);
  return surfaces_.match(depth, T_odom_C.inverse() * T_odom_ref, moving_);
}

void FrontEnd::Impl::renewSurfaces(const cv::Mat& depth, std::size_t matched, double t) {
  if (depth.empty() || !options_.filter.use_surfaces) return;
  // At index 0 the reference leaves with the next image; changed now, this image belongs to the old and the new one.
  const bool leaving = filter_.window().indexOf(surfaces_.reference()) <= 0;
  if (!leaving && 2 * matched >= surfaces_.size()) return;
  ScopedTimer timer(timing_, "frontend.surfaces", t);
  surfaces_.setReference(depth, filter_.window().clones.back().id, moving_);
}

FrameOutput FrontEnd::Impl::trackImage(double t, double t_imu, const cv::Mat& gray, const DepthReading& depth_read,
                                       const FrontEnd::PoseReady& on_pose) {
  double max_gap = 0;
  const double from = filter_.nav().t;
  const std::vector<ImuSample> samples = imu_.between(from, t_imu, &max_gap);
  if (samples.size() < 2) return statusOnly(t, TrackingState::kDegraded, "no IMU between the images");
  const bool gap = max_gap > options_.recovery.max_imu_gap;
  if (max_gap > longestImuGap()) {
    reset("IMU gap of " + std::to_string(max_gap).substr(0, 4) + " s");
    return initialise(t, t_imu, gray, depth_read);
  }
  keyframe_imu_broken_ = keyframe_imu_broken_ || gap;
  Propagation propagation = filter_.predict(samples);
  if (gap) propagation.admitGap(max_gap, t_imu - from);
  const double cut_off = gyro_range_.cutOff(from, t_imu);
  if (cut_off > 0) {
    propagation.admitRate(kBeyondRange * cut_off, t_imu - from);
    keyframe_imu_broken_ = true;
    cut_off_imu_t_ = t_imu;
  }
  // Without images the IMU carries the pose as it does in the dark, for as long as it tells where.
  if (propagation.displacementSigma(filter_.covariance()) > options_.recovery.max_position_sigma) {
    reset("no image for " + std::to_string(t_imu - from).substr(0, 4) + " s");
    return initialise(t, t_imu, gray, depth_read);
  }
  last_imu_t_ = t_imu;

  const SE3 T_I_C = extrinsics();
  const SE3 T_odom_C = propagation.predicted.T_W_I * T_I_C;
  const cv::Mat depth = depthAtStamp(depth_read, propagation.predicted);
  const bool coasting = phase_ == Phase::kLost || t - last_good_t_ > 0.5;
  const ForetoldMotion foretold = foretell(propagation, T_odom_C, gap || cut_off > 0);
  const std::size_t tracks_before = tracker_.tracks().size();
  const TrackingResult tracked =
      tracker_.track(gray, depth, foretold, !coasting, T_odom_C, colourRows(propagation.predicted), t);
  if (gap && !bridgesGap(tracked, tracks_before, foretold, t_imu - from)) {
    reset("IMU and images are missing for " + std::to_string(t_imu - from).substr(0, 4) + " s");
    return initialise(t, t_imu, gray, depth_read);
  }
  moving_ = tracked.regions;
  admitShock(tracked, foretold, t_imu - from, &propagation);
  for (const Track& track : tracker_.ended()) landmarks_.retire(track);

  const SurfaceMatches surfaces = matchSurfaces(depth, T_odom_C, t);
  StepReport report;
  {
    ScopedTimer timer(timing_, "frontend.update", t);
    still_ = decideStillness(from, t_imu);
    report = filter_.step(propagation, next_clone_++, measurements(),
                          still_ ? std::optional<Unrest>(stillness_.unrest()) : std::nullopt, &surfaces);
  }
  renewSurfaces(depth, surfaces.pairs.size(), t);
  counters_.moving += tracked.moves_by_itself;
  counters_.features_used += report.features_used;
  counters_.features_gated += report.features_gated;
  counters_.surfaces_used += report.surfaces_used;
  counters_.zero_velocity += report.zero_velocity;
  counters_.sigma_px = filter_.sigmaPx();
  counters_.imu_noise_scale = filter_.imuNoiseScale();
  counters_.stamp_sigma = filter_.stampSigma();
  counters_.imu_contradicted += imuIsContradicted();
  if (report.rows > 0) counters_.nis_per_dof = report.nis / report.rows;
  const bool all_gated = report.features_gated >= 5 && report.features_used * 5 < report.features_gated;
  gated_in_a_row_ = all_gated ? gated_in_a_row_ + 1 : (report.features_used > 0 ? 0 : gated_in_a_row_);

  noteAgreement(tracked, t);
  const std::string failure = !report.healthy                                          ? "the filter became singular"
                              : filter_.nav().v_W.norm() > options_.recovery.max_speed ? "estimated speed is impossible"
                              : gated_in_a_row_ >= kGatedImages ? "measurements contradict the estimate"
                              : contradictedForLong(tracked, t) ? "what is seen contradicts the IMU"
                                                                : "";
  if (!failure.empty()) {
    reset(failure);
    return initialise(t, t_imu, gray, depth_read);
  }
  int with_depth = 0;
  for (const Track& track : tracker_.tracks()) with_depth += track.feature.depth > 0;
  const bool surfaces_hold = report.surfaces_used > 0;
  const bool metric = surfaces_hold || with_depth >= options_.recovery.min_tracks;
  judge(tracked, metric, surfaces_hold, t);
  // The step from image to image is known with its length only where points have depth; who has none, or has it on
  // surfaces alone, goes on without.
  if (with_depth >= options_.recovery.min_tracks) last_points_t_ = t;
  const bool agrees = tracked.pose_ok || t - last_points_t_ > kBetweenDepths;
  if (phase_ == Phase::kLost && tracked.tracked >= 2 * options_.recovery.min_tracks && agrees) {
    // The IMU went on all the time. As long as it still tells where we are, the odometry goes on, too.
    if (coastedSigma() > options_.recovery.max_position_sigma) {
      reset("features are back after LOST");
      return initialise(t, t_imu, gray, depth_read);
    }
    phase_ = Phase::kTracking;
    judge(tracked, metric, surfaces_hold, t);
  }
  if (on_pose) on_pose(*makeFrame(t, false));
  const SE3 T_now = filter_.nav().T_W_I * extrinsics();
  std::string reason;
  // A keyframe of darkness would tie nothing to anything; one of bare walls still has its planes.
  // Without depth it would have no planes; where the depth camera is the slower one, an image with depth comes soon.
  const bool depth_comes = depth.empty() && t - last_depth_t_ < kBetweenDepths;
  if (!depth.empty()) last_depth_t_ = t;
  if (phase_ == Phase::kTracking && !depth_comes &&
      (tracked.tracked >= options_.recovery.min_tracks || surfaces_hold)) {
    const std::shared_ptr<TrackedFrame> frame = makeFrame(t, true);
    reason = selector_.decide(t, T_now, frame->features, camera_->focal(), still_);
  }
  return makeOutput(t, t_imu, reason);
}

}  // namespace vip_slam
