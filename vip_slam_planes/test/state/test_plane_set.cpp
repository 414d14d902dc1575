// SPDX-License-Identifier: BSD-3-Clause
#include <limits>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "../../src/state/plane_set.h"
#include "scene.h"

namespace vip_slam::planes {
namespace {

/// Planes that keyframe 1 of epoch 0 and keyframe 2 of epoch 1 show.
class Planes : public ::testing::Test {
 protected:
  Planes() {
    for (std::uint32_t epoch : {0u, 1u}) keyframes.addHost({epoch + 1, epoch, SE3()});
  }
  /// A square of 1 m^2.
  PlaneTrack& start(PlaneKind kind, bool confirmed, std::uint32_t epoch = 0) {
    const Plane plane = kind == PlaneKind::kHorizontal ? Plane({0, 0, 1}, -1) : Plane({-1, 0, 0}, 3);
    PlaneTrack& track = set.start(kind, plane, -plane.d * plane.n, epoch);
    const int side = static_cast<int>(1 / track.cellSize());
    for (int k = 0; k < side * side; ++k) track.coverCell({k / side, k % side}, 5, epoch + 1, SE3());
    track.confirmed = confirmed;
    return track;
  }
  PlaneTrack& table(bool confirmed, std::uint32_t epoch = 0) { return start(PlaneKind::kHorizontal, confirmed, epoch); }
  std::vector<PlaneMerge> merge() { return set.mergeSame(keyframes, *camera); }
  PlaneUpdate tell() {
    PlaneUpdate update;
    set.tell(&update);
    return update;
  }
  void observe(PlaneTrack* track, KeyframeId keyframe) {
    PlaneObservation observation;
    observation.keyframe = keyframe;
    observation.plane = track->id();
    observation.points.resize(1);
    set.observe(track, observation);
  }
  static StoredPlane stored(PlaneId id) {
    StoredPlane plane;
    plane.estimate.id = id;
    plane.estimate.kind = PlaneKind::kHorizontal;
    plane.estimate.plane = Plane({0, 0, 1}, -1);
    plane.estimate.polygons.resize(1);
    plane.estimate.polygons[0].outer = {{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    return plane;
  }

  std::shared_ptr<const CameraModel> camera = testing::testCamera();
  PlacedKeyframes keyframes{testing::quietNoise()};
  PlaneSet set{PlaneMapperOptions()};
};

TEST_F(Planes, NoIdIsUsedTwice) {
  EXPECT_EQ(table(false).id(), 1u);
  set.remove(1);
  EXPECT_EQ(table(false).id(), 2u);
  EXPECT_TRUE(set.restore(stored(7)));
  EXPECT_FALSE(set.restore(stored(7)));
  EXPECT_TRUE(set.restore(stored(5)));
  EXPECT_EQ(table(false).id(), 8u);
  EXPECT_TRUE(tell().removed.empty());
}

TEST_F(Planes, ALoadedPlaneThatIsNotSoundIsToldAsRemoved) {
  StoredPlane bare = stored(3), infinite = stored(4);
  bare.estimate.polygons.clear();
  infinite.estimate.polygons[0].outer[2].x() = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(set.restore(bare));
  EXPECT_FALSE(set.restore(infinite));
  EXPECT_TRUE(set.restore(stored(2)));
  ASSERT_EQ(set.published().size(), 1u);
  const PlaneUpdate update = tell();
  EXPECT_EQ(update.removed, (std::vector<PlaneId>{3, 4}));
  ASSERT_EQ(update.planes.size(), 1u);
  EXPECT_EQ(update.planes[0].id, 2u);
  EXPECT_EQ(set.counts().removed, 0u);
}

TEST_F(Planes, OnlyAPublishedPlaneIsToldAsRemovedAndOnce) {
  table(true), table(false);
  EXPECT_EQ(tell().planes.size(), 1u);
  set.remove(1), set.remove(2), set.remove(2);
  EXPECT_EQ(tell().removed, std::vector<PlaneId>{1});
  EXPECT_TRUE(tell().removed.empty());
  EXPECT_EQ(set.counts().started, 2u);
  EXPECT_EQ(set.counts().removed, 1u);
}

TEST_F(Planes, ClearTellsNothingAndKeepsTheCounts) {
  table(true);
  tell();
  set.remove(1);
  table(true);
  set.compareAll();
  set.clear();
  EXPECT_TRUE(set.empty());
  EXPECT_TRUE(set.published().empty());
  EXPECT_TRUE(tell().removed.empty());
  EXPECT_EQ(set.counts().started, 2u);
  EXPECT_EQ(set.counts().removed, 1u);
  EXPECT_EQ(table(true).id(), 1u);
}

TEST_F(Planes, WhatLostItsAreaOrIsNotConfirmedIsDropped) {
  PlaneTrack &shrinks = table(true), &waits = table(false);
  table(true), table(false);
  for (int k = 0; k < 5; ++k) {
    for (int x = 0; x < 100; ++x) {
      for (int y = 0; y < 100; ++y) {
        if (shrinks.cells().at({x, y}) > 0) shrinks.miss({x, y});
      }
    }
  }
  waits.keyframes_waited = PlaneSupportOptions().patience + 1;
  EXPECT_EQ(set.dropUnsupported(), (std::vector<PlaneId>{1, 2}));
  EXPECT_EQ(tell().removed, std::vector<PlaneId>{1});
  EXPECT_FALSE(set.find(1));
  EXPECT_TRUE(set.find(3));
}

TEST_F(Planes, TheOlderIdIsKeptUnlessOnlyTheNewerIsPublished) {
  table(false), table(true), table(true);
  const std::vector<PlaneMerge> merges = merge();
  ASSERT_EQ(merges.size(), 2u);
  EXPECT_EQ(merges[1].from, 3u);
  EXPECT_EQ(merges[0].from, 1u);
  EXPECT_EQ(merges[0].into, 2u);
  EXPECT_EQ(merges[1].into, 2u);
  const PlaneUpdate update = tell();
  ASSERT_EQ(update.merges.size(), 1u);  // nobody knows the first
  EXPECT_EQ(update.merges[0].from, 3u);
  EXPECT_TRUE(update.removed.empty());
  EXPECT_EQ(set.counts().merged, 2u);
}

TEST_F(Planes, EpochsThatComeTogetherHaveAllTheirPlanesCompared) {
  table(true, 0), table(true, 1);
  EXPECT_TRUE(merge().empty());
  MapUpdate update;
  update.parts = {{0, 0}, {1, 0}};
  ASSERT_TRUE(keyframes.tie(update));
  EXPECT_TRUE(merge().empty());  // neither has changed
  set.compareAll();
  EXPECT_EQ(merge().size(), 1u);
}

TEST_F(Planes, AnInvalidObservationIsWithdrawnIfItWasTold) {
  PlaneTrack& track = table(true);
  track.determined = true;
  observe(&track, 1);
  set.withdraw(&track, 1);
  EXPECT_TRUE(tell().observations.empty());
  observe(&track, 1);
  EXPECT_EQ(tell().observations.size(), 1u);
  track.refit_due = false;
  set.withdraw(&track, 1);
  EXPECT_TRUE(track.refit_due);
  const PlaneUpdate update = tell();
  ASSERT_EQ(update.observations.size(), 1u);
  EXPECT_TRUE(update.observations[0].points.empty());
}

TEST_F(Planes, AWallThatIsPublishedAgainHasAllItsObservationsTold) {
  PlaneTrack& track = start(PlaneKind::kVertical, true);
  track.determined = true;
  observe(&track, 1), observe(&track, 2);
  EXPECT_EQ(tell().observations.size(), 2u);
  track.setOptimised(true);
  track.agrees = false;
  set.unpublish(&track);
  EXPECT_FALSE(track.optimised());
  PlaneUpdate update = tell();
  EXPECT_EQ(update.removed, std::vector<PlaneId>{1});
  EXPECT_TRUE(update.planes.empty());
  EXPECT_EQ(set.counts().removed, 1u);
  track.agrees = true;
  set.republish(track);
  update = tell();
  EXPECT_EQ(update.planes.size(), 1u);
  EXPECT_EQ(update.observations.size(), 2u);
}

TEST_F(Planes, ARemovedKeyframesCellsStayAndItsObservationIsNotTold) {
  PlaneTrack& track = table(true);
  track.determined = true;
  observe(&track, 1);
  set.forgetKeyframe(1, 2, keyframes.poses());
  EXPECT_TRUE(tell().observations.empty());
  EXPECT_FALSE(track.restsOn(1));
  EXPECT_TRUE(track.restsOn(2));
}

}  // namespace
}  // namespace vip_slam::planes
