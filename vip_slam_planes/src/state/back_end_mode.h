// SPDX-License-Identifier: BSD-3-Clause
// The back end's mode as its updates show it. In localisation-only mode it removes each waiting keyframe at once; a
// keyframe that it places, or a global update, shows that it maps.
#pragma once

#include <algorithm>

#include "placed_keyframes.h"
#include "vip_slam_core/types/map_update.h"

namespace vip_slam::planes {

class BackEndMode {
 public:
  /// Before the update is applied to the keyframes.
  void follow(const MapUpdate& update, const PlacedKeyframes& keyframes) {
    const bool maps =
        update.global || std::any_of(update.keyframes.begin(), update.keyframes.end(),
                                     [&keyframes](const KeyframeEstimate& k) { return keyframes.waits(k.id); });
    const bool gives_back = std::any_of(update.removed_keyframes.begin(), update.removed_keyframes.end(),
                                        [&keyframes](KeyframeId id) { return keyframes.waits(id); });
    localising_ = !maps && (localising_ || gives_back);
  }
  /// Its map and planes do not change.
  bool localising() const { return localising_; }

 private:
  bool localising_ = false;
};

}  // namespace vip_slam::planes
