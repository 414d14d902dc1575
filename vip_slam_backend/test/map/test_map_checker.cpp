// SPDX-License-Identifier: BSD-3-Clause
// The checker names every kind of damage.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "map/map_fixture.h"

using namespace vip_slam;

namespace {

struct Damage {
  const char* reason;
  std::function<void(Map*)> spoil;
};

/// Entries that no operation gives write access to.
std::map<KeyframeId, MapKeyframe>& keyframesOf(Map* map) {
  return const_cast<std::map<KeyframeId, MapKeyframe>&>(map->keyframes());
}
std::unordered_map<LandmarkId, MapLandmark>& landmarksOf(Map* map) {
  return const_cast<std::unordered_map<LandmarkId, MapLandmark>&>(map->landmarks());
}
MapPlane& firstPlane(Map* map) { return const_cast<MapPlane&>(map->planes().begin()->second); }

/// Keyframes, planes and landmarks of all kinds; keyframe 4 is the newest and the one that sees planes.
struct Whole : Fixture {
  Whole() {
    add(4);
    addPlanes();
    const LandmarkId a = findLandmark(map, [](const MapLandmark& l) { return l.observations.back().keyframe == 1; });
    const LandmarkId b = findLandmark(map, [](const MapLandmark& l) { return l.host() > 1; });
    EXPECT_TRUE(map.mergeLandmarks(b, a));
    merged = b;
    often = findLandmark(map, [](const MapLandmark& l) { return l.observations.size() >= 3; });
    EXPECT_EQ(checkMap(map), "");
  }
  LandmarkId merged = kNoLandmark;  ///< known under another name now
  LandmarkId often = kNoLandmark;   ///< seen by three keyframes at least

  void expectSeen(const std::vector<Damage>& damages) const {
    for (const Damage& damage : damages) {
      Map damaged = map;
      damage.spoil(&damaged);
      EXPECT_NE(checkMap(damaged).find(damage.reason), std::string::npos)
          << "expected: " << damage.reason << "\nfound: " << checkMap(damaged);
    }
  }
};

/// Changes the data that a keyframe was published with.
std::function<void(Map*)> inData(KeyframeId id, const std::function<void(Keyframe*)>& change) {
  return [=](Map* map) {
    auto data = std::make_shared<Keyframe>(*map->keyframe(id).data);
    change(data.get());
    map->keyframe(id).data = data;
  };
}

std::function<void(Map*)> inKeyframe(KeyframeId id, const std::function<void(MapKeyframe*)>& change) {
  return [=](Map* map) { change(&map->keyframe(id)); };
}

/// Changes the IMU samples from the previous keyframe; the factor stays.
std::function<void(Map*)> inImu(KeyframeId id, const std::function<void(std::vector<ImuSample>*)>& change) {
  return inKeyframe(id, [=](MapKeyframe* kf) {
    auto samples = std::make_shared<std::vector<ImuSample>>(*kf->imu);
    change(samples.get());
    kf->imu = samples;
  });
}

/// Changes the first plane observation of the newest keyframe.
std::function<void(Map*)> inObservation(const std::function<void(PlaneObservation*)>& change) {
  return inKeyframe(4, [=](MapKeyframe* kf) { change(&kf->planes.begin()->second); });
}

/// Takes the first view from a landmark; its keyframe keeps a link, from the feature with the number of the next view.
void linkToTheNext(Map* map, LandmarkId id) {
  const MapObservation first = map->landmark(id).observations[0], next = map->landmark(id).observations[1];
  map->removeObservation(id, first.keyframe);
  LandmarkId& link = map->keyframe(first.keyframe).landmarks.at(next.feature);
  if (link != kNoLandmark) map->removeLandmark(LandmarkId(link));
  link = id;
}

}  // namespace

TEST(MapChecker, SeesDamagedKeyframes) {
  const Whole whole;
  whole.expectSeen({
      {"carry another id", inKeyframe(2, [](MapKeyframe* kf) { kf->data = nullptr; })},
      {"carry another id", inData(2, [](Keyframe* data) { data->id = 3; })},
      {"without an id", [](Map* map) { keyframesOf(map)[0].data = std::make_shared<Keyframe>(); }},
      {"feature 3 is not finite", inData(2, [](Keyframe* data) { data->frame.features[3].xy.x() = float(kNan); })},
      {"differ in number", inKeyframe(2, [](MapKeyframe* kf) { kf->landmarks.push_back(kNoLandmark); })},
      {"state in the map", inKeyframe(2, [](MapKeyframe* kf) { kf->state.t = kNan; })},
      {"state in the map", inKeyframe(2, [](MapKeyframe* kf) { kf->state.T_W_I.t().x() = kNan; })},
      {"state in the map", inKeyframe(2, [](MapKeyframe* kf) { kf->state.v_W.x() = kNan; })},
      {"state in the map", inKeyframe(2, [](MapKeyframe* kf) { kf->state.bias_gyro.x() = kNan; })},
      {"state in the map", inKeyframe(2, [](MapKeyframe* kf) { kf->state.bias_accel.x() = kNan; })},
      {"extrinsics in the map", inKeyframe(2, [](MapKeyframe* kf) { kf->T_I_C.t().x() = kNan; })},
      {"gyro's correction in the map", inKeyframe(2, [](MapKeyframe* kf) { kf->gyro_correction(1, 2) = 1.1; })},
      {"IMU's noise in the map", inKeyframe(2, [](MapKeyframe* kf) { kf->imu_noise_scale.density = 0; })},
  });
}

