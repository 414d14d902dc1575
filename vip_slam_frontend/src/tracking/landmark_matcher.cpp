// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/landmark_matcher.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <opencv2/features2d.hpp>

#include "vip_slam_frontend/tracking/pixel_noise.h"

namespace vip_slam {

namespace {

constexpr std::size_t kMaxPatches = 8000;
constexpr int kSearchRadius = 8;    // px, of the search around a projected landmark
constexpr int kHamming = 50;        // bits, largest descriptor distance
constexpr double kFarthest = 15.0;  // m along the optical axis

// Length of the longest ray of the image at unit depth; infinite when a corner of the image has no ray.
double longestRay(const CameraModel& camera) {
  double longest = 1;
  for (int corner = 0; corner < 4; ++corner) {
    const Eigen::Vector2d uv((corner & 1) * (camera.width() - 1), (corner >> 1) * (camera.height() - 1));
    Eigen::Vector2d xy;
    if (!camera.undistort(uv, &xy)) return std::numeric_limits<double>::infinity();
    longest = std::max(longest, std::sqrt(1 + xy.squaredNorm()));
  }
  return longest;
}

}  // namespace

LandmarkMatcher::LandmarkMatcher(const TrackingOptions& options, std::shared_ptr<const CameraModel> camera)
    : options_(options),
      camera_(std::move(camera)),
      reach_(std::min(kFarAway, kFarthest * longestRay(*camera_))),
      index_(reach_) {}

void LandmarkMatcher::clear() {
  landmarks_.clear();
  index_.clear();
  forgetPatches();
}

void LandmarkMatcher::apply(const MapUpdate& update) {
  if (update.global) {  // it lists all landmarks; any other is from another map
    landmarks_.clear();
    index_.clear();
  }
  for (const LandmarkEstimate& l : update.landmarks) {
    landmarks_[l.id] = {l.p_W, l.observations, l.descriptor};
    index_.put(l.id, l.p_W);
  }
  for (LandmarkId id : update.removed_landmarks) {
    landmarks_.erase(id);
    index_.remove(id);
    erasePatch(id);
  }
  for (const auto& merge : update.merged_landmarks) {
    landmarks_.erase(merge.first);
    index_.remove(merge.first);
    erasePatch(merge.first);
  }
}

void LandmarkMatcher::retire(const Track& track) {
  // Patches of short-lived tracks are not kept; beyond kMaxPatches the oldest are dropped.
  if (!track.reference || track.feature.age < 5) return;
  const cv::Mat& image = track.reference->gray;
  const int x = static_cast<int>(std::lround(track.reference_pixel.x()));
  const int y = static_cast<int>(std::lround(track.reference_pixel.y()));
  // A narrow patch and its gradients shown at half their size, and a wide one likewise at any roll angle.
  const int narrow = 2 * (kNarrowPatch + 1), wide = 3 * (kWidePatch + 1);
  if (x < narrow || y < narrow || x + narrow >= image.cols || y + narrow >= image.rows) return;
  const cv::Rect whole(x - wide, y - wide, 2 * wide + 1, 2 * wide + 1);
  const cv::Rect window = whole & cv::Rect(0, 0, image.cols, image.rows);
  auto reference = std::make_shared<ReferenceImage>(*track.reference);
  reference->gray = image(window).clone();
  reference->origin = track.reference->origin + Eigen::Vector2d(window.x, window.y);
  erasePatch(track.feature.id);
  patches_[track.feature.id] = {reference, track.reference_pixel, track.surface, track.reference_variance, ++retired_};
  by_age_[retired_] = track.feature.id;
  if (patches_.size() > kMaxPatches) erasePatch(by_age_.begin()->second);
}

void LandmarkMatcher::erasePatch(LandmarkId id) {
  const auto it = patches_.find(id);
  if (it == patches_.end()) return;
  by_age_.erase(it->second.number);
  patches_.erase(it);
}

void LandmarkMatcher::forgetPatches() {
  patches_.clear();
  by_age_.clear();
}

int LandmarkMatcher::reacquire(FeatureTracker* tracker, const OrbExtractor& orb, const SE3& T_map_C,
                               const SE3& T_odom_C) const {
  if (landmarks_.empty() || tracker->gray().empty()) return 0;
  const cv::Mat& gray = tracker->gray();
  std::set<LandmarkId> tracked;
  std::vector<Eigen::Vector2f> taken;
  for (const Track& track : tracker->tracks()) {
    tracked.insert(track.feature.id);
    taken.push_back(track.feature.pixel);
  }
  const auto free = [&](const Eigen::Vector2d& uv, double distance) {
    return std::none_of(taken.begin(), taken.end(), [&](const Eigen::Vector2f& p) {
      return (p.cast<double>() - uv).squaredNorm() < distance * distance;
    });
  };

  struct Visible {
    LandmarkId id;
    const Entry* entry;
    Eigen::Vector2d uv;
    double z;
  };
  std::vector<Visible> visible;
  const SE3 T_C_map = T_map_C.inverse();
  for (const LandmarkId id : index_.around(T_map_C.t(), reach_)) {
    const Entry& entry = landmarks_.at(id);
    if (entry.observations < 3 || tracked.count(id)) continue;
    const Eigen::Vector3d p_C = T_C_map * entry.p_map;
    Eigen::Vector2d uv;
    if (!(p_C.z() > 0) || p_C.z() > kFarthest || !tracker->camera().project(p_C, &uv)) continue;
    if (!camera_->inImage(uv, options_.border + kSearchRadius) || !tracker->allowed(uv)) continue;
    if (free(uv, options_.min_distance)) visible.push_back({id, &entry, uv, p_C.z()});
  }
  std::stable_sort(visible.begin(), visible.end(),
                   [](const Visible& a, const Visible& b) { return a.entry->observations > b.entry->observations; });
  visible.resize(std::min(visible.size(), static_cast<std::size_t>(options_.max_features)));

  // Candidates of each landmark: its patch aligned from the projection, and the corners around; described in one call.
  std::vector<Feature> corners;
  std::vector<std::size_t> owner;
  std::vector<Track> direct;  // tracks of landmarks whose patch was aligned
  std::vector<int> aligned;   // index of direct, -1: a corner
  const auto withPatch = [&](std::size_t i, Track* track) {
    const auto patch = patches_.find(visible[i].id);
    if (patch == patches_.end()) return false;
    track->reference = patch->second.reference;
    track->reference_pixel = patch->second.pixel;
    track->surface = patch->second.surface;
    track->reference_variance = patch->second.reference_variance;
    return true;
  };
  std::vector<cv::KeyPoint> keypoints;
  for (std::size_t i = 0; i < visible.size(); ++i) {
    Track there;
    there.feature.pixel = visible[i].uv.cast<float>();
    if (withPatch(i, &there) && tracker->alignTrack(&there, T_odom_C, FeatureTracker::kMaxFromPrediction)) {
      corners.push_back(there.feature);
      owner.push_back(i);
      aligned.push_back(static_cast<int>(direct.size()));
      direct.push_back(std::move(there));
    }
    const int x = static_cast<int>(visible[i].uv.x()), y = static_cast<int>(visible[i].uv.y());
    const cv::Rect roi(x - kSearchRadius - 3, y - kSearchRadius - 3, 2 * kSearchRadius + 7, 2 * kSearchRadius + 7);
    cv::FAST(gray(roi & cv::Rect(0, 0, gray.cols, gray.rows)), keypoints, cvRound(kGreySigma), true);
    for (const cv::KeyPoint& k : keypoints) {
      Feature f;
      f.pixel = Eigen::Vector2f(k.pt.x + std::max(0, roi.x), k.pt.y + std::max(0, roi.y));
      if (!tracker->allowed(f.pixel.cast<double>())) continue;
      corners.push_back(f);
      owner.push_back(i);
      aligned.push_back(-1);
    }
  }
  orb.describe(gray, &corners);
  std::vector<int> best(visible.size(), -1), best_distance(visible.size(), kHamming + 1);
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const int distance = hammingDistance(corners[k].descriptor, visible[owner[k]].entry->descriptor);
    if (distance < best_distance[owner[k]]) {
      best_distance[owner[k]] = distance;
      best[owner[k]] = static_cast<int>(k);
    }
  }

  int count = 0;
  for (std::size_t i = 0; i < visible.size(); ++i) {
    if (best[i] < 0) continue;
    const int known = aligned[best[i]];
    Track track = known < 0 ? Track() : direct[known];
    track.feature = corners[best[i]];
    track.feature.id = visible[i].id;
    if (known < 0 && withPatch(i, &track) && !tracker->alignTrack(&track, T_odom_C, FeatureTracker::kMaxFromPrediction))
      continue;
    if (!free(track.feature.pixel.cast<double>(), options_.min_distance)) continue;
    tracker->measure(&track.feature);
    // A different depth means that another surface hides the landmark.
    if (track.feature.depth > 0 && std::abs(track.feature.depth - visible[i].z) > 0.05 * visible[i].z + 0.05) continue;
    taken.push_back(track.feature.pixel);
    tracker->addTrack(std::move(track), T_odom_C);
    ++count;
  }
  return count;
}

}  // namespace vip_slam
