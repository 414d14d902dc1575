// SPDX-License-Identifier: BSD-3-Clause
// The back end when its map is reset or loaded, and parts of the map.
#include <gtest/gtest.h>

#include <optional>

#include "back_end/back_end_runs.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_backend/map_io/map_file.h"
#include "vip_slam_core/types/session_numbers.h"

using namespace vip_slam;

TEST(BackEndMaps, GlobalAdjustmentOfAMapThatIsNoMoreIsDropped) {
  SimulatedKeyframes world(3), other(9);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 6; ++k) back_end.addKeyframe(world.next());
  const GbaResult late = back_end.run(back_end.startGlobalBa());
  back_end.reset();
  for (int k = 0; k < 6; ++k) back_end.addKeyframe(other.next());
  const SE3 before = back_end.map().keyframe(3).state.T_W_I;
  const MapUpdate update = back_end.merge(late);
  EXPECT_FALSE(update.global);
  EXPECT_TRUE(back_end.globalBaWanted());
  EXPECT_EQ(back_end.map().keyframe(3).state.T_W_I.boxminus(before).norm(), 0.0);
}

TEST(BackEndMaps, PlanesOfAMapThatIsNoMoreAreIgnored) {
  SimulatedKeyframes world(3), other(9);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  back_end.applyPlaneUpdate(PlaneUpdate());  // before any map update
  PlaneUpdate late;
  for (int k = 0; k < 6; ++k) {
    late.revision = back_end.addKeyframe(world.next()).revision;
    late.planes = world.planes().planes;
    back_end.applyPlaneUpdate(late);
    EXPECT_EQ(back_end.map().planes().size(), world.walls().size());
  }
  back_end.reset();
  back_end.applyPlaneUpdate(late);
  EXPECT_TRUE(back_end.map().planes().empty());
  PlaneUpdate answer = late;
  answer.revision = back_end.addKeyframe(other.next()).revision;
  back_end.applyPlaneUpdate(late);
  EXPECT_TRUE(back_end.map().planes().empty());
  back_end.applyPlaneUpdate(answer);
  EXPECT_EQ(back_end.map().planes().size(), world.walls().size());

  const std::string path = ::testing::TempDir() + "no_planes.vsm";
  CheckedBackEnd other_end(options("vip"), world.sensor());
  other_end.addKeyframe(SimulatedKeyframes(3).next());
  other_end.saveMap(path);
  const MapUpdate loaded = back_end.loadMap(path);
  back_end.applyPlaneUpdate(answer);
  EXPECT_TRUE(back_end.map().planes().empty());
  answer.revision = loaded.revision;
  back_end.applyPlaneUpdate(answer);
  EXPECT_EQ(back_end.map().planes().size(), world.walls().size());
}

// The front end's tracks keep their ids.
TEST(BackEndMaps, NoLandmarkOfAMapHasTheIdOfOneLoadedBefore) {
  SimulatedKeyframes world(3);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 6; ++k) back_end.addKeyframe(world.next());
  const std::string path = ::testing::TempDir() + "loaded_again.vsm";
  back_end.saveMap(path);
  std::set<LandmarkId> before;
  for (int load = 0; load < 3; ++load) {
    back_end.loadMap(path);
    ASSERT_GT(back_end.map().landmarks().size(), 20u);
    for (const auto& entry : back_end.map().landmarks()) EXPECT_TRUE(before.insert(entry.first).second) << entry.first;
  }
}

TEST(BackEndMaps, KeyframesThatWaitedForALoadedMapEnterItAsAWhole) {
  const std::string path = ::testing::TempDir() + "waited_for.vsm";
  SimulatedKeyframes world(4), session(4);
  CheckedBackEnd mapper(options("vip"), world.sensor()), back_end(options("vip"), world.sensor());
  feed(&world, &mapper, 25);
  mapper.saveMap(path);
  back_end.loadMap(path);
  const std::size_t loaded = back_end.map().keyframes().size();
  MapUpdate update;
  int waited = 0;
  for (int k = 0; k < 25 && back_end.map().keyframes().size() == loaded; ++k, ++waited) {
    auto kf = std::make_shared<Keyframe>(*session.next());
    kf->id += 1000;
    kf->previous = k == 0 ? 0 : kf->id - 1;
    if (k < 15)
      for (Feature& f : kf->frame.features) f.descriptor.fill(0x55);  // nothing looks as it did
    EXPECT_FALSE(back_end.globalBaWanted());
    update = back_end.addKeyframe(kf);
    EXPECT_EQ(back_end.lastRefusal(), "");
  }
  ASSERT_GT(waited, 15);
  EXPECT_GT(back_end.map().keyframes().size(), loaded + 15);
  EXPECT_TRUE(update.global);
  EXPECT_EQ(update.keyframes.size(), back_end.map().keyframes().size());
  EXPECT_TRUE(back_end.globalBaWanted());
}

