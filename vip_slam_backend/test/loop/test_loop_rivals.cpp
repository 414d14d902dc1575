// SPDX-License-Identifier: BSD-3-Clause
// An aisle of equal bays that is walked twice, with a long way in between: similar appearance alone makes no loop.
#include <cmath>
#include <memory>
#include <random>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "place_recognition/synthetic_descriptors.h"
#include "vip_slam_backend/loop/loop_closer.h"
#include "vip_slam_backend/map/map_checker.h"
#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {
namespace {

constexpr double kFocal = 480, kBegin = -5, kLength = 40;
constexpr int kPointsPerMetre = 60;

class Aisle {
 public:
  /// Bays of `period` metres; `unique`: share of each bay's points that no other bay has.
  Aisle(double period, double unique) {
    CameraIntrinsics intrinsics;
    intrinsics.width = 640, intrinsics.height = 480;
    intrinsics.fx = intrinsics.fy = kFocal;
    intrinsics.cx = 319.5, intrinsics.cy = 239.5;
    camera_ = makeCamera(intrinsics);
    std::vector<Eigen::Vector3d> bay;
    std::vector<Descriptor> looks;
    for (int i = 0; i < kPointsPerMetre * period; ++i) {
      bay.push_back(point(period));
      looks.push_back(randomDescriptor(random_));
    }
    for (int n = 0; n < kLength / period; ++n) {
      const Eigen::Vector3d begin(kBegin + n * period, 0, 0);
      for (std::size_t i = 0; i < bay.size(); ++i) {
        const bool own = uniform(0, 1) < unique;
        points_.push_back(begin + (own ? point(period) : bay[i]));
        looks_.push_back(own ? randomDescriptor(random_) : looks[i]);
      }
    }
  }
  std::shared_ptr<const CameraModel> camera() const { return camera_; }
  SE3 T_I_C() const { return SE3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), Eigen::Vector3d(0.05, 0, 0)); }
  static SE3 poseAt(double x, double y, double turn) {
    return SE3(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2 + turn, Eigen::Vector3d::UnitZ())), {x, y, 1.5});
  }
  /// Features of a camera at `T_W_I` in the aisle; random ones when it is elsewhere (`there` false).
  std::vector<Feature> see(const SE3& T_W_I, LandmarkId first, bool there) {
    std::vector<Feature> features;
    const SE3 T_C_W = (T_W_I * T_I_C()).inverse();
    for (std::size_t p = 0; p < (there ? points_.size() : 60u); ++p) {
      Eigen::Vector2d uv(uniform(10, 630), uniform(10, 470));
      double z = uniform(2, 4);
      if (there) {
        const Eigen::Vector3d p_C = T_C_W * points_[p];
        z = p_C.z();
        if (z < 0.5 || z > 6 || !camera_->project(p_C, &uv) || !camera_->inImage(uv, 5)) continue;
        uv += Eigen::Vector2d(gauss(0.3), gauss(0.3));
      }
      Feature f;
      f.id = first + p;
      f.pixel = uv.cast<float>();
      f.xy = ((uv - Eigen::Vector2d(319.5, 239.5)) / kFocal).cast<float>();
      f.depth_sigma = static_cast<float>(0.003 * z);
      f.depth = static_cast<float>(z + gauss(0.003 * z));
      f.descriptor = there ? noisy(looks_[p], 0.03, random_) : randomDescriptor(random_);
      features.push_back(f);
    }
    return features;
  }

 private:
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
  double gauss(double sigma) { return std::normal_distribution<double>(0, sigma)(random_); }
  Eigen::Vector3d point(double period) { return {uniform(0, period), uniform(3, 3.8), uniform(0, 3)}; }

  std::mt19937_64 random_{4};
  std::shared_ptr<const CameraModel> camera_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Descriptor> looks_;
};

struct Walk {
  int right = 0, wrong = 0;
};

