// SPDX-License-Identifier: BSD-3-Clause
// The landmarks of a problem and their views in flat arrays: looked up in the map once, read by all builders of
// factors. Features are scattered over the keyframes' memory, beyond the second-level cache: the fields needed are
// copied.
//
// A landmark that was re-acquired has several tracks. Within a track all views match one reference patch, and their
// common error is constant to a few hundredths of a pixel; another track began at a newly detected corner, about half a
// pixel away in that image. So each track becomes a point of its own, and one view of it, with a sigma of that size,
// ties it to the landmark's longest track.
#pragma once

#include <vector>

#include "pixel_noise.h"
#include "vip_slam_backend/optimisation/problem_builder.h"

namespace vip_slam {

struct LandmarkView {
  int frame = 0;                                 ///< of the problem
  std::uint32_t feature_index = 0;               ///< in the keyframe
  Eigen::Vector2f xy = Eigen::Vector2f::Zero();  ///< undistorted normalised coordinates
  float depth = 0, depth_sigma = 0;              ///< those of the feature, metres
  double sigma = 0;                              ///< one sigma of this view of the point, normalised
  bool own_track = true;  ///< false: belongs to another track than the point, or is an untracked corner
  bool slides = false;    ///< belongs to a track that slides with the motion
};

/// Landmarks by which one stage of prefetching is ahead of the next.
constexpr std::size_t kAhead = 4;

class LandmarkViews {
 public:
  /// Points of the landmarks that a free keyframe sees, ascending by landmark; their views by the problem's frames,
  /// ascending. `keyframes`: the frames' keyframes, ascending.
  LandmarkViews(const Map& map, const ProblemScope& scope, const std::vector<KeyframeId>& keyframes,
                const PixelNoise& noise);

  int size() const { return static_cast<int>(points_.size()); }
  const MapLandmark& landmark(int l) const { return *points_[l]; }
  /// The first point of a landmark, that of its longest track, represents the landmark.
  bool standsForLandmark(int l) const { return l == 0 || points_[l - 1] != points_[l]; }
  const LandmarkView* begin(int l) const { return views_.data() + first_[l]; }
  const LandmarkView* end(int l) const { return views_.data() + first_[l + 1]; }
  /// Index of a landmark's first view in arrays over all views.
  int first(int l) const { return first_[l]; }
  int viewCount() const { return static_cast<int>(views_.size()); }

 private:
  /// A view and the feature behind it, before it is known which point it belongs to.
  struct Seen {
    int frame;
    std::uint32_t feature_index;
    const Feature* feature;
  };
  struct Track {
    LandmarkId id;
    int views;
    int until_tie;       ///< number of views left before the middle one
    double first_depth;  ///< m: depth of the landmark in the track's first keyframe; 0: unknown
  };
  /// Views of one landmark whose keyframes are frames of the problem.
  void collect(const MapLandmark& landmark);
  void addPoints(const Map& map, const MapLandmark& landmark, const std::vector<KeyframeId>& keyframes,
                 const PixelNoise& noise);
  void findFirstDepths(const Map& map, const MapLandmark& landmark);
  /// Factor `apart` of PixelNoise::sigma(). `depth`: of the landmark in the present view, m.
  static double cornersApart(const Track& a, const Track& b, double depth);
  void addView(const Seen& seen, bool own_track, double apart, const PixelNoise& noise);

  std::vector<const MapLandmark*> points_;
  std::vector<int> first_;
  std::vector<LandmarkView> views_;

  // While the views are collected.
  KeyframeId lowest_ = 0;
  std::vector<int> frame_of_;             // by keyframe - lowest_
  std::vector<const Feature*> features_;  // of each frame
  std::vector<Seen> seen_;
  std::vector<Track> tracks_;
};

}  // namespace vip_slam