// A session in another room than the loaded map's is not lost: it is saved as a part of its own, and a loop ties it to
// the stored part when the place is seen later.
TEST(BackEndMaps, ASessionThatDoesNotFindTheLoadedMapBecomesAPartOfIt) {
  const std::string path = ::testing::TempDir() + "other_room.vsm", both = ::testing::TempDir() + "both_rooms.vsm";
  SimulatedKeyframes world(4), other(9), again(4);
  CheckedBackEnd mapper(options("vip"), world.sensor());
  feed(&world, &mapper, 25);
  mapper.saveMap(path);
  for (const bool at_end : {true, false}) {
    SimulatedKeyframes session(9);
    CheckedBackEnd back_end(options("vip"), world.sensor());
    back_end.loadMap(path);
    const std::size_t loaded = back_end.map().keyframes().size();
    for (int k = 0; k < 20; ++k) {
      auto kf = std::make_shared<Keyframe>(*session.next());
      kf->id += 1000;
      kf->previous = k == 0 ? 0 : kf->id - 1;
      EXPECT_FALSE(back_end.addKeyframe(kf).placed);
    }
    EXPECT_EQ(back_end.map().keyframes().size(), loaded);
    const std::optional<MapUpdate> waited = back_end.mapWaiting();
    ASSERT_TRUE(waited);
    EXPECT_FALSE(back_end.mapWaiting()) << "once";
    const MapUpdate update = at_end ? back_end.finish() : *waited;
    EXPECT_EQ(back_end.map().keyframes().size(), loaded + 20);
    EXPECT_TRUE(update.global);
    EXPECT_FALSE(update.placed) << "nothing ties it to the stored map";
    EXPECT_EQ(update.keyframes.size(), loaded + 20);
    const auto guessed = guessedTimes(back_end.snapshot());
    ASSERT_EQ(guessed.size(), 1u);
    EXPECT_EQ(guessed.front().first, back_end.map().keyframe(1001).data->frame.t);
    // It fits itself, whatever its place.
    const SE3 moved = back_end.map().keyframe(1001).state.T_W_I *
                      session.truth(back_end.map().keyframe(1001).data->frame.t).T_W_I.inverse();
    for (KeyframeId id = 1001; id <= 1020; ++id) {
      const MapKeyframe& kf = back_end.map().keyframe(id);
      EXPECT_LT((kf.state.T_W_I.t() - moved * session.truth(kf.data->frame.t).T_W_I.t()).norm(), 0.1) << id;
    }
    back_end.saveMap(both);
    CheckedBackEnd loaded_both(options("vip"), world.sensor());
    loaded_both.loadMap(both);
    EXPECT_EQ(loaded_both.map().keyframes().size(), loaded + 20);
  }

  // Mapping goes on in the part; the stored place is recognised in the end.
  BackEndOptions closing = options("vip");
  closing.loop_closing = true;
  CheckedBackEnd back_end(closing, world.sensor());
  back_end.loadMap(path);
  const std::size_t loaded = back_end.map().keyframes().size();
  const auto add = [&back_end](SimulatedKeyframes* place, int count, std::uint32_t epoch) {
    MapUpdate update;
    for (int k = 0; k < count; ++k) {
      auto kf = std::make_shared<Keyframe>(*place->next());
      kf->id += 1000 * (epoch + 1);
      kf->previous = k == 0 ? 0 : kf->id - 1;
      kf->frame.epoch = epoch;
      for (Feature& f : kf->frame.features) f.id += 1000000 * LandmarkId(epoch);
      update = back_end.addKeyframe(kf);
      EXPECT_EQ(back_end.lastRefusal(), "");
    }
    return update;
  };
  EXPECT_FALSE(add(&other, 12, 0).placed);
  ASSERT_TRUE(back_end.mapWaiting());
  EXPECT_TRUE(add(&again, 25, 1).placed) << "recognised by a loop";
  EXPECT_EQ(back_end.map().keyframes().size(), loaded + 37);
  // With localisation alone nothing is mapped.
  CheckedBackEnd localiser(options("vip"), world.sensor());
  localiser.loadMap(path);
  localiser.setLocalisationMode(true);
  SimulatedKeyframes session(9);
  for (int k = 0; k < 5; ++k) {
    auto kf = std::make_shared<Keyframe>(*session.next());
    kf->id += 1000;
    kf->previous = k == 0 ? 0 : kf->id - 1;
    localiser.addKeyframe(kf);
  }
  EXPECT_FALSE(localiser.mapWaiting());
  localiser.finish();
  EXPECT_EQ(localiser.map().keyframes().size(), loaded);
}

