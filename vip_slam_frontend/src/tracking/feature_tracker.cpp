#include "vip_slam_frontend/tracking/feature_tracker.h"

#include <algorithm>
#include <cmath>

#include <opencv2/video/tracking.hpp>

#include "vip_slam_frontend/tracking/corner_detector.h"
#include "vip_slam_frontend/tracking/outlier_rejection.h"
#include "vip_slam_frontend/tracking/patch_alignment.h"
#include "vip_slam_frontend/tracking/pixel_noise.h"

namespace vip_slam {

namespace {

// Changes of contrast and mean grey level between two images beyond which KLT's constant brightness no longer holds.
constexpr double kExposureGain = 0.1;
constexpr double kExposureShift = 6.0;
constexpr int kExposureReach = 12;             // px around a track
constexpr std::size_t kLeastForExposure = 10;  // tracks

constexpr int kMostMissed = 5;               // images in a row in which a patch is not found
constexpr double kMostBesideForetold = 3.0;  // px

constexpr double kFarAway = 1e4;  // m

// Of a corner that was recognised by its descriptor, px^2.
constexpr double kCornerVariance = 1.0;

Eigen::Vector2d asVector(const cv::Point2f& p) { return {p.x, p.y}; }

/// Of the newest pixel as a view of what the track began with, px^2. What is wrong in the reference grows with the
/// patch.
double pixelVariance(const Track& track) {
  const double sigma = matchSigma(track.surface, track.magnification);
  const double flow = track.missed > 0 ? kFlowSigma : 0.0;
  return sigma * sigma + flow * flow + track.reference_variance * track.magnification * track.magnification;
}

}  // namespace

FeatureTracker::FeatureTracker(const TrackingOptions& options, std::shared_ptr<const CameraModel> camera,
                               const DepthNoise& noise, TimingLog* timing, const cv::Mat& mask)
    : options_(options), camera_(std::move(camera)), view_(camera_), noise_(noise), timing_(timing), mask_(mask) {}

void FeatureTracker::clear() {
  tracks_.clear();
  ended_.clear();
  pyramid_.clear();
  last_pyramid_.clear();
  gray_ = cv::Mat();
  depth_ = cv::Mat();
}

FeatureDepth::Source FeatureTracker::measure(Feature* feature) const {
  const Eigen::Vector2d pixel = feature->pixel.cast<double>();
  const auto place = [&](double z) {
    const Eigen::Vector3d p = view_.unproject(pixel, z);
    feature->xy = (p.head<2>() / p.z()).cast<float>();
    const Eigen::Vector2d uv = pixelAtStamp(*feature);
    return featureDepth(depth_, uv.x(), uv.y(), noise_);
  };
  FeatureDepth surface = place(kFarAway);
  // The depth says how far the row's motion moved the pixel, which says where to look the depth up.
  if (view_.rolls() && surface.z > 0) surface = place(surface.z);
  feature->depth = surface.z;
  feature->depth_sigma = surface.sigma;
  return surface.source;
}

Eigen::Vector2d FeatureTracker::pixelAtStamp(const Feature& feature) const {
  return view_.rolls() ? camera_->distort(feature.xy.cast<double>()) : feature.pixel.cast<double>();
}

void FeatureTracker::measure(Track* track) const {
  const FeatureDepth::Source source = measure(&track->feature);
  const bool at_edge = source != FeatureDepth::Source::kSmooth && source != FeatureDepth::Source::kNone;
  track->whitening =
      pixelWhitening(track->texture, track->residual, patchWander(track->surface, at_edge, track->missed > 0));
  track->feature.pixel_sigma = static_cast<float>(std::sqrt(pixelVariance(*track)));
  const double z = track->feature.depth;
  if (z > 0 || !depth_.empty()) track->carried_depth = z;
  const PatchSurface here = narrowPatchSurface(depth_, pixelAtStamp(track->feature), z, noise_);
  // 1 / z(p + d) = (1 + slope . d) / z
  track->depth_slope = -z * here.slope;
}

bool FeatureTracker::foretell(const Track& track, const SE3& predicted, bool has_translation,
                              Eigen::Vector2d* uv) const {
  const double z = has_translation && track.carried_depth > 0 ? track.carried_depth : kFarAway;
  const Eigen::Vector3d p = predicted.R() * (track.feature.xy.homogeneous().cast<double>() * z) +
                            (has_translation ? predicted.t() : Eigen::Vector3d(Eigen::Vector3d::Zero()));
  return view_.project(p, uv) && camera_->inImage(*uv);
}

void FeatureTracker::matchExposure(const cv::Mat& gray, const SE3& predicted, bool has_translation) {
  std::vector<double> gains, last, now;
  for (const Track& track : tracks_) {
    const Eigen::Vector2d here = track.feature.pixel.cast<double>();
    Eigen::Vector2d there;
    if (!foretell(track, predicted, has_translation, &there)) continue;
    if (!camera_->inImage(here, kExposureReach + 1) || !camera_->inImage(there, kExposureReach + 1)) continue;
    const auto around = [](const Eigen::Vector2d& uv) {
      return cv::Rect(cvRound(uv.x()) - kExposureReach, cvRound(uv.y()) - kExposureReach, 2 * kExposureReach + 1,
                      2 * kExposureReach + 1);
    };
    cv::Scalar mean_last, deviation_last, mean, deviation;
    cv::meanStdDev(gray_(around(here)), mean_last, deviation_last);
    cv::meanStdDev(gray(around(there)), mean, deviation);
    if (deviation_last[0] < 2.0 || deviation[0] < 1.0) continue;
    gains.push_back(deviation[0] / deviation_last[0]);
    last.push_back(mean_last[0]);
    now.push_back(mean[0]);
  }
  if (gains.size() < kLeastForExposure) return;
  const auto median = [](std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
    return values[values.size() / 2];
  };
  const double gain = median(gains);
  std::vector<double> offsets, changes;
  for (std::size_t i = 0; i < gains.size(); ++i) {
    offsets.push_back(now[i] - gain * last[i]);
    changes.push_back(now[i] - last[i]);
  }
  if (std::abs(gain - 1.0) < kExposureGain && std::abs(median(changes)) < kExposureShift) return;
  const double offset = median(offsets);
  cv::Mat adapted;
  gray_.convertTo(adapted, CV_8U, gain, offset);
  last_pyramid_.clear();
  cv::buildOpticalFlowPyramid(adapted, last_pyramid_, cv::Size(options_.klt_window | 1, options_.klt_window | 1),
                              options_.klt_levels);
}

void FeatureTracker::runKlt(const cv::Mat& gray, const SE3& predicted, bool has_translation,
                            std::vector<cv::Point2f>* next, std::vector<char>* found) {
  const cv::Size window(options_.klt_window | 1, options_.klt_window | 1);
  std::vector<cv::Point2f> previous;
  previous.reserve(tracks_.size());
  next->clear();
  for (const Track& track : tracks_) {
    const Feature& f = track.feature;
    previous.emplace_back(f.pixel.x(), f.pixel.y());
    Eigen::Vector2d uv;
    const bool usable = foretell(track, predicted, has_translation, &uv);
    next->push_back(usable ? cv::Point2f(static_cast<float>(uv.x()), static_cast<float>(uv.y())) : previous.back());
  }
  found->assign(tracks_.size(), 0);
  if (tracks_.empty()) return;

  const cv::TermCriteria criteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, options_.klt_iterations, 0.01);
  std::vector<std::uint8_t> status, back_status;
  cv::calcOpticalFlowPyrLK(last_pyramid_, pyramid_, previous, *next, status, cv::noArray(), window, options_.klt_levels,
                           criteria, cv::OPTFLOW_USE_INITIAL_FLOW, 1e-4);
  // Back again, from the forward result shifted by the inverse flow: one level is enough there.
  std::vector<cv::Point2f> back = previous;
  cv::calcOpticalFlowPyrLK(pyramid_, last_pyramid_, *next, back, back_status, cv::noArray(), window,
                           std::min(1, options_.klt_levels), criteria, cv::OPTFLOW_USE_INITIAL_FLOW, 1e-4);
  for (std::size_t i = 0; i < previous.size(); ++i) {
    const cv::Point2f d = back[i] - previous[i];
    const Eigen::Vector2d uv = asVector((*next)[i]);
    (*found)[i] = status[i] && back_status[i] && std::hypot(d.x, d.y) < options_.forward_backward_px &&
                  uv.allFinite() && uv.x() >= options_.border && uv.y() >= options_.border &&
                  uv.x() < gray.cols - options_.border && uv.y() < gray.rows - options_.border && allowed(uv);
  }
}

