// SPDX-License-Identifier: BSD-3-Clause
// The feature tracker's references: each track's patch in the image where it began, its match in the newest image, and
// what is measured there.
#include <cmath>

#include "vip_slam_frontend/filter/gating.h"
#include "vip_slam_frontend/tracking/feature_tracker.h"
#include "vip_slam_frontend/tracking/patch_alignment.h"
#include "vip_slam_frontend/tracking/pixel_noise.h"

namespace vip_slam {

namespace {

constexpr int kMaxMissed = 5;  // images in a row in which a patch is not found

/// Variance of the newest pixel against the point that the track began with, px^2. The reference's own error is
/// enlarged with the patch.
double pixelVariance(const Track& track) {
  const double sigma = matchSigma(track.surface, track.magnification);
  const double flow = track.missed > 0 ? kFlowSigma : 0.0;
  return sigma * sigma + flow * flow + track.reference_variance * track.magnification * track.magnification;
}

}  // namespace

FeatureDepth::Source FeatureTracker::measure(Feature* feature) const {
  const Eigen::Vector2d pixel = feature->pixel.cast<double>();
  const auto place = [&](double z) {
    const Eigen::Vector3d p = view_.unproject(pixel, z);
    feature->xy = (p.head<2>() / p.z()).cast<float>();
    const Eigen::Vector2d uv = pixelAtStamp(*feature);
    return featureDepth(depth_, uv.x(), uv.y(), noise_);
  };
  FeatureDepth surface = place(kFarAway);
  // The depth is looked up at the pixel's place at the stamp, which itself depends on the depth: repeat once.
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
  // Once narrow a track stays narrow: the two patches have different errors, and alternating would move the track.
  if (track->surface.wide) {
    const Eigen::Vector3d prediction =
        T_cur_ref * track->reference->camera.unproject(track->reference_pixel, track->surface.depth);
    track->surface.wide = isWideHere(track->feature, prediction.z());
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

bool FeatureTracker::isWideHere(Feature feature, double prediction) const {
  if (depth_.empty()) return true;
  measure(&feature);
  const double z = feature.depth > 0 ? feature.depth : prediction;
  return patchSurface(depth_, pixelAtStamp(feature), z, noise_).wide;
}

void FeatureTracker::findLost(const SE3& predicted, const SE3& T_odom_C, std::vector<cv::Point2f>* next,
                              std::vector<char>* found) const {
  for (std::size_t i = 0; i < found->size(); ++i) {
    if ((*found)[i] || !tracks_[i].surface.known || !(tracks_[i].carried_depth > 0)) continue;
    Eigen::Vector2d uv;
    if (!predictMotion(tracks_[i], predicted, true, &uv)) continue;
    if (!camera_->inImage(uv, options_.border) || !allowed(uv)) continue;
    Track there = tracks_[i];
    there.feature.pixel = uv.cast<float>();
    if (!alignTrack(&there, T_odom_C, kMaxFromPrediction)) continue;
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
    // Recognised by its descriptor: a corner within this many pixels of the landmark.
    track.reference_variance = std::pow(kMaxFromPrediction / kReadingSigmas, 2);
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
    const Match match = this->match(&track, T_odom_C, kGateSigmas * kFlowSigma);
    const bool known = track.surface.known;
    track.missed = match == Match::kFound ? 0 : track.missed + 1;
    if (match == Match::kFound && (known || !surfaceIsKnown(&track))) continue;
    // Probably blur or an exposure jump: keep the reference, since a new one would lose the original point for good.
    if (match == Match::kNotFound && known && track.missed <= kMaxMissed) continue;
    if (!here) here = referenceHere(T_odom_C);
    measure(&track.feature);
    if (!known && surfaceIsKnown(&track)) {
      // Patches warped without depth slide over the surface; with depth this one is stable from now on. It gets a new
      // id, so that the two parts do not count as views of one point.
      ended_.push_back(track);
      track.feature.id = next_id_++;
      track.feature.age = 0;
      track.reference_variance = 0;
    } else {
      // The view changed too much for the old patch: the newest image becomes the reference at the present pixel.
      track.reference_variance = pixelVariance(track);
    }
    setReference(&track, here);
  }
}

bool FeatureTracker::surfaceIsKnown(Track* track) const {
  if (measure(&track->feature) != FeatureDepth::Source::kSmooth) return false;
  return patchSurface(depth_, pixelAtStamp(track->feature), track->feature.depth, noise_).known;
}

}  // namespace vip_slam