// The camera, localised in the map, reaches a fragment, which is moved to the map; an adjustment started before that
// would move it back.
TEST(BackEndMaps, AnAdjustmentFromBeforeAFragmentCameToTheMapIsDropped) {
  SimulatedKeyframes world(4), again(4), other(9), other_again(9);
  BackEndOptions closing = options("vip");
  closing.loop_closing = true;
  CheckedBackEnd back_end(closing, world.sensor());
  const auto add = [&back_end](const KeyframePtr& given, std::uint32_t epoch, bool first) {
    auto kf = std::make_shared<Keyframe>(*given);
    kf->id += 1000 * epoch;
    kf->previous = first ? 0 : kf->id - 1;
    kf->frame.epoch = epoch;
    for (Feature& f : kf->frame.features) f.id += 1000000 * LandmarkId(epoch);
    return back_end.addKeyframe(kf);
  };
  for (int k = 0; k < 25; ++k) add(world.next(), 0, k == 0);
  for (int k = 0; k < 25; ++k) add(other.next(), 1, k == 0);
  const SE3 guess = back_end.map().keyframe(1010).state.T_W_I;
  // Back in the map; then into the fragment's room.
  bool placed = false;
  for (int k = 0; k < 14; ++k, other_again.next()) placed = add(again.next(), 2, k == 0).placed;
  ASSERT_TRUE(placed);
  const GbaResult late = back_end.run(back_end.startGlobalBa());
  for (int k = 14; k < 25; ++k) add(other_again.next(), 2, false);
  const SE3 found = back_end.map().keyframe(1010).state.T_W_I;
  ASSERT_GT((found.t() - guess.t()).norm(), 0.1);
  EXPECT_LT((found.t() - world.truth(9 * world.interval()).T_W_I.t()).norm(), 0.1);
  EXPECT_FALSE(back_end.merge(late).global);
  EXPECT_EQ(back_end.map().keyframe(1010).state.T_W_I.boxminus(found).norm(), 0.0);
  EXPECT_TRUE(back_end.globalBaWanted());
}

/// All planes but the first, as the plane module would list them.
PlaneUpdate withoutTheFirst(const MapSnapshot& before) {
  PlaneUpdate update;
  update.revision = before.revision;
  update.planes.assign(before.planes.begin() + 1, before.planes.end());
  return update;
}

// Results the plane module had pending when localisation was switched on are sent only once.
TEST(BackEndMaps, PlaneUpdatesThatCameLateAreNotLost) {
  SimulatedKeyframes world(4);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  feed(&world, &back_end, 10);
  const MapSnapshot before = back_end.snapshot();
  ASSERT_GT(before.planes.size(), 1u);
  back_end.setLocalisationMode(true);
  PlaneUpdate late = withoutTheFirst(before);
  late.removed = {before.planes.front().id};
  back_end.applyPlaneUpdate(late);
  EXPECT_EQ(back_end.snapshot().planes.size(), before.planes.size());
  back_end.setLocalisationMode(false);
  EXPECT_EQ(back_end.snapshot().planes.size(), before.planes.size() - 1);
  EXPECT_FALSE(back_end.map().hasPlane(before.planes.front().id));
}

TEST(BackEndMaps, PlanesThatALostUpdateRemovedGoWithTheNext) {
  SimulatedKeyframes world(4);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  feed(&world, &back_end, 10);
  const MapSnapshot before = back_end.snapshot();
  ASSERT_GT(before.planes.size(), 1u);
  back_end.applyPlaneUpdate(withoutTheFirst(before));
  EXPECT_EQ(back_end.snapshot().planes.size(), before.planes.size() - 1);
  EXPECT_FALSE(back_end.map().hasPlane(before.planes.front().id));
}