FeatureTracker::Match FeatureTracker::match(Track* track, const SE3& T_odom_C, double most_px) const {
  if (!track->reference) return Match::kOtherView;
  PatchWarp warp;
  const SE3 T_cur_ref = T_odom_C.inverse() * track->reference->T_odom_C;
  if (!patchWarp(track->reference->camera, view_, track->reference_pixel, track->surface, T_cur_ref, &warp))
    return Match::kOtherView;
  const double scale = std::sqrt(warp.A.determinant());
  const double shear = (warp.A / scale - (warp.A / scale).inverse().transpose()).norm();
  if (!(scale > 0.45) || !(scale < 2.2) || !(shear < 1.5)) return Match::kOtherView;
  const Eigen::Vector2d start = track->feature.pixel.cast<double>();
  // For good: matches with either patch err otherwise, and a track that goes to and fro between them moves.
  if (track->surface.wide) {
    const Eigen::Vector3d foretold =
        T_cur_ref * track->reference->camera.unproject(track->reference_pixel, track->surface.depth);
    track->surface.wide = isWideHere(track->feature, foretold.z());
  }
  const PatchAlignment aligned = alignPatch(track->reference->gray, track->reference_pixel - track->reference->origin,
                                            warp, gray_, start, track->surface.wide);
  if (!aligned.ok || (aligned.pixel - start).norm() > most_px) return Match::kNotFound;
  track->surface.wide = aligned.wide;
  track->feature.pixel = aligned.pixel.cast<float>();
  track->magnification = 1.0 / warp.A.jacobiSvd().singularValues()(1);
  track->texture = aligned.texture;
  track->residual = aligned.residual;
  return Match::kFound;
}

