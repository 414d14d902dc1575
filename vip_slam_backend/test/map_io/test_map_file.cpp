// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <random>

#include "map_io/synthetic_map.h"
#include "vip_slam_backend/map/map_checker.h"
#include "vip_slam_backend/map_io/map_file.h"
#include "vip_slam_backend/util/crc32.h"

namespace vip_slam {
namespace {

using Loops = std::vector<std::pair<KeyframeId, KeyframeId>>;

std::string sealed(std::string bytes) {
  const std::uint32_t crc = crc32(bytes.data(), bytes.size() - 4);
  std::memcpy(&bytes[bytes.size() - 4], &crc, 4);
  return bytes;
}

TEST(Crc32, KnownValue) {
  EXPECT_EQ(crc32("123456789", 9), 0xCBF43926u);
}

TEST(MapFile, SaveLoadSaveGivesTheSameBytes) {
  const Map map = syntheticMap(12, 60, 200);
  ASSERT_EQ(checkMap(map), "");
  const std::string bytes = serialiseMap(map, {{10, 2}}, 77);
  const StoredMap stored = parse(bytes);
  EXPECT_EQ(checkMap(stored.map), "");
  EXPECT_EQ(stored.vocabulary_id, 77u);
  ASSERT_EQ(stored.loops.size(), 1u);
  EXPECT_EQ(serialiseMap(stored.map, stored.loops, stored.vocabulary_id), bytes);
}

TEST(MapFile, SaveLoadSaveGivesTheSameBytesWhateverTheRotations) {
  // Under repeated normalisation about one rotation in a hundred keeps changing in its last bits.
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  Map map = syntheticMap(12, 4, 8);
  for (int round = 0; round < 2000; ++round) {
    for (const auto& entry : map.keyframes()) {
      NavState state = entry.second.state;
      state.T_W_I.setRotation(Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)));
      map.setState(entry.first, state, ImuNoise());
    }
    const std::string bytes = serialiseMap(map, {}, 1);
    ASSERT_TRUE(serialiseMap(parse(bytes).map, {}, 1) == bytes) << "round " << round;
  }
}

TEST(MapFile, EverythingComesBack) {
  const Map map = syntheticMap(12, 60, 200);
  const StoredMap stored = parse(serialiseMap(map, {}, 1));
  ASSERT_EQ(stored.map.keyframes().size(), map.keyframes().size());
  ASSERT_EQ(stored.map.landmarks().size(), map.landmarks().size());
  ASSERT_EQ(stored.map.planes().size(), map.planes().size());
  const std::vector<LandmarkId> before = map.landmarkIds(), after = stored.map.landmarkIds();
  for (std::size_t k = 0; k < before.size(); ++k) {
    const MapLandmark &a = map.landmark(before[k]), &b = stored.map.landmark(after[k]);
    EXPECT_GE(after[k], kLoadedLandmarks);
    EXPECT_EQ(a.p_W, b.p_W);
    EXPECT_EQ(a.plane, b.plane);
    EXPECT_EQ(a.descriptor, b.descriptor);
    EXPECT_EQ(a.observations.size(), b.observations.size());
    EXPECT_EQ(a.visible, b.visible);
  }
  for (const auto& entry : map.keyframes()) {
    const MapKeyframe &a = entry.second, &b = stored.map.keyframe(entry.first);
    EXPECT_EQ(a.state.T_W_I.t(), b.state.T_W_I.t());
    EXPECT_LT(a.state.T_W_I.boxminus(b.state.T_W_I).norm(), 1e-14);
    EXPECT_EQ(a.state.v_W, b.state.v_W);
    EXPECT_EQ(a.data->frame.state.T_W_I.t(), b.data->frame.state.T_W_I.t());
    EXPECT_EQ(a.previous, b.previous);
    EXPECT_EQ(a.next, b.next);
    EXPECT_EQ(a.loop_keyframe, b.loop_keyframe);
    EXPECT_GE(b.data->frame.epoch, kLoadedEpochs);
    ASSERT_EQ(a.features().size(), b.features().size());
    EXPECT_EQ(a.features()[7].descriptor, b.features()[7].descriptor);
    EXPECT_EQ(a.features()[7].xy, b.features()[7].xy);
    EXPECT_EQ(a.features()[7].pixel_sigma, b.features()[7].pixel_sigma);
    EXPECT_EQ(a.motion.covariance, b.motion.covariance);
    EXPECT_LT(a.motion.T_a_b.boxminus(b.motion.T_a_b).norm(), 1e-14);
    EXPECT_EQ(bool(a.preintegration), bool(b.preintegration));
    if (a.preintegration) {
      EXPECT_EQ(a.preintegration->alpha(), b.preintegration->alpha());
    }
    ASSERT_EQ(a.planes.size(), b.planes.size());
    EXPECT_EQ(a.planes.begin()->second.G, b.planes.begin()->second.G);
    for (std::size_t n = 0; n < a.data->frame.depth_grid.z.size(); ++n)
      EXPECT_NEAR(a.data->frame.depth_grid.z[n], b.data->frame.depth_grid.z[n], 6e-4);
  }
  EXPECT_TRUE(stored.map.planes().at(9).optimised);
  EXPECT_FALSE(stored.map.planes().at(3).optimised);
  EXPECT_EQ(stored.map.planes().at(3).estimate.polygons[0].holes.size(), 1u);
  // Two epochs that were not tied stay untied.
  EXPECT_NE(stored.map.keyframe(1).data->frame.epoch, stored.map.keyframe(12).data->frame.epoch);
}

