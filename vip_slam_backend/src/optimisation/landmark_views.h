// The landmarks of a problem and who sees them, in flat arrays: looked up in the map once, read by all who build
// factors.
#pragma once

#include <unordered_map>
#include <vector>

#include "vip_slam_backend/optimisation/problem_builder.h"

namespace vip_slam {

struct LandmarkView {
  int frame = 0;                    ///< of the problem
  std::uint32_t feature_index = 0;  ///< in the keyframe
  const Feature* feature = nullptr;
};

class LandmarkViews {
 public:
  /// Landmarks that a free keyframe sees, ascending; their views by the problem's frames, ascending. `keyframes`: the
  /// frames' keyframes, ascending.
  LandmarkViews(const Map& map, const ProblemScope& scope, const std::vector<KeyframeId>& keyframes);

  int size() const { return static_cast<int>(landmarks_.size()); }
  const MapLandmark& landmark(int l) const { return *landmarks_[l]; }
  const LandmarkView* begin(int l) const { return views_.data() + first_[l]; }
  const LandmarkView* end(int l) const { return views_.data() + first_[l + 1]; }
  /// Place of a landmark's first view in arrays over all views.
  int first(int l) const { return first_[l]; }
  int viewCount() const { return static_cast<int>(views_.size()); }

 private:
  std::vector<const MapLandmark*> landmarks_;
  std::vector<int> first_;
  std::vector<LandmarkView> views_;
};

}  // namespace vip_slam