bool FeatureTracker::isWideHere(Feature feature, double foretold) const {
  if (depth_.empty()) return true;
  measure(&feature);
  const double z = feature.depth > 0 ? feature.depth : foretold;
  return patchSurface(depth_, pixelAtStamp(feature), z, noise_).wide;
}

void FeatureTracker::findLost(const SE3& predicted, const SE3& T_odom_C, std::vector<cv::Point2f>* next,
                              std::vector<char>* found) const {
  for (std::size_t i = 0; i < found->size(); ++i) {
    if ((*found)[i] || !tracks_[i].surface.known || !(tracks_[i].carried_depth > 0)) continue;
    Eigen::Vector2d uv;
    if (!foretell(tracks_[i], predicted, true, &uv)) continue;
    if (!camera_->inImage(uv, options_.border) || !allowed(uv)) continue;
    Track there = tracks_[i];
    there.feature.pixel = uv.cast<float>();
    if (!alignTrack(&there, T_odom_C, kMostBesideForetold)) continue;
    (*next)[i] = cv::Point2f(there.feature.pixel.x(), there.feature.pixel.y());
    (*found)[i] = 1;
  }
}

void FeatureTracker::setReference(Track* track, const std::shared_ptr<const ReferenceImage>& reference) const {
  track->reference = reference;
  track->reference_pixel = track->feature.pixel.cast<double>();
  track->magnification = 1.0;
  track->missed = 0;
  track->surface = patchSurface(depth_, pixelAtStamp(track->feature), track->feature.depth, noise_);
  track->texture = patchTexture(gray_, track->reference_pixel, track->surface.wide);
  track->residual = 0;
}