TEST(MapChecker, SeesADamagedChain) {
  const Whole whole;
  whole.expectSeen({
      {"next keyframe is not in the map", inKeyframe(4, [](MapKeyframe* kf) { kf->next = 99; })},
      {"next keyframe does not link back", inKeyframe(2, [](MapKeyframe* kf) { kf->next = 1; })},
      {"previous keyframe is not in the map", inKeyframe(1, [](MapKeyframe* kf) { kf->previous = 99; })},
      {"previous keyframe does not link back", inKeyframe(1, [](MapKeyframe* kf) { kf->previous = 3; })},
      {"of another odometry", inData(4, [](Keyframe* data) { data->frame.epoch = 9; })},
      {"stamp is not after", inData(3, [](Keyframe* data) { data->frame.t = 0.3; })},
      {"motion is unusable", inKeyframe(2, [](MapKeyframe* kf) { kf->motion.covariance(4, 4) = -1; })},
      {"without a previous keyframe", [](Map* map) { map->keyframe(1).motion = map->keyframe(2).motion; }},
      {"without a previous keyframe", [](Map* map) { map->keyframe(1).imu = map->keyframe(2).imu; }},
      {"without a previous keyframe",
       [](Map* map) { map->keyframe(1).preintegration = map->keyframe(2).preintegration; }},
  });
}

TEST(MapChecker, SeesDamagedImuFactors) {
  const Whole whole;
  const auto factor = [](const std::vector<ImuSample>& samples, double bias) {
    return std::make_shared<Preintegration>(samples, Eigen::Vector3d::Constant(bias), Eigen::Vector3d::Zero(),
                                            ImuNoise());
  };
  whole.expectSeen({
      {"samples without a factor", inKeyframe(3, [](MapKeyframe* kf) { kf->preintegration = nullptr; })},
      {"a factor without samples", inKeyframe(3, [](MapKeyframe* kf) { kf->imu = nullptr; })},
      {"of a single sample", inImu(3, [](auto* imu) { imu->resize(1); })},
      {"sample 5 at 0.320000 s is not after", inImu(3, [](auto* imu) { (*imu)[5].t = (*imu)[4].t; })},
      {"factor is not finite", inKeyframe(3, [=](MapKeyframe* kf) { kf->preintegration = factor(*kf->imu, kNan); })},
      {"factor lasts longer or shorter",
       inKeyframe(3,
                  [=](MapKeyframe* kf) {
                    kf->preintegration = factor(std::vector<ImuSample>(kf->imu->begin(), kf->imu->end() - 1), 0);
                  })},
      {"than its stamps say", inData(4, [](Keyframe* data) { data->frame.t += 0.1; })},
      {"than its stamps say", inData(4, [](Keyframe* data) { data->frame.time_offset -= 0.1; })},
      {"do not begin where", inImu(3,
                                   [](auto* imu) {
                                     for (ImuSample& sample : *imu) sample.t += 1e-4;
                                   })},
      {"do not begin where", inImu(3,
                                   [](auto* imu) {
                                     for (ImuSample& sample : *imu) sample.t -= 1e-4;
                                   })},
      {"with other biases", inKeyframe(3, [](MapKeyframe* kf) { kf->state.bias_gyro.x() += 0.02; })},
      {"with other biases", inKeyframe(3, [](MapKeyframe* kf) { kf->state.bias_accel.x() += 0.2; })},
  });
}

TEST(MapChecker, SeesDamagedLinks) {
  const Whole whole;
  const LandmarkId often = whole.often;
  const MapObservation linked = whole.map.landmark(often).observations.front();
  const MapObservation free = freeFeature(whole.map, 2);
  whole.expectSeen({
      {"points to a landmark that is gone", [=](Map* map) { map->keyframe(2).landmarks[free.feature] = 987654; }},
      {"is unknown to its landmark", [=](Map* map) { map->keyframe(2).landmarks[free.feature] = often; }},
      {"is unknown to its landmark", [=](Map* map) { linkToTheNext(map, often); }},
      {"does not link back", [=](Map* map) { map->keyframe(linked.keyframe).landmarks[linked.feature] = kNoLandmark; }},
      {"does not link back", [=](Map* map) { map->landmark(often).observations.front().feature = 100000; }},
      {"seen by a keyframe that is gone", [=](Map* map) { map->landmark(often).observations.back().keyframe = 99; }},
      {"not ascending",
       [=](Map* map) { std::swap(map->landmark(often).observations[0], map->landmark(often).observations[1]); }},
      {"not ascending",
       [=](Map* map) { map->landmark(often).observations.insert(map->landmark(often).observations.begin(), linked); }},
      {"no observation", [=](Map* map) { map->landmark(often).observations.clear(); }},
  });
}