// A map of two rooms between which there is no loop; planes of both, the second one's with ids from 1000 on.
TEST(BackEndMaps, StoredPlanesAreHostedByTheOldestKeyframeThatSawThem) {
  const std::string path = ::testing::TempDir() + "two_parts.vsm";
  const SensorConfig sensor = SimulatedKeyframes(4).sensor();
  CheckedBackEnd mapper(options("vip"), sensor), back_end(options("vip"), sensor);
  MapUpdate update;
  std::vector<PlaneEstimate> of_first_room;
  for (const std::uint32_t epoch : {0u, 1u}) {
    SimulatedKeyframes world(epoch == 0 ? 4 : 9);
    for (int k = 0; k < 8; ++k) {
      auto kf = std::make_shared<Keyframe>(*world.next());
      kf->id += 1000 * epoch;
      kf->previous = k == 0 ? 0 : kf->id - 1;
      kf->frame.epoch = epoch;
      for (Feature& f : kf->frame.features) f.id += 1000000 * LandmarkId(epoch);
      update = mapper.addKeyframe(kf);
      EXPECT_EQ(partOf(update, epoch), epoch);
      PlaneUpdate planes = world.planes();
      planes.revision = update.revision;
      planes.associated.clear();
      planes.dissociated.clear();
      for (PlaneEstimate& plane : planes.planes) plane.id += 1000 * epoch;
      for (PlaneObservation& o : planes.observations) o.plane += 1000 * epoch, o.keyframe += 1000 * epoch;
      if (epoch == 0) of_first_room = planes.planes;
      if (epoch == 1) planes.planes.insert(planes.planes.end(), of_first_room.begin(), of_first_room.end());
      mapper.applyPlaneUpdate(planes);
    }
  }
  EXPECT_EQ(update.parts.size(), 2u);
  mapper.saveMap(path);

  const MapUpdate loaded = back_end.loadMap(path);
  EXPECT_EQ(loaded.parts.size(), 2u);
  const std::vector<StoredPlane> planes = back_end.storedPlanes();
  ASSERT_EQ(planes.size(), back_end.map().planes().size());
  int of_first = 0, of_second = 0;
  for (const StoredPlane& plane : planes) {
    const bool hosted = plane.host.keyframe != 0, second = plane.estimate.id > 1000;
    for (const auto& [id, kf] : back_end.map().keyframes())
      if (!hosted || id < plane.host.keyframe) EXPECT_EQ(kf.planes.count(plane.estimate.id), 0u) << id;
    if (!hosted) {  // no keyframe observes it: it belongs to the reference part
      EXPECT_EQ(plane.host.epoch, kLoadedEpochs);
      continue;
    }
    (second ? of_second : of_first) += 1;
    ASSERT_TRUE(back_end.map().hasKeyframe(plane.host.keyframe)) << plane.estimate.id;
    const MapKeyframe& host = back_end.map().keyframe(plane.host.keyframe);
    EXPECT_EQ(host.planes.count(plane.estimate.id), 1u);
    EXPECT_EQ(plane.host.keyframe > 1000, second);
    EXPECT_EQ(plane.host.epoch, kLoadedEpochs + second);
    EXPECT_EQ(plane.host.T_map_C.boxminus(host.state.T_W_I * host.T_I_C).norm(), 0.0);
  }
  EXPECT_GT(of_first, 0);
  EXPECT_GT(of_second, 0);
}

TEST(BackEndMaps, AFrontEndThatIsStartedAgainAloneIsAPartOfItsOwn) {
  SimulatedKeyframes world(4), again(9);
  CheckedBackEnd back_end(options("vip"), world.sensor());
  for (int k = 0; k < 8; ++k) EXPECT_TRUE(back_end.addKeyframe(world.next()).placed);
  const SessionNumbers first = firstNumbers(1);
  for (int k = 0; k < 4; ++k) {
    auto kf = std::make_shared<Keyframe>(*again.next());
    kf->id += first.keyframe - 1;
    kf->previous = k == 0 ? 0 : kf->id - 1;
    kf->frame.epoch += first.epoch;
    for (Feature& f : kf->frame.features)
      if (f.id != kNoLandmark) f.id += first.landmark - 1;
    const MapUpdate update = back_end.addKeyframe(kf);
    EXPECT_EQ(back_end.lastRefusal(), "");
    EXPECT_EQ(update.epoch, first.epoch);
    EXPECT_FALSE(update.placed);  // no pose is published
  }
  EXPECT_EQ(back_end.map().keyframes().size(), 12u);
}