void FeatureTracker::addTrack(Track track, const SE3& T_odom_C) {
  if (!track.reference) {
    setReference(&track, referenceHere(T_odom_C));
    track.reference_variance = kCornerVariance;
  }
  measure(&track);
  tracks_.push_back(std::move(track));
}

std::shared_ptr<ReferenceImage> FeatureTracker::referenceHere(const SE3& T_odom_C) const {
  auto here = std::make_shared<ReferenceImage>();
  here->gray = gray_;
  here->T_odom_C = T_odom_C;
  here->camera = view_;
  return here;
}

void FeatureTracker::restartReferences(const SE3& T_odom_C, const std::shared_ptr<const RowPoses>& rows) {
  view_ = RowCamera(camera_, rows);
  const std::shared_ptr<ReferenceImage> here = referenceHere(T_odom_C);
  for (Track& track : tracks_) {
    measure(&track);
    setReference(&track, here);
  }
}

void FeatureTracker::alignWithReferences(const SE3& T_odom_C) {
  std::shared_ptr<ReferenceImage> here;
  for (Track& track : tracks_) {
    const Match match = this->match(&track, T_odom_C, options_.reference_max_correction_px);
    const bool known = track.surface.known;
    track.missed = match == Match::kFound ? 0 : track.missed + 1;
    if (match == Match::kFound && (known || !surfaceIsKnown(&track))) continue;
    // Blur, a jump of the exposure: with another reference it would never come back to what it began with.
    if (match == Match::kNotFound && known && track.missed <= kMostMissed) continue;
    if (!here) here = referenceHere(T_odom_C);
    measure(&track.feature);
    if (!known && surfaceIsKnown(&track)) {
      // Patches warped without depth slide over what they show; from here on this one stays where it is. It begins
      // anew, so that nobody takes the two for views of one point.
      ended_.push_back(track);
      track.feature.id = next_id_++;
      track.feature.age = 0;
      track.reference_variance = 0;
    } else {
      // The view changed too much for the old patch: the present one becomes the reference, where it was found.
      track.reference_variance = pixelVariance(track);
    }
    setReference(&track, here);
  }
}

bool FeatureTracker::surfaceIsKnown(Track* track) const {
  if (measure(&track->feature) != FeatureDepth::Source::kSmooth) return false;
  return patchSurface(depth_, pixelAtStamp(track->feature), track->feature.depth, noise_).known;
}

