// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "loop/ring_world.h"
#include "vip_slam_backend/loop/guided_matching.h"
#include "vip_slam_backend/loop/loop_closer.h"
#include "vip_slam_backend/loop/place_search.h"
#include "vip_slam_backend/loop/place_support.h"

namespace vip_slam {
namespace {

// A mapped ring and keyframes of another odometry on it.
class PlaceSearchTest : public ::testing::Test {
 protected:
  void map(int bays) {
    world_ = std::make_unique<RingWorld>(bays);
    map_.clear();
    std::vector<SE3> truth;
    world_->walk(map_, 0.9, 0.0, &truth);
    places_ = std::make_unique<LoopCloser>(LoopOptions(), world_->camera());
    places_->rebuild(map_, {});
  }
  SE3 poseAt(int k) const {
    return world_->truth(1.0 + 0.04 * k) *
           SE3(Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ())), Eigen::Vector3d(-0.3, 0.2, 0.1));
  }
  KeyframePtr query(int k) const {
    return world_->see(1000 + k, 900 + 0.4 * k, poseAt(k), T_odom_map_ * poseAt(k), 500000);
  }
  /// The keyframe with only every n-th feature.
  static KeyframePtr thinned(const KeyframePtr& keyframe, std::size_t n) {
    auto thin = std::make_shared<Keyframe>(*keyframe);
    thin->frame.features.clear();
    for (std::size_t f = 0; f < keyframe->frame.features.size(); f += n)
      thin->frame.features.push_back(keyframe->frame.features[f]);
    return thin;
  }
  PlaceVerification add(PlaceSearch& search, const KeyframePtr& keyframe) const {
    return search.add(map_, places_->database(), places_->verifier(), keyframe, places_->describe(*keyframe), {});
  }

  std::unique_ptr<RingWorld> world_;
  Map map_;
  std::unique_ptr<LoopCloser> places_;
  SE3 T_odom_map_{Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ())), Eigen::Vector3d(7, 8, 0)};
};

TEST_F(PlaceSearchTest, SupportMovesAWrongStartToTheTruth) {
  map(1);
  const std::vector<KeyframePtr> keyframes{query(0), query(1), query(2)};
  const SE3 off(Eigen::Quaterniond(Eigen::AngleAxisd(0.004, Eigen::Vector3d::UnitZ())),
                Eigen::Vector3d(0.02, -0.02, 0.01));
  const SE3 T_W_odom = T_odom_map_.inverse();
  const PlaceSupport support = placeSupport(map_, keyframes, off * T_W_odom, places_->verifier(), {});
  ASSERT_TRUE(support.found);
  const SE3 truth = poseAt(2) * world_->T_I_C();
  EXPECT_LT((support.T_W_C.t() - truth.t()).norm(), 0.01);
  EXPECT_LT(support.T_W_C.rotation().angularDistance(truth.rotation()), 0.003);
  EXPECT_GT(support.established, 100);
  EXPECT_GT(support.refound, 0.7 * support.established);
  EXPECT_GT(support.explainedCells(), 0.8);
  // Three keyframes see many of the points more than once: these count once.
  EXPECT_LT(support.points, support.matches);
  // One keyframe alone has less support.
  const PlaceSupport alone = placeSupport(map_, {keyframes.back()}, off * T_W_odom, places_->verifier(), {});
  EXPECT_LT(alone.points, support.points);
}

TEST_F(PlaceSearchTest, SupportOfAWrongPlaceIsWeak) {
  map(1);
  const SE3 turned(Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ())), Eigen::Vector3d::Zero());
  const PlaceSupport right = placeSupport(map_, {query(0)}, T_odom_map_.inverse(), places_->verifier(), {});
  const PlaceSupport wrong = placeSupport(map_, {query(0)}, turned * T_odom_map_.inverse(), places_->verifier(), {});
  ASSERT_TRUE(right.found);
  EXPECT_LT(wrong.evidence(), 0.05 * right.evidence());
}

TEST_F(PlaceSearchTest, KeyframesTooPoorAloneConvinceTogether) {
  map(1);
  int together = 0, alone = 0;
  PlaceSearch search{RelocalisationOptions()};
  for (int k = 0; k < 5; ++k) {
    const KeyframePtr keyframe = thinned(query(k), 6);
    PlaceSearch fresh{RelocalisationOptions()};
    alone += add(fresh, keyframe).accepted;
    const PlaceVerification place = add(search, keyframe);
    if (!place.accepted) continue;
    ++together;
    EXPECT_LT((place.T_W_I.t() - poseAt(k).t()).norm(), 0.03);
  }
  EXPECT_EQ(alone, 0);
  EXPECT_GE(together, 2);
}

