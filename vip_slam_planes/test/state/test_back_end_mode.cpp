// SPDX-License-Identifier: BSD-3-Clause
#include <memory>

#include <gtest/gtest.h>

#include "../../src/state/back_end_mode.h"

namespace vip_slam::planes {
namespace {

class Mode : public ::testing::Test {
 protected:
  Mode() {
    for (KeyframeId id : {1, 2}) {
      auto keyframe = std::make_shared<Keyframe>();
      keyframe->id = id;
      keyframes.wait(keyframe);
    }
  }
  bool localisingAfter(const MapUpdate& update) {
    mode.follow(update, keyframes);
    return mode.localising();
  }
  static MapUpdate removing(KeyframeId id) {
    MapUpdate update;
    update.removed_keyframes = {id};
    return update;
  }

  PlacedKeyframes keyframes{DepthNoise()};
  BackEndMode mode;
};

TEST_F(Mode, GivingBackAWaitingKeyframeIsLocalising) {
  EXPECT_FALSE(localisingAfter(MapUpdate()));
  EXPECT_FALSE(localisingAfter(removing(3)));  // of the map
  EXPECT_TRUE(localisingAfter(removing(1)));
  EXPECT_TRUE(localisingAfter(MapUpdate()));
}

TEST_F(Mode, PlacingAKeyframeIsMapping) {
  ASSERT_TRUE(localisingAfter(removing(1)));
  MapUpdate update;
  update.keyframes.resize(1);
  update.keyframes[0].id = 3;  // only moves
  EXPECT_TRUE(localisingAfter(update));
  update.keyframes[0].id = 2;
  update.removed_keyframes = {1};
  EXPECT_FALSE(localisingAfter(update));
}

TEST_F(Mode, AGlobalUpdateIsMapping) {
  ASSERT_TRUE(localisingAfter(removing(1)));
  MapUpdate update = removing(2);
  update.global = true;
  EXPECT_FALSE(localisingAfter(update));
}

}  // namespace
}  // namespace vip_slam::planes
