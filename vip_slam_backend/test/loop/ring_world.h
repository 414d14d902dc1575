// SPDX-License-Identifier: BSD-3-Clause
// A camera on a circle that looks at a round wall full of points; the estimate drifts. For loop and relocalisation
// tests.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "place_recognition/synthetic_descriptors.h"
#include "vip_slam_backend/map/map_checker.h"
#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {

class RingWorld {
 public:
  /// `bays` > 1: the wall repeats itself, points and descriptors, that many times round.
  explicit RingWorld(int bays = 1, std::uint64_t seed = 4) : random_(seed) {
    CameraIntrinsics k;
    k.width = 640;
    k.height = 480;
    k.fx = k.fy = 480;
    k.cx = 319.5;
    k.cy = 239.5;
    camera_ = makeCamera(k);
    const int per_bay = 3000 / bays;
    std::vector<double> angle, height, radius;
    std::vector<Descriptor> looks;
    for (int p = 0; p < per_bay; ++p) {
      angle.push_back(uniform(0, 2 * M_PI / bays));
      height.push_back(uniform(0, 3));
      radius.push_back(uniform(7.5, 8.5));
      looks.push_back(randomDescriptor(random_));
    }
    for (int b = 0; b < bays; ++b)
      for (int p = 0; p < per_bay; ++p) {
        const double a = angle[p] + 2 * M_PI * b / bays;
        points_.emplace_back(radius[p] * std::cos(a), radius[p] * std::sin(a), height[p]);
        looks_.push_back(looks[p]);
      }
  }

  const std::shared_ptr<const CameraModel>& camera() const { return camera_; }
  SE3 T_I_C() const { return SE3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), Eigen::Vector3d(0.05, 0, 0)); }
  /// Body on the circle at `angle`, x outwards.
  SE3 truth(double angle) const {
    return SE3(Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
               Eigen::Vector3d(5 * std::cos(angle), 5 * std::sin(angle), 1.5));
  }

  KeyframePtr see(KeyframeId id, double t, const SE3& T_W_I, const SE3& T_odom_I, LandmarkId first_track) {
    auto kf = std::make_shared<Keyframe>();
    kf->id = id;
    kf->frame.t = t;
    kf->frame.status.state = TrackingState::kTracking;
    kf->frame.T_I_C = T_I_C();
    kf->frame.state.T_W_I = T_odom_I;
    kf->frame.state.t = t;
    const SE3 T_C_W = (T_W_I * T_I_C()).inverse();
    for (std::size_t p = 0; p < points_.size(); ++p) {
      const Eigen::Vector3d p_C = T_C_W * points_[p];
      Eigen::Vector2d uv;
      if (p_C.z() < 0.5 || p_C.z() > 6 || !camera_->project(p_C, &uv) || !camera_->inImage(uv, 5)) continue;
      uv += Eigen::Vector2d(normal(0.3), normal(0.3));
      Feature f;
      f.id = first_track + static_cast<LandmarkId>(p);
      f.pixel = uv.cast<float>();
      f.xy = Eigen::Vector2f((f.pixel.x() - 319.5f) / 480, (f.pixel.y() - 239.5f) / 480);
      f.depth_sigma = static_cast<float>(0.003 * p_C.z());
      f.depth = static_cast<float>(p_C.z() + normal(f.depth_sigma));
      f.descriptor = noisy(looks_[p], 0.03, random_);
      kf->frame.features.push_back(f);
    }
    return kf;
  }

  /// A walk from angle 0 to `turns` times round, two keyframes a second; position and yaw drift by `drift` metres and
  /// radians over the walk. Tracks of the second round are new landmarks. The ring's centre is at `centre` in the map;
  /// the estimate is tilted by `tilt` radians.
  void walk(Map& map, double turns, double drift, std::vector<SE3>* truths,
            const Eigen::Vector3d& centre = Eigen::Vector3d::Zero(), double tilt = 0) {
    const SE3 T_map_ring(Eigen::Quaterniond::Identity(), centre);
    const int n = static_cast<int>(turns * 90);
    for (int k = 0; k < n; ++k) {
      const double angle = 2 * M_PI * k / 90, s = static_cast<double>(k) / n;
      const SE3 T = truth(angle);
      const SE3 error(Eigen::Quaterniond(Eigen::AngleAxisd(0.15 * drift * s, Eigen::Vector3d::UnitZ()) *
                                         Eigen::AngleAxisd(tilt * s, Eigen::Vector3d::UnitY())),
                      drift * s * Eigen::Vector3d(0.8, -0.5, 0.2));
      const SE3 estimate = T_map_ring * error * T;
      KeyframePtr kf = see(k + 1, 100 + 0.5 * k, T, estimate, k < 80 ? 0 : 100000);
      auto linked = std::make_shared<Keyframe>(*kf);
      linked->previous = k;
      NavState state = linked->frame.state;
      map.addKeyframe(linked, state, ImuNoise());
      addLandmarks(map, *linked);
      truths->push_back(T);
    }
    EXPECT_EQ(checkMap(map), "") << "after the walk";
  }

  /// Adds each track of a keyframe as a landmark, at its position seen from the first keyframe.
  void addLandmarks(Map& map, const Keyframe& keyframe) const {
    const SE3 estimate = map.keyframe(keyframe.id).state.T_W_I;
    for (std::uint32_t f = 0; f < keyframe.frame.features.size(); ++f) {
      const Feature& feature = keyframe.frame.features[f];
      const MapObservation o{keyframe.id, f};
      if (const LandmarkId id = map.resolve(feature.id); map.hasLandmark(id))  // a loop may have joined it to another
        map.addObservation(id, o);
      else
        map.addLandmark(feature.id,
                        estimate * (T_I_C() * (feature.depth * Eigen::Vector3d(feature.xy.x(), feature.xy.y(), 1))), o);
    }
  }

  /// Each keyframe of a walk observes the floor in front of it; from keyframe `second` on as another plane.
  void addFloors(Map& map, const std::vector<SE3>& truths, KeyframeId second) {
    const Plane floor(Eigen::Vector3d::UnitZ(), 0);
    for (std::size_t k = 0; k < truths.size(); ++k) {
      const MapKeyframe& kf = map.keyframe(k + 1);
      PlaneObservation seen;
      seen.keyframe = kf.id();
      seen.plane = kf.id() < second ? 1 : 2;
      if (!map.hasPlane(seen.plane)) {
        PlaneEstimate estimate;
        estimate.id = seen.plane;
        estimate.kind = PlaneKind::kHorizontal;
        estimate.plane = transformPlane(kf.state.T_W_I * truths[k].inverse(), floor);
        map.setPlane(estimate);
      }
      const SE3 T_C_W = (truths[k] * T_I_C()).inverse();
      for (int p = 0; p < 30; ++p) {
        PlaneSample point;
        point.sigma = 0.01f;
        const Eigen::Vector3d ahead = truths[k] * Eigen::Vector3d(2 + 0.2 * (p % 6), 0.2 * (p / 6) - 0.4, -1.5);
        point.p_C = (T_C_W * ahead).cast<float>();
        const Eigen::Vector4d x = point.p_C.cast<double>().homogeneous();
        seen.G += x * x.transpose() / (point.sigma * point.sigma);
        seen.points.push_back(point);
      }
      map.setPlaneObservation(seen);
    }
    EXPECT_EQ(checkMap(map), "") << "after adding the floors";
  }

 private:
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
  double normal(double s) { return std::normal_distribution<double>(0, s)(random_); }
  std::mt19937_64 random_;
  std::shared_ptr<const CameraModel> camera_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Descriptor> looks_;
};

}  // namespace vip_slam