// Views of each landmark, grouped by track, as the grouping affects the adjustment.
std::vector<std::vector<int>> tracksOf(const Map& map) {
  std::vector<std::vector<int>> all;
  for (const LandmarkId id : map.landmarkIds()) {
    std::vector<LandmarkId> known;
    all.emplace_back();
    for (const MapObservation& o : map.landmark(id).observations) {
      const LandmarkId track = map.feature(o).id;
      const auto at = std::find(known.begin(), known.end(), track);
      all.back().push_back(track == kNoLandmark ? -1 : static_cast<int>(at - known.begin()));
      if (track != kNoLandmark && at == known.end()) known.push_back(track);
    }
  }
  return all;
}

TEST(MapFile, TheTracksOfALandmarkStayApart) {
  const Map map = syntheticMap(12, 60, 200);
  const auto before = tracksOf(map);
  ASSERT_TRUE(std::any_of(before.begin(), before.end(), [](const auto& l) { return l.back() > 0; }));
  const StoredMap stored = parse(serialiseMap(map, {}, 1));
  EXPECT_EQ(tracksOf(stored.map), before);
  // A front end that finds a landmark again tracks it under the landmark's id, from another corner: stored features
  // must not have such an id.
  for (const auto& entry : stored.map.keyframes())
    for (const Feature& f : entry.second.features()) EXPECT_FALSE(stored.map.hasLandmark(f.id));
}

TEST(MapFile, EveryFlippedByteAndEveryTruncationIsRefused) {
  const std::string bytes = serialiseMap(syntheticMap(3, 12, 100, 1, 3), {{3, 1}}, 5);
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    std::string bad = bytes;
    bad[k] = static_cast<char>(bad[k] ^ (1 << (k % 8)));
    EXPECT_THROW(parse(bad), std::runtime_error) << "byte " << k;
  }
  for (std::size_t size = 0; size < bytes.size(); size += 7)
    EXPECT_THROW(parse(bytes.substr(0, size)), std::runtime_error);
  EXPECT_THROW(parse(bytes + '\0'), std::runtime_error);
}

TEST(MapFile, DamageBehindARightChecksumDoesNoHarm) {
  // Like a fuzzer: any byte changed and the checksum corrected. The result is a consistent map or an error.
  const std::string bytes = serialiseMap(syntheticMap(3, 12, 100, 1, 3), {{3, 1}}, 5);
  std::size_t refused = 0, taken = 0;
  for (std::size_t k = 24; k + 4 < bytes.size(); k += 1 + k % 3)
    for (const unsigned char value : {0x00, 0xFF}) {
      std::string bad = bytes;
      bad[k] = static_cast<char>(bad[k] ^ value);
      if (value == 0) bad[k] = 0;
      try {
        const StoredMap stored = parse(sealed(bad));
        EXPECT_EQ(checkMap(stored.map), "");
        ++taken;
      } catch (const std::runtime_error& e) {
        EXPECT_EQ(std::string(e.what()).rfind("test.vsm: ", 0), 0u) << e.what();
        ++refused;
      }
    }
  EXPECT_GT(refused, 500u);
  EXPECT_GT(taken, 500u);
}

