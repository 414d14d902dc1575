// SPDX-License-Identifier: BSD-3-Clause
// The steps of one image: check, predict, track, estimate, output.
#include <cmath>

#include "vip_slam_core/util/formatted.h"

#include "front_end_impl.h"

namespace vip_slam {

namespace {

/// Why the IMU does not cover an image at `t_imu`.
std::string uncovered(const frontend::InertialInput& imu, double t_imu) {
  if (imu.newest() < imu.oldest()) return "no IMU yet";
  if (t_imu < imu.oldest()) return formatted("the IMU begins at %.3f s, the image needs %.3f s", imu.oldest(), t_imu);
  return formatted("the IMU reaches to %.3f s, the image needs %.3f s", imu.newest(), t_imu);
}

}  // namespace

FrameOutput FrontEnd::Impl::process(const FrameInput& input, const FrontEnd::PoseReady& on_pose) {
  ScopedTimer timer(timing_, "frontend.total", input.t);
  ++counters_.images;
  followDepth();
  if (std::isfinite(input.t)) noticeTimeJump(checks_.clockJump(input));
  const std::string problem = checks_.problem(input);
  if (!problem.empty()) return unusable(input.t, problem);
  ImageStep step;
  step.t = input.t;
  if (checks_.hasDepth(input)) step.read = depth_input_.read(input.depth, input.depth_lag);
  if (depth_input_.missingReading() > 0) counters_.missing_reading = depth_input_.missingReading();
  step.t_imu = input.t + timeOffset();
  if (inertial_.complete() && !inertial_.covers(step.t_imu)) {
    ++counters_.imu_missing;
    if (!filter_.started()) return unusable(input.t, uncovered(inertial_, step.t_imu));
  }
  checks_.accept(input.t);
  if (filter_.started() && repeatsLastImage(input.gray, step.t_imu)) return repeatedImage(input.t, step.t_imu);
  std::optional<SE3> T_odom_last;
  if (filter_.started()) T_odom_last = filter_.nav().T_W_I * extrinsics();
  const bool same_depth = depth_input_.repeats(step.read.image.empty() ? cv::Mat() : input.depth, T_odom_last);
  if (same_depth && filter_.started() && !rest_.still() && movesByImu(step.t_imu, depth_input_.repeatedPose())) {
    ++counters_.repeated_depth;
    step.read.image.release();
  }
  // The tracker keeps the image; the caller may reuse its buffer.
  step.gray = input.gray.clone();
  if (filter_.started()) {
    const double gap = step.t_imu - last_imu_t_;
    followDepthUnit(&step);
    if (gap <= options_.recovery.max_image_gap) return trackImage(std::move(step), on_pose);
    reset(formatted("no image for %.2f s", gap));
  }
  return initialise(step);
}

FrameOutput FrontEnd::Impl::startAnew(const ImageStep& step, const std::string& reason) {
  reset(reason);
  return initialise(step);
}

std::optional<frontend::AlignedMotion> FrontEnd::Impl::align(const ImageStep& step, double seconds) {
  ScopedTimer timer(timing_, "frontend.align", step.t);
  return sources_.byPixels(tracker_, step.gray, step.read, seconds);
}

std::optional<FrameOutput> FrontEnd::Impl::propagate(ImageStep* step) {
  const double from = step->from, t_imu = step->t_imu;
  double max_gap = 0;
  const std::vector<ImuSample> samples = inertial_.between(from, t_imu, &max_gap);
  // As when the delay that is estimated moves an image before the last one.
  if (samples.size() < 2) return statusOnly(step->t, TrackingState::kDegraded, "no time between the images");
  step->propagation = filter_.predict(samples, inertial_.noise(from, t_imu));
  const bool gap = max_gap > options_.recovery.max_imu_gap;
  step->gap = step->silent || gap;
  if (gap) step->propagation.admitGap(max_gap, t_imu - from);
  const bool cut_off = sources_.admitCutOff(from, t_imu, &step->propagation);
  if (cut_off) health_.noteCutOff(t_imu, inertial_.range().end());
  if (gap || cut_off) keyframes_.noteBrokenImu();
  // Without images the IMU propagates the pose, as in the dark, while the position's uncertainty stays within bounds.
  if (step->propagation.displacementSigma(filter_.covariance()) > options_.recovery.max_position_sigma)
    return startAnew(*step, formatted("no image for %.2f s", t_imu - from));
  step->T_odom_C = step->propagation.predicted.T_W_I * extrinsics();
  step->by_imu = sources_.byImu(step->propagation, step->T_odom_C, gap || cut_off || step->no_imu,
                                bodies_.movedLately(step->propagation.predicted.t), rest_.imuRests());
  return std::nullopt;
}

std::optional<FrameOutput> FrontEnd::Impl::predictMotion(ImageStep* step) {
  step->from = filter_.nav().t;
  double max_gap = 0;
  const bool covered = inertial_.between(step->from, step->t_imu, &max_gap).size() >= 2;
  step->silent = inertial_.complete() && (!covered || max_gap > options_.recovery.longestImuGap());
  step->no_imu = step->silent || !inertial_.complete();
  step->moved = sources_.goingOn();
  step->by_images = !inertial_.hasGyro() || step->silent || sources_.suspectImu(step->t_imu);
  const double seconds = step->t_imu - step->from;
  if (step->by_images) {
    const std::optional<frontend::AlignedMotion> seen = align(*step, seconds);
    if (step->silent && !seen) return unusable(step->t, uncovered(inertial_, step->t_imu));
    step->moved = seen.value_or(step->moved);
  }
  if (step->no_imu)
    sources_.substitute(step->from, step->t_imu, step->moved.T_current_previous, filter_.nav(), step->silent);
  if (step->silent) health_.noteSilence(step->t_imu);
  if (std::optional<FrameOutput> ended = propagate(step)) return ended;
  last_imu_t_ = step->t_imu;
  // A turn beyond the reach of optical flow has to be seen by the images as a whole: from a wrong one nothing is
  // tracked, and the points could not contradict it.
  if (!step->by_images && sources_.isBeyondFlow(step->by_imu.T_current_previous)) {
    const std::optional<frontend::AlignedMotion> seen = align(*step, seconds);
    step->by_images = seen && sources_.isAnotherTurn(*seen, step->by_imu.T_current_previous);
    if (step->by_images) step->moved = *seen;
  }
  return std::nullopt;
}

std::optional<FrameOutput> FrontEnd::Impl::trackPoints(ImageStep* step) {
  step->depth = depthAtStamp(step->read, step->propagation.predicted);
  PredictedMotion prediction = step->by_imu;
  if (step->by_images) {
    prediction.T_current_previous = step->moved.T_current_previous;
    prediction.turn_unknown = true;
    prediction.judges = false;
    step->T_odom_C = filter_.nav().T_W_I * extrinsics() * step->moved.T_current_previous.inverse();
  }
  const std::size_t tracks_before = tracker_.tracks().size();
  step->tracked = tracker_.track(step->gray, step->depth, prediction, !health_.coasts(step->t), step->T_odom_C,
                                 colourRows(step->propagation.predicted), step->t);
  const TrackingResult& tracked = step->tracked;
  const double unseen = step->t_imu - step->from;
  const bool images_missing = unseen > options_.recovery.max_imu_gap;
  if (step->gap && images_missing && !sources_.bridgesGap(tracked, tracks_before, prediction))
    return startAnew(*step, formatted("IMU and images are missing for %.2f s", unseen));
  sources_.setLast(tracked.motion.ok ? tracked.motion.T_current_previous : prediction.T_current_previous);
  bodies_.see(tracked.regions, step->propagation.predicted.t);
  for (const Track& track : tracker_.ended()) map_.retire(track);
  counters_.moving += tracked.moves_by_itself;
  return std::nullopt;
}

void FrontEnd::Impl::isolateFaults(ImageStep* step) {
  const bool fault = !step->no_imu && sources_.imuIsAtFault(step->tracked, step->by_imu, step->propagation);
  counters_.imu_faults += fault;
  if (!step->no_imu && !fault) return;
  if (!step->by_images) step->moved = sources_.goingOn();
  step->propagation = sources_.byImages(step->t_imu, step->tracked.motion, step->moved);
  step->T_odom_C = step->propagation.predicted.T_W_I * extrinsics();
  if (inertial_.complete()) health_.noteFault(step->t_imu);
}

void FrontEnd::Impl::updateFilter(ImageStep* step) {
  const SurfaceMatches surfaces = matchSurfaces(*step);
  {
    ScopedTimer timer(timing_, "frontend.update", step->t);
    const double t_imu = step->propagation.predicted.t;
    rest_.decide(inertial_, step->from, t_imu,
                 {&tracker_.tracks(), !bodies_.movedLately(t_imu), filter_.nav().v_W.norm(),
                  std::sqrt(filter_.covariance().block<3, 3>(6, 6).diagonal().maxCoeff()), filter_.sigmaPx(),
                  camera_->focal(), leastImageMotion(trackedPoints(), camera_->focal())});
    step->report = filter_.step(step->propagation, next_clone_++, measurements(step->propagation),
                                rest_.residualMotion(), &surfaces);
  }
  renewSurfaces(step->depth, surfaces.pairs.size(), step->t);
  step->sight = sight(*step);
  const StepReport& report = step->report;
  counters_.features_used += report.features_used;
  counters_.features_gated += report.features_gated;
  counters_.surfaces_used += report.surfaces_used;
  counters_.zero_velocity += report.zero_velocity;
  counters_.sigma_px = filter_.sigmaPx();
  const ImuNoiseScale imu_noise = filter_.imuNoise();
  counters_.imu_noise_scale = imu_noise.density;
  counters_.gyro_walk = imu_noise.gyro_walk;
  counters_.accel_walk = imu_noise.accel_walk;
  counters_.depth_white = surfaces_.learnt().white();
  counters_.depth_shared = surfaces_.learnt().shared();
  counters_.imu_contradicted += step->sight.contradicts_imu;
  if (report.rows > 0) counters_.nis_per_dof = report.nis / report.rows;
}

frontend::Sight FrontEnd::Impl::sight(const ImageStep& step) const {
  frontend::Sight sight;
  sight.t = step.t;
  sight.t_imu = step.t + timeOffset();
  sight.tracked = step.tracked.tracked;
  for (const Track& track : tracker_.tracks()) {
    const bool with_depth = track.feature.depth > 0;
    sight.with_depth += with_depth;
    sight.old_with_depth += with_depth && track.feature.age >= kOldPoint;
  }
  sight.pose_ok = step.tracked.pose_ok;
  sight.moves_by_itself = step.tracked.moves_by_itself;
  sight.surfaces_hold = step.report.surfaces_used > 0;
  sight.still = rest_.still();
  sight.contradicts_imu = imuIsContradicted();
  sight.blind = step.no_imu;
  sight.vertical_unknown = sources_.verticalUnknown();
  sight.scale_contradicts = filter_.scaleContradicts();
  sight.disputed = step.report.disputed;
  sight.variance = filter_.covariance().block<3, 3>(3, 3).diagonal().maxCoeff();
  return sight;
}

std::string FrontEnd::Impl::keyframeReason(const ImageStep& step) {
  const bool depth_comes = keyframes_.waitsForDepth(!step.depth.empty(), step.t);
  // A keyframe without features or matched surfaces (darkness) would constrain nothing; bare walls still have planes.
  const bool constrains = step.sight.tracked >= options_.recovery.min_tracks || step.sight.surfaces_hold;
  if (!health_.tracking() || depth_comes || !constrains) return "";
  const SE3 T_now = filter_.nav().T_W_I * extrinsics();
  std::vector<Feature> features = makeFrame(step.t, true)->features;
  correctDepth(&features);  // the selector compares them with those of the last keyframe
  return keyframes_.selector().decide(step.t, T_now, features, camera_->focal(), rest_.still());
}

FrameOutput FrontEnd::Impl::trackImage(ImageStep step, const FrontEnd::PoseReady& on_pose) {
  if (std::optional<FrameOutput> ended = predictMotion(&step)) return *ended;
  if (std::optional<FrameOutput> ended = trackPoints(&step)) return *ended;
  isolateFaults(&step);
  updateFilter(&step);
  const std::string failure = health_.divergence(step.report, step.sight);
  if (!failure.empty()) return startAnew(step, failure);
  if (!health_.resume(step.sight)) return startAnew(step, "features are back after LOST");
  depth_input_.remember(step.depth, step.gray, filter_.nav().T_W_I * extrinsics(), step.t);
  if (on_pose) on_pose(*makeFrame(step.t, false));
  return makeOutput(step.t, step.t_imu, keyframeReason(step));
}

}  // namespace vip_slam