TEST_F(PlaceSearchTest, TheNextKeyframeLiftsOneDoubtNotTwo) {
  map(1);
  RelocalisationOptions never_sure, always_alike, both;
  never_sure.sure_evidence = both.sure_evidence = 1e9;
  always_alike.resemblance = both.resemblance = -1;
  for (const RelocalisationOptions& one : {never_sure, always_alike}) {
    PlaceSearch search{one};
    const PlaceVerification first = add(search, query(0));
    EXPECT_FALSE(first.accepted);
    EXPECT_NE(first.reason.find("waits for another keyframe"), std::string::npos) << first.reason;
    EXPECT_TRUE(add(search, query(1)).accepted);
  }
  PlaceSearch search{both};
  for (int k = 0; k < 4; ++k) {
    const PlaceVerification place = add(search, query(k));
    EXPECT_FALSE(place.accepted);
    EXPECT_NE(place.reason.find("another place"), std::string::npos) << place.reason;
  }
}

TEST_F(PlaceSearchTest, PlacesThatRepeatThemselvesAreRefused) {
  map(6);
  PlaceSearch search{RelocalisationOptions()};
  for (int k = 0; k < 5; ++k) {
    const PlaceVerification place = add(search, query(k));
    EXPECT_FALSE(place.accepted);
    EXPECT_NE(place.reason.find("another place"), std::string::npos) << place.reason;
  }
}

// Parts that are not tied may overlap, as their relative pose is a guess. Here every other keyframe of a place belongs
// to another part.
TEST_F(PlaceSearchTest, WhatSeveralPartsShowSpeaksForNoPlaceTogether) {
  map(1);
  PlaceSearch one{RelocalisationOptions()}, several{RelocalisationOptions()};
  PlaceVerification whole, parted;
  for (int k = 0; k < 4; ++k) {
    const KeyframePtr keyframe = query(k);
    const BowResult bow = places_->describe(*keyframe);
    whole = one.add(map_, places_->database(), places_->verifier(), keyframe, bow, {});
    parted = several.add(map_, places_->database(), places_->verifier(), keyframe, bow, {},
                         [](KeyframeId id) { return static_cast<std::uint32_t>(id % 2); });
    EXPECT_FALSE(parted.accepted) << k;
  }
  EXPECT_TRUE(whole.accepted) << whole.reason;
  EXPECT_NE(parted.reason.find("for another place"), std::string::npos) << parted.reason;
}

TEST_F(PlaceSearchTest, APlaceTheMapDoesNotShowToTheNewestKeyframeIsNotForgotten) {
  map(1);
  // The newest keyframe looks at the middle of the ring, of which the map has no view; the one before supports the
  // place.
  auto turned = std::make_shared<Keyframe>(*query(1));
  turned->frame.features.clear();
  turned->frame.state.T_W_I =
      turned->frame.state.T_W_I *
      SE3(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ())), Eigen::Vector3d::Zero());
  const PlaceSupport support = placeSupport(map_, {query(0), turned}, T_odom_map_.inverse(), places_->verifier(), {});
  EXPECT_TRUE(support.found);
  EXPECT_GT(support.points, 50);
  EXPECT_EQ(support.match, 0u);
  PlaceSearch search{RelocalisationOptions()};
  ASSERT_TRUE(add(search, query(0)).accepted);
  const PlaceVerification place = add(search, turned);
  EXPECT_FALSE(place.accepted);
  EXPECT_NE(place.reason.find("no view along the newest"), std::string::npos) << place.reason;
}

TEST_F(PlaceSearchTest, AnotherOdometryBeginsAnew) {
  map(1);
  PlaceSearch search{RelocalisationOptions()};
  for (int k = 0; k < 3; ++k) add(search, query(k));
  // The same view in another odometry with another pose: the earlier keyframes' evidence does not apply to it.
  auto other = std::make_shared<Keyframe>(*world_->see(
      1003, 901.2, poseAt(3), SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(50, 0, 0)) * poseAt(3), 500000));
  other->frame.epoch = 1;
  const PlaceVerification place = add(search, other);
  ASSERT_TRUE(place.accepted) << place.reason;
  EXPECT_LT((place.T_W_I.t() - poseAt(3).t()).norm(), 0.03);
}

TEST_F(PlaceSearchTest, NothingToSeeFindsNothing) {
  map(1);
  PlaceSearch search{RelocalisationOptions()};
  auto blank = std::make_shared<Keyframe>(*query(0));
  blank->frame.features.clear();
  EXPECT_FALSE(add(search, blank).accepted);
}

}  // namespace
}  // namespace vip_slam
