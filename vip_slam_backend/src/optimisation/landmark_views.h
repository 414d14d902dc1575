// The landmarks of a problem and who sees them, in flat arrays: looked up in the map once, read by all who build
// factors.
//
// A landmark that was found again is known by several tracks. Within a track every view matches one reference patch,
// and its error is constant to a few hundredths of a pixel; another track began at a corner detected anew, half a pixel
// of that image beside the first. So each track becomes a point of its own, and one view of it, as uncertain as that,
// ties it to the landmark's longest track.
#pragma once

#include <unordered_map>
#include <vector>

#include "vip_slam_backend/optimisation/problem_builder.h"

namespace vip_slam {

struct LandmarkView {
  int frame = 0;                    ///< of the problem
  bool own_track = true;            ///< false: of another track than the point, or a corner that is not tracked
  std::uint32_t feature_index = 0;  ///< in the keyframe
  const Feature* feature = nullptr;
  /// Of the view that ties another track to the point: how far apart the corners of the two tracks are here, as a factor
  /// on the error of one where it was detected. What is half a pixel from afar is more from near by.
  double apart = 1;
};

class LandmarkViews {
 public:
  /// Points of the landmarks that a free keyframe sees, ascending by landmark; their views by the problem's frames,
  /// ascending. `keyframes`: the frames' keyframes, ascending.
  LandmarkViews(const Map& map, const ProblemScope& scope, const std::vector<KeyframeId>& keyframes);

  int size() const { return static_cast<int>(points_.size()); }
  const MapLandmark& landmark(int l) const { return *points_[l]; }
  /// Of the points of one landmark the first, which holds its longest track, stands for it.
  bool standsForLandmark(int l) const { return l == 0 || points_[l - 1] != points_[l]; }
  const LandmarkView* begin(int l) const { return views_.data() + first_[l]; }
  const LandmarkView* end(int l) const { return views_.data() + first_[l + 1]; }
  /// Place of a landmark's first view in arrays over all views.
  int first(int l) const { return first_[l]; }
  int viewCount() const { return static_cast<int>(views_.size()); }

 private:
  void addPoints(const Map& map, const MapLandmark& landmark, const std::vector<KeyframeId>& keyframes,
                 std::vector<LandmarkView>& seen);

  std::vector<const MapLandmark*> points_;
  std::vector<int> first_;
  std::vector<LandmarkView> views_;
};

}  // namespace vip_slam