/// Along the aisle, `way` metres elsewhere and along the aisle again, with 5 cm of drift by then.
Walk walkTwice(double period, double unique, double way, TrackingState state) {
  constexpr double kEnd = 25, kStep = 0.4, kDrift = 0.05;
  struct Stop {
    SE3 T_W_I;
    int round;
  };
  std::vector<Stop> stops;
  for (double x = 0; x <= kEnd; x += kStep) stops.push_back({Aisle::poseAt(x, 0, 0), 0});
  for (double s = 2; s < way; s += 2) {
    const double turn = 2 * M_PI * s / way, radius = way / (2 * M_PI);
    stops.push_back(
        {Aisle::poseAt(kEnd * (1 - s / way) + radius * std::sin(turn), -radius * (1 - std::cos(turn)), turn), 1});
  }
  for (double x = 0.17; x <= kEnd; x += kStep) stops.push_back({Aisle::poseAt(x, 0, 0), 2});

  Aisle aisle(period, unique);
  Map map;
  LoopCloser closer(LoopOptions(), aisle.camera());
  SE3 T_map_odom;
  Walk walk;
  for (std::size_t k = 0; k < stops.size() && walk.right + walk.wrong < 6; ++k) {
    const auto& [T_W_I, round] = stops[k];
    auto kf = std::make_shared<Keyframe>();
    kf->id = k + 1;
    kf->previous = k;
    kf->frame.t = 100 + 0.7 * static_cast<double>(k);
    kf->frame.status.state = state;
    kf->frame.T_I_C = aisle.T_I_C();
    const Eigen::Vector3d drift(kDrift * static_cast<double>(k) / static_cast<double>(stops.size()), 0, 0);
    kf->frame.state.T_W_I = SE3(T_W_I.rotation(), T_W_I.t() + drift);
    kf->frame.features =
        aisle.see(T_W_I, round == 1 ? 10000000 + 1000 * k : 1000000 * static_cast<LandmarkId>(round), round != 1);
    NavState state_in_map = kf->frame.state;
    state_in_map.T_W_I = T_map_odom * state_in_map.T_W_I;
    map.addKeyframe(kf, state_in_map, ImuNoise());
    for (std::uint32_t f = 0; f < kf->frame.features.size(); ++f) {
      const Feature& feature = kf->frame.features[f];
      const LandmarkId id = map.resolve(feature.id);
      const Eigen::Vector3d p_C = double(feature.depth) * feature.xy.cast<double>().homogeneous();
      if (map.hasLandmark(id)) {
        map.addObservation(id, {kf->id, f});
      } else if (id == feature.id) {
        map.addLandmark(id, state_in_map.T_W_I * (aisle.T_I_C() * p_C), {kf->id, f});
      }
    }
    closer.add(map, kf->id);
    for (const LoopEvent& event : closer.close(map, kf->id)) {
      if (!event.accepted) continue;
      EXPECT_EQ(checkMap(map), "") << "after the loop from keyframe " << kf->id;
      const SE3 truth = stops[event.match - 1].T_W_I.inverse() * T_W_I;
      ++((event.T_match_query.t() - truth.t()).norm() < 0.1 ? walk.right : walk.wrong);
    }
    T_map_odom = map.keyframe(kf->id).state.T_W_I * kf->frame.state.T_W_I.inverse();
  }
  EXPECT_EQ(checkMap(map), "");
  return walk;
}

TEST(LoopRivals, ABayIsNotTakenForItsNeighbour) {
  for (const auto& [period, unique, way] : {std::tuple(1.2, 0.1, 300.0), {1.2, 0.0, 100.0}, {2.0, 0.2, 500.0}}) {
    const Walk walk = walkTwice(period, unique, way, TrackingState::kTracking);
    EXPECT_EQ(walk.wrong, 0) << period << ' ' << unique;
    EXPECT_GT(walk.right, 3) << period << ' ' << unique;
  }
}

// Without depth the tracking state is always degraded, which inflates the odometry's sigmas ten times.
TEST(LoopRivals, NorWhereTheOdometryKnowsLittle) {
  const Walk walk = walkTwice(5.0, 0.1, 100.0, TrackingState::kDegraded);
  EXPECT_EQ(walk.wrong, 0);
  EXPECT_GT(walk.right, 3);
}

}  // namespace
}  // namespace vip_slam
