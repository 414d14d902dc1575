// The one place of a map that a keyframe shows, told by its looks alone. Nothing else speaks against a wrong place here
// (another odometry, a loaded map), so a second place that fits about as well makes it refuse.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "vip_slam_backend/loop/loop_options.h"
#include "vip_slam_backend/loop/place_verifier.h"
#include "vip_slam_backend/place_recognition/keyframe_database.h"

namespace vip_slam {

/// Poses that are one place, up to what two matches of it differ by: 0.3 m, 0.2 rad.
bool samePlacePose(const SE3& a, const SE3& b);

/// Do keyframes one after the other point to one place of the map, as the odometry between them says they must?
class PlaceAgreement {
 public:
  /// `T_W_I`: where the keyframe was found. Whether the one before it in the same odometry agrees; remembers this one.
  bool add(const TrackedFrame& frame, const SE3& T_W_I);
  void clear() { known_ = false; }

 private:
  bool known_ = false;
  std::uint32_t epoch_ = 0;
  SE3 T_odom_I_, T_W_I_;  ///< of the keyframe before
};

/// `bow`: of the keyframe. Places are taken from keyframes that `allowed` lets pass (empty: all). Empty when none fits, or
/// two do; `reason` (may be null) then says which.
std::optional<PlaceVerification> uniquePlace(const Map& map, const KeyframeDatabase& database,
                                             const PlaceVerifier& verifier, const RelocalisationOptions& options,
                                             const Keyframe& keyframe, const BowResult& bow,
                                             const std::function<bool(KeyframeId)>& allowed, std::string* reason);

}  // namespace vip_slam
