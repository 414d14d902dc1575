// SPDX-License-Identifier: BSD-3-Clause
// Ids of merged landmarks.
#include <gtest/gtest.h>

#include <algorithm>

#include "vip_slam_core/types/landmark_aliases.h"

namespace vip_slam {
namespace {

TEST(LandmarkAliases, AreFollowedAndForgottenWithTheirTracks) {
  LandmarkAliases aliases;
  EXPECT_EQ(aliases.resolve(7), 7u);
  aliases.merge(1, 2);
  aliases.merge(2, 3);
  aliases.merge(5, 3);
  EXPECT_EQ(aliases.resolve(1), 3u);
  EXPECT_TRUE(aliases.isAlias(2));
  EXPECT_FALSE(aliases.isAlias(3));
  aliases.forgetUnused({1, 3, 9});  // the track of 2, through which 1 was followed, has ended
  EXPECT_EQ(aliases.size(), 1u);
  EXPECT_EQ(aliases.resolve(1), 3u);
  EXPECT_EQ(aliases.resolve(2), 2u);
  aliases.merge(3, 4);
  EXPECT_EQ(aliases.resolve(1), 4u);
  aliases.clear();
  EXPECT_EQ(aliases.resolve(1), 1u);
}

// A day of merges of tracks of which keyframes keep a hundred.
TEST(LandmarkAliases, StayFew) {
  LandmarkAliases aliases;
  std::size_t most = 0;
  for (LandmarkId id = 1; id < 100000; ++id) {
    aliases.merge(2 * id, 2 * id + 1);
    most = std::max(most, aliases.size());
    if (!aliases.crowded()) continue;
    std::unordered_set<LandmarkId> in_use;
    for (LandmarkId k = id < 100 ? 1 : id - 99; k <= id; ++k) in_use.insert(2 * k);
    aliases.forgetUnused(in_use);
    EXPECT_EQ(aliases.resolve(2 * id), 2 * id + 1);
  }
  EXPECT_LT(most, 1300u);
}

}  // namespace
}  // namespace vip_slam