TrackingResult FeatureTracker::track(const cv::Mat& gray, const cv::Mat& depth, const ForetoldMotion& predicted,
                                     bool has_translation, const SE3& T_odom_C,
                                     const std::shared_ptr<const RowPoses>& rows, double t) {
  TrackingResult result;
  view_ = RowCamera(camera_, rows);
  ++image_count_;
  std::vector<cv::Point2f> next;
  std::vector<char> found;
  {
    ScopedTimer timer(timing_, "frontend.track", t);
    pyramid_.swap(last_pyramid_);
    pyramid_.clear();
    cv::buildOpticalFlowPyramid(gray, pyramid_, cv::Size(options_.klt_window | 1, options_.klt_window | 1),
                                options_.klt_levels);
    if (!last_pyramid_.empty()) matchExposure(gray, predicted.T_current_previous, has_translation);
    if (!last_pyramid_.empty()) runKlt(gray, predicted.T_current_previous, has_translation, &next, &found);
    gray_ = gray;
    depth_ = depth;
    if (has_translation) findLost(predicted.T_current_previous, T_odom_C, &next, &found);
  }
  ended_.clear();
  if (tracks_.empty() || found.empty()) return result;

  ScopedTimer timer(timing_, "frontend.match", t);
  std::vector<PointPair> pairs;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (!found[i]) continue;
    const Feature& last = tracks_[i].feature;
    const double z = tracks_[i].carried_depth;
    const Eigen::Vector3d p = view_.unproject(asVector(next[i]), z > 0 ? z : kFarAway);
    PointPair pair{last.xy.cast<double>(), p.head<2>() / p.z(), z, static_cast<int>(last.age)};
    camera_->distort(pair.xy_current, &pair.pixels);
    pair.pixels /= camera_->focal();
    if (!(pair.pixels.determinant() > 1e-4)) pair.pixels.setIdentity();  // where the distortion folds over
    pairs.push_back(pair);
    index.push_back(i);
  }
  RansacOptions ransac;
  ransac.threshold = options_.ransac_px / camera_->focal();
  ransac.iterations = options_.ransac_iterations;
  ransac.seed = image_count_;
  const RansacResult model = rejectOutliers(pairs, predicted, ransac, &result.moves_by_itself);
  result.lost_klt = static_cast<int>(tracks_.size() - pairs.size());
  result.lost_outlier = static_cast<int>(pairs.size()) - model.inliers;
  result.pose_ok = model.ok && model.with_depth;
  result.T_current_previous = model.T_current_previous;
  if (result.pose_ok && !model.free_rotation) {
    result.step = fitTranslation(pairs, model.inlier, predicted.T_current_previous.R(), model.t_given_rotation,
                                 0.5 * ransac.threshold);
  }

  for (std::size_t k = 0; k < index.size() && predicted.interval > 0; ++k) {
    result.regions.add({next[index[k]].x, next[index[k]].y}, pairs[k].depth_previous, model.inlier[k]);
  }
  std::vector<Track> kept;
  kept.reserve(index.size());
  for (std::size_t k = 0; k < index.size(); ++k) {
    if (!model.inlier[k]) continue;
    Track track = std::move(tracks_[index[k]]);
    track.feature.pixel = Eigen::Vector2f(next[index[k]].x, next[index[k]].y);
    ++track.feature.age;
    const Eigen::Vector3d last = track.carried_depth * track.feature.xy.homogeneous().cast<double>();
    if (track.carried_depth > 0) track.carried_depth = (predicted.T_current_previous * last).z();
    kept.push_back(std::move(track));
  }
  for (Track& track : tracks_) {
    if (track.reference) ended_.push_back(std::move(track));  // those that survived were moved out
  }
  tracks_.swap(kept);
  if (options_.refine_against_reference) alignWithReferences(T_odom_C);
  for (Track& track : tracks_) measure(&track);
  result.tracked = static_cast<int>(tracks_.size());
  return result;
}

std::vector<std::size_t> FeatureTracker::replenish(const SE3& T_odom_C, bool force, double t) {
  std::vector<std::size_t> added;
  const int missing = options_.max_features - static_cast<int>(tracks_.size());
  // A corner search costs about as much as the tracking; a handful of missing features can wait.
  if (missing <= 0 || gray_.empty() || (!force && missing < options_.max_features / 8 && image_count_ % 4 != 0)) {
    return added;
  }
  ScopedTimer timer(timing_, "frontend.detect", t);
  std::vector<cv::Point2f> occupied;
  for (const Track& track : tracks_) occupied.emplace_back(track.feature.pixel.x(), track.feature.pixel.y());
  const std::shared_ptr<ReferenceImage> here = referenceHere(T_odom_C);
  for (const Corner& corner : detectCorners(gray_, occupied, missing, options_, mask_)) {
    Track track;
    track.feature.id = next_id_++;
    track.feature.pixel = Eigen::Vector2f(corner.pixel.x, corner.pixel.y);
    measure(&track.feature);
    setReference(&track, here);
    measure(&track);
    added.push_back(tracks_.size());
    tracks_.push_back(std::move(track));
  }
  return added;
}

}  // namespace vip_slam