TEST(MapChecker, SeesDamagedLandmarks) {
  const Whole whole;
  const LandmarkId often = whole.often, merged = whole.merged;
  whole.expectSeen({
      {"no or another id", [=](Map* map) { map->landmark(often).id = 987654; }},
      {"no or another id", [=](Map* map) { landmarksOf(map)[kNoLandmark].id = kNoLandmark; }},
      {"position is not finite", [=](Map* map) { map->landmark(often).p_W.x() = kNan; }},
      {"lies on a plane that is gone", [=](Map* map) { map->landmark(often).plane = 9; }},
      {"was merged into another",
       [=](Map* map) {
         landmarksOf(map)[merged] = map->landmark(often);
         map->landmark(merged).id = merged;
       }},
  });
}

TEST(MapChecker, SeesDamagedPlanes) {
  const Whole whole;
  const auto inPlane = [](const std::function<void(MapPlane*)>& change) {
    return [=](Map* map) { change(&firstPlane(map)); };
  };
  whole.expectSeen({
      {"no or another id", inPlane([](MapPlane* plane) { plane->estimate.id = 9; })},
      {"no or another id",
       [](Map* map) {
         const_cast<std::map<PlaneId, MapPlane>&>(map->planes())[0].estimate.plane.n = Eigen::Vector3d::UnitZ();
       }},
      {"not a unit normal", inPlane([](MapPlane* plane) { plane->estimate.plane.n *= 1.00001; })},
      {"not a unit normal", inPlane([](MapPlane* plane) { plane->estimate.plane.n.x() = kNan; })},
      {"finite distance", inPlane([](MapPlane* plane) { plane->estimate.plane.d = kNan; })},
      {"area or outline", inPlane([](MapPlane* plane) { plane->estimate.area = kNan; })},
      {"area or outline", inPlane([](MapPlane* plane) {
         plane->estimate.polygons = {{{{kNan, 0, 0}}, {}}};
       })},
      {"area or outline", inPlane([](MapPlane* plane) {
         plane->estimate.polygons = {{{}, {{{0, kNan, 0}}}}};
       })},
  });
}

TEST(MapChecker, SeesDamagedPlaneObservations) {
  const Whole whole;
  whole.expectSeen({
      {"observes plane 77 that is gone", inKeyframe(4, [](MapKeyframe* kf) { kf->planes[77]; })},
      {"observation of another", inObservation([](PlaneObservation* seen) { seen->plane = 77; })},
      {"observation of another", inObservation([](PlaneObservation* seen) { seen->keyframe = 3; })},
      {"without points", inObservation([](PlaneObservation* seen) { seen->points.clear(); })},
      {"moments are not finite", inObservation([](PlaneObservation* seen) { seen->G(1, 1) = kNan; })},
      {"no sum of squares", inObservation([](PlaneObservation* seen) { seen->G(0, 1) *= 1.001; })},
      {"no sum of squares", inObservation([](PlaneObservation* seen) { seen->G(3, 3) *= -1; })},
      {"weight is", inObservation([](PlaneObservation* seen) { seen->weight_scale = 0; })},
      {"a point is not finite", inObservation([](PlaneObservation* seen) { seen->points[0].sigma = float(kNan); })},
      {"another correction", inObservation([](PlaneObservation* seen) { seen->camera_correction.offset = 0.01; })},
  });
}

// What differs from a sum of squares by rounding only is none the less accepted.
TEST(MapChecker, MomentsOfFewPointsAreSumsOfSquares) {
  Whole whole;
  PlaneObservation seen = whole.map.keyframe(4).planes.begin()->second;
  for (const std::size_t count : {1, 2, 3}) {
    seen.points.resize(3);
    seen.G.setZero();
    for (std::size_t k = 0; k < count; ++k) {
      const Eigen::Vector4d p = seen.points[k].p_C.cast<double>().homogeneous();
      seen.G += 1e4 * p * p.transpose();
    }
    EXPECT_EQ(validateObservation(seen), "");
    // An eigenvalue of -1e-6 of the largest is more than rounding.
    seen.G.diagonal().array() -= 1e-6 * seen.G.trace();
    EXPECT_NE(validateObservation(seen).find("no sum of squares"), std::string::npos);
    EXPECT_FALSE(whole.map.setPlaneObservation(seen));
  }
}
