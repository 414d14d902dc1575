// The steps of one image: check, predict, track, estimate, output.
#include "vip_slam_core/util/formatted.h"

#include <Eigen/LU>

#include "front_end_impl.h"

namespace vip_slam {

namespace {

// Nearly all features gated in this many images in a row: the estimate has diverged from the measurements.
constexpr int kGatedImages = 30;
// Rate that a saturated gyro does not measure, one sigma, as a share of the limit of its range.
constexpr double kBeyondRange = 0.3;
// One sigma of the motion between two images where they cannot be aligned, rad and m; floor of that by points. Points
// have the same pixels as the filter's tracks, which it takes for independent: factor on their variance.
constexpr double kUnknownTurn = 0.02, kUnknownStep = 0.02, kPointsLeast = 1e-3, kSharedByTracks = 9.0;
// What one alignment errs, the next one does too: in each direction, one sigma in rad and m, and as a share of the
// motion. Judged on real recordings of a Kinect and an Xtion.
constexpr double kAlignedLeast = 2e-3, kAlignedShare = 0.05;
// A turn between images that optical flow need not follow, and how far from it dense alignment sees another one, rad.
constexpr double kBeyondFlow = 0.1, kTurnsApart = 0.05;
constexpr double kAlignedGate = 4.0;  // sigmas, between the two

/// Why the IMU does not cover an image at `t_imu`.
std::string uncovered(const frontend::InertialInput& imu, double t_imu) {
  if (imu.newest() < imu.oldest()) return "no IMU yet";
  if (t_imu < imu.oldest()) return formatted("the IMU begins at %.3f s, the image needs %.3f s", imu.oldest(), t_imu);
  return formatted("the IMU reaches to %.3f s, the image needs %.3f s", imu.newest(), t_imu);
}

/// Of the errors that alignments in a row share, for a turn (rad) or a displacement (m) of this size.
double commonVariance(double motion) {
  const double share = kAlignedShare * motion;
  return kAlignedLeast * kAlignedLeast + share * share;
}

/// Where the images cannot be aligned: the motion that goes on.
frontend::AlignedMotion unaligned(const SE3& motion) {
  frontend::AlignedMotion unknown{motion, Matrix6d::Zero()};
  unknown.covariance.diagonal() << Eigen::Vector3d::Constant(kUnknownTurn * kUnknownTurn),
      Eigen::Vector3d::Constant(kUnknownStep * kUnknownStep);
  return unknown;
}

}  // namespace

FrameOutput FrontEnd::Impl::process(const FrameInput& input, const FrontEnd::PoseReady& on_pose) {
  ScopedTimer timer(timing_, "frontend.total", input.t);
  ++counters_.images;
  followDepthShift();
  DepthReading depth;
  const std::string problem = checkInput(input, &depth);
  if (!problem.empty()) return unusable(input.t, problem);
  const double t_imu = input.t + timeOffset();
  if (inertial_.complete() && !inertial_.covers(t_imu)) {
    ++counters_.imu_missing;
    if (!filter_.started()) return unusable(input.t, uncovered(inertial_, t_imu));
  }
  last_image_t_ = input.t;
  if (filter_.started() && repeatsLastImage(input.gray, t_imu)) return repeatedImage(input.t, t_imu);
  // Depth simulated without noise repeats while the camera stands, so remember the pose of the last new depth image.
  if (filter_.started() && (!same_depth_ || depth_epoch_ != epoch_)) {
    T_odom_depth_ = filter_.nav().T_W_I * extrinsics();
    depth_epoch_ = epoch_;
  }
  same_depth_ = !depth.image.empty() && frozen_depth_.repeats(input.depth);
  if (same_depth_ && filter_.started() && !still_ && movesByImu(t_imu, T_odom_depth_)) {
    ++counters_.repeated_depth;
    depth.image.release();
  }
  // The tracker keeps the image; the caller may reuse its buffer.
  const cv::Mat gray = input.gray.clone();
  if (filter_.started()) {
    const double gap = t_imu - last_imu_t_;
    followDepthUnit(input.t, t_imu, &depth);
    if (gap <= options_.recovery.max_image_gap) return trackImage(input.t, t_imu, gray, depth, on_pose);
    reset(formatted("no image for %.2f s", gap));
  }
  return initialise(input.t, t_imu, gray, depth);
}

bool FrontEnd::Impl::admitDoubts(double max_gap, double from, double t_imu, Propagation* propagation) {
  const bool gap = max_gap > options_.recovery.max_imu_gap;
  const double cut_off = inertial_.range().cutOff(from, t_imu);
  if (gap) propagation->admitGap(max_gap, t_imu - from);
  if (cut_off > 0) {
    propagation->admitRate(kBeyondRange * cut_off, t_imu - from);
    cut_off_imu_t_ = t_imu;
  }
  keyframe_imu_broken_ = keyframe_imu_broken_ || gap || cut_off > 0;
  return gap || cut_off > 0;
}

std::optional<frontend::AlignedMotion> FrontEnd::Impl::align(const cv::Mat& gray, const DepthReading& depth,
                                                             double seconds, double t) {
  ScopedTimer timer(timing_, "frontend.align", t);
  const double depth_share = seconds > 0 ? 1 + depth.lag / seconds : 1.0;
  return dense_.motion(tracker_.gray(), tracker_.depth(), gray, depth.image, depth_share, last_motion_);
}

Propagation FrontEnd::Impl::predictByImages(double t_imu, const MotionFit& motion,
                                            const frontend::AlignedMotion& aligned) {
  const NavState from = filter_.nav();
  const bool fault = inertial_.complete();
  SE3 T_cur_prev = aligned.T_current_previous;
  Matrix6d covariance = aligned.covariance;
  covariance.diagonal().head<3>().array() += commonVariance(logSO3(T_cur_prev.R()).norm());
  covariance.diagonal().tail<3>().array() += commonVariance(T_cur_prev.t().norm());
  if (motion.ok) {
    // Few points that agree by chance promise more than they hold: all pixels together gate them.
    Matrix6d of_points = kSharedByTracks * motion.covariance;
    of_points.diagonal().array() += kPointsLeast * kPointsLeast;
    const Matrix6d gain = covariance * (covariance + of_points).inverse();
    if (frontend::motionDifference(motion.T_current_previous, T_cur_prev, covariance + of_points) < kAlignedGate) {
      T_cur_prev = T_cur_prev.boxplus(gain * motion.T_current_previous.boxminus(T_cur_prev));
      covariance -= gain * covariance;
    }
  }
  substitute(from.t, t_imu, T_cur_prev, from, fault);
  // Both the camera's motion and the body's, by the lever arm: R_C of the motion's end, t of its beginning.
  const SE3 T_I_C = extrinsics(), T_prev_cur = T_cur_prev.inverse(), T_I0_I1 = T_I_C * T_prev_cur * T_I_C.inverse();
  // Of T_cur_prev (theta by R exp, t) to that of the body's motion: the turn by -R_I_C, the displacement by
  // -R_prev_cur.
  Matrix6d J = Matrix6d::Zero();
  const Eigen::Matrix3d R_I_C = T_I_C.R();
  J.topLeftCorner<3, 3>() = -T_I0_I1.R().transpose() * R_I_C;
  J.bottomLeftCorner<3, 3>() = R_I_C * hat(T_prev_cur.t());
  J.bottomRightCorner<3, 3>() = -R_I_C * T_prev_cur.R();
  Propagation propagation = filter_.predict(T_I0_I1, J * covariance * J.transpose(), t_imu - from.t);
  propagation.open = fault;
  if (fault) fault_t_ = t_imu;
  return propagation;
}

StepReport FrontEnd::Impl::updateFilter(const Propagation& propagation, const cv::Mat& depth,
                                        const SurfaceMatches& surfaces, double previous_t_imu, double t) {
  StepReport report;
  {
    ScopedTimer timer(timing_, "frontend.update", t);
    still_ = decideStillness(previous_t_imu, propagation.predicted.t);
    report =
        filter_.step(propagation, next_clone_++, measurements(),
                     still_ ? std::optional<ResidualMotion>(stillness_.residualMotion()) : std::nullopt, &surfaces);
  }
  renewSurfaces(depth, surfaces.pairs.size(), t);
  counters_.features_used += report.features_used;
  counters_.features_gated += report.features_gated;
  counters_.surfaces_used += report.surfaces_used;
  counters_.zero_velocity += report.zero_velocity;
  counters_.sigma_px = filter_.sigmaPx();
  counters_.imu_noise_scale = filter_.imuNoiseScale();
  counters_.stamp_sigma = filter_.stampSigma();
  counters_.depth_white = surfaces_.learnt().white();
  counters_.depth_shared = surfaces_.learnt().shared();
  counters_.imu_contradicted += imuIsContradicted();
  if (report.rows > 0) counters_.nis_per_dof = report.nis / report.rows;
  const bool all_gated = report.features_gated >= 5 && report.features_used * 5 < report.features_gated;
  gated_in_a_row_ = all_gated ? gated_in_a_row_ + 1 : (report.features_used > 0 ? 0 : gated_in_a_row_);
  return report;
}

std::string FrontEnd::Impl::divergence(const StepReport& report, const TrackingResult& tracked, double t) const {
  if (!report.healthy) return "the filter became singular";
  const double speed = filter_.nav().v_W.norm(), most = options_.recovery.max_speed;
  if (speed > most) return formatted("estimated speed is %.1f m/s, at most %g (recovery/max_speed)", speed, most);
  if (gated_in_a_row_ >= kGatedImages) return formatted("%d images in a row contradict the estimate", gated_in_a_row_);
  if (contradictedForLong(tracked, t)) return "what is seen contradicts the IMU";
  return "";
}

bool FrontEnd::Impl::resume(const TrackingResult& tracked, bool surfaces_hold, double t) {
  int with_depth = 0;
  for (const Track& track : tracker_.tracks()) with_depth += track.feature.depth > 0;
  const int least = options_.recovery.min_tracks;
  const bool metric = surfaces_hold || with_depth >= least;
  judge(tracked, metric, surfaces_hold, t);
  // RANSAC gives a metric pose (pose_ok) only from points with depth; without such points, as with depth on surfaces
  // alone, tracking resumes without it.
  if (with_depth >= least) last_points_t_ = t;
  const bool agrees = tracked.pose_ok || t - last_points_t_ > kBetweenDepths;
  if (phase_ != Phase::kLost || tracked.tracked < 2 * least || !agrees) return true;
  // The IMU was integrated throughout. While the position's uncertainty stays within bounds the odometry goes on.
  if (coastedSigma() > options_.recovery.max_position_sigma) return false;
  phase_ = Phase::kTracking;
  judge(tracked, metric, surfaces_hold, t);
  return true;
}

std::string FrontEnd::Impl::keyframeReason(const TrackingResult& tracked, bool has_depth, bool surfaces_hold,
                                           double t) {
  // One without depth has no planes; when the depth camera is the slower one, wait for the next image with depth.
  const bool depth_comes = !has_depth && t - last_depth_t_ < kBetweenDepths;
  if (has_depth) last_depth_t_ = t;
  // A keyframe without features or matched surfaces (darkness) would constrain nothing; bare walls still have planes.
  const bool constrains = tracked.tracked >= options_.recovery.min_tracks || surfaces_hold;
  if (phase_ != Phase::kTracking || depth_comes || !constrains) return "";
  const SE3 T_now = filter_.nav().T_W_I * extrinsics();
  std::vector<Feature> features = makeFrame(t, true)->features;
  correctDepth(&features);  // the selector compares them with those of the last keyframe
  return selector_.decide(t, T_now, features, camera_->focal(), still_);
}

FrameOutput FrontEnd::Impl::trackImage(double t, double t_imu, const cv::Mat& gray, const DepthReading& depth_read,
                                       const FrontEnd::PoseReady& on_pose) {
  const auto startAnew = [&](const std::string& reason) {
    reset(reason);
    return initialise(t, t_imu, gray, depth_read);
  };
  double max_gap = 0;
  const double from = filter_.nav().t;
  // Where no sound gyro tells the turn, images and depth do, before tracking.
  std::vector<ImuSample> samples = inertial_.between(from, t_imu, &max_gap);
  const bool silent = inertial_.complete() && (samples.size() < 2 || max_gap > longestImuGap());
  bool by_images = !inertial_.hasGyro() || silent || (inertial_.complete() && faults_.suspects(t_imu));
  frontend::AlignedMotion moved = unaligned(last_motion_);
  if (by_images) {
    const std::optional<frontend::AlignedMotion> aligned = align(gray, depth_read, t_imu - from, t);
    if (silent && !aligned) return unusable(t, uncovered(inertial_, t_imu));
    moved = aligned.value_or(moved);
  }
  if (silent || !inertial_.complete()) {
    substitute(from, t_imu, moved.T_current_previous, filter_.nav(), silent);
    samples = inertial_.between(from, t_imu, &max_gap);
    if (silent) silent_imu_t_ = t_imu;
  }
  // As when the delay that is estimated moves an image before the last one.
  if (samples.size() < 2) return statusOnly(t, TrackingState::kDegraded, "no time between the images");
  Propagation propagation = filter_.predict(samples, inertial_.noise(from, t_imu));
  const bool doubtful = admitDoubts(max_gap, from, t_imu, &propagation) || silent || !inertial_.complete();
  // Without images the IMU propagates the pose, as in the dark, while the position's uncertainty stays within bounds.
  if (propagation.displacementSigma(filter_.covariance()) > options_.recovery.max_position_sigma)
    return startAnew(formatted("no image for %.2f s", t_imu - from));
  last_imu_t_ = t_imu;

  const SE3 T_odom_previous = filter_.nav().T_W_I * extrinsics();
  SE3 T_odom_C = propagation.predicted.T_W_I * extrinsics();
  const cv::Mat depth = depthAtStamp(depth_read, propagation.predicted);
  const bool coasting = phase_ == Phase::kLost || t - last_good_t_ > 0.5;
  const bool gap = silent || max_gap > options_.recovery.max_imu_gap;
  const PredictedMotion by_imu = predictMotion(propagation, T_odom_C, doubtful);
  PredictedMotion prediction = by_imu;
  // A turn beyond the reach of optical flow has to be seen by the images as a whole: from a wrong one nothing is
  // tracked, and the points could not contradict it.
  if (!by_images && logSO3(by_imu.T_current_previous.R()).norm() > kBeyondFlow) {
    const std::optional<frontend::AlignedMotion> seen = align(gray, depth_read, t_imu - from, t);
    by_images =
        seen && logSO3((seen->T_current_previous.inverse() * by_imu.T_current_previous).R()).norm() > kTurnsApart;
    if (by_images) moved = *seen;
  }
  if (by_images) {
    prediction.T_current_previous = moved.T_current_previous;
    prediction.turn_unknown = true;
    prediction.judges = false;
    T_odom_C = T_odom_previous * moved.T_current_previous.inverse();
  }
  const std::size_t tracks_before = tracker_.tracks().size();
  const TrackingResult tracked =
      tracker_.track(gray, depth, prediction, !coasting, T_odom_C, colourRows(propagation.predicted), t);
  if (gap && !bridgesGap(tracked, tracks_before, prediction, t_imu - from))
    return startAnew(formatted("IMU and images are missing for %.2f s", t_imu - from));
  last_motion_ = tracked.motion.ok ? tracked.motion.T_current_previous : prediction.T_current_previous;
  moving_ = tracked.regions;
  counters_.moving += tracked.moves_by_itself;
  if (!inertial_.complete() || silent || imuIsAtFault(tracked, by_imu, propagation)) {
    if (!by_images) moved = unaligned(last_motion_);
    propagation = predictByImages(t_imu, tracked.motion, moved);
    T_odom_C = propagation.predicted.T_W_I * extrinsics();
  }
  for (const Track& track : tracker_.ended()) landmarks_.retire(track);

  const double turned = propagation.omega_I.norm() * std::abs(depth_read.lag);
  const StepReport report = updateFilter(propagation, depth, matchSurfaces(depth, T_odom_C, turned, t), from, t);
  noteAgreement(tracked, t);
  const std::string failure = divergence(report, tracked, t);
  if (!failure.empty()) return startAnew(failure);
  const bool surfaces_hold = report.surfaces_used > 0;
  if (!resume(tracked, surfaces_hold, t)) return startAnew("features are back after LOST");
  depth_unit_.remember(depth, filter_.nav().T_W_I * extrinsics(), t);
  if (on_pose) on_pose(*makeFrame(t, false));
  return makeOutput(t, t_imu, keyframeReason(tracked, !depth.empty(), surfaces_hold, t));
}

}  // namespace vip_slam