// A new session has no knowledge of that gyro.
TEST(MapFile, KeepsTheRatesOfAGyroAsTheyWereCorrected) {
  Map map = syntheticMap(3, 12, 100);
  const Eigen::Vector3d measured = map.keyframe(3).imu->at(5).gyro;
  Eigen::Matrix3d correction = Eigen::Matrix3d::Zero();
  correction.diagonal() << 0.01, -0.02, 0.03;
  map.adoptGyroCorrection(correction, ImuNoise());
  const StoredMap stored = parse(serialiseMap(map, {}, 5));
  const MapKeyframe& kf = stored.map.keyframe(3);
  EXPECT_LT((kf.imu->at(5).gyro - (measured + correction * measured)).norm(), 1e-12);
  EXPECT_EQ(kf.gyro_correction, Eigen::Matrix3d::Zero());
  EXPECT_LT((kf.preintegration->deltaR() - map.keyframe(3).preintegration->deltaR()).norm(), 1e-12);
}

TEST(MapFile, IdsThatWouldTakeAllMemoryAreRefused) {
  Map map = syntheticMap(3, 12, 100);
  auto far = std::make_shared<Keyframe>(*map.keyframe(3).data);
  far->id = KeyframeId{1} << 40;
  far->previous = 0;
  far->imu.clear();
  far->frame.t += 1.0;
  EXPECT_THROW(map.addKeyframe(far, far->frame.state, ImuNoise()), MapError);
  map.restoreKeyframe(far, far->frame.state, 0, {}, ImuNoise());
  try {
    parse(serialiseMap(map, {}, 5));
    FAIL() << "taken";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("too far from the first"), std::string::npos) << e.what();
  }
}

TEST(MapFile, ForeignAndNewerFilesAreNamed) {
  const auto message = [](const std::string& bytes) -> std::string {
    try {
      parse(bytes);
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(message("\x89PNG and what follows, surely not one of ours").find("not a map file"), std::string::npos);
  EXPECT_NE(message("").find("too short"), std::string::npos);
  std::string newer = serialiseMap(syntheticMap(3, 12, 100), {}, 5);
  newer[8] = 8;
  EXPECT_NE(message(sealed(newer)).find("version 8, expected 1 to 7"), std::string::npos);
  try {
    loadMapFile("/nonexistent/map.vsm", ImuNoise());
    FAIL();
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("/nonexistent/map.vsm"), std::string::npos);
  }
  EXPECT_THROW(saveMapFile("/nonexistent/map.vsm", Map(), {}, 1), std::runtime_error);
}

TEST(MapFile, AnEmptyMapIsAMap) {
  const std::string bytes = serialiseMap(Map(), {}, 3);
  EXPECT_TRUE(parse(bytes).map.empty());
}

TEST(MapFile, TenMinutesSaveAndLoadInTime) {
  // Two keyframes a second with 500 features, IMU at 200 Hz.
  const Map map = syntheticMap(1200, 500, 200, 1, 60);
  const std::string path = "/tmp/vip_slam_test_" + std::to_string(::getpid()) + ".vsm";
  // CPU time, so that other load on the machine does not fail the test.
  const auto now = [] { return std::clock(); };
  const auto seconds = [](std::clock_t a, std::clock_t b) { return static_cast<double>(b - a) / CLOCKS_PER_SEC; };
  const auto t0 = now();
  saveMapFile(path, map, {}, 1);
  const auto t1 = now();
  const StoredMap stored = loadMapFile(path, ImuNoise());
  const auto t2 = now();
  std::ifstream file(path, std::ios::ate | std::ios::binary);
  std::printf("10-minute map: %.1f MB, save %.2f s, load %.2f s\n", file.tellg() / 1e6, seconds(t0, t1),
              seconds(t1, t2));
  std::remove(path.c_str());
  EXPECT_EQ(stored.map.keyframes().size(), 1200u);
  EXPECT_LE(seconds(t0, t1), 2.0);
  EXPECT_LE(seconds(t1, t2), 2.0);
}

}  // namespace
}  // namespace vip_slam
