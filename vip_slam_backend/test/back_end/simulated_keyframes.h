// SPDX-License-Identifier: BSD-3-Clause
// A landmark-level front end for back-end tests: keyframes with tracked features, IMU and drifting odometry in a room
// with walls, floor and free points; and the plane module's answers.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "solver/synthetic_problem.h"
#include "vip_slam_backend/map/map_checker.h"
#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

/// The error over distance of a depth camera that has none.
inline double exact(double) { return 0.0; }

class SimulatedKeyframes {
 public:
  explicit SimulatedKeyframes(unsigned seed = 1, int points = 500) : random_(seed) {
    sensor_.topics.imu = "/imu";
    sensor_.camera.width = 640;
    sensor_.camera.height = 480;
    sensor_.camera.fx = sensor_.camera.fy = 460;
    sensor_.camera.cx = 320;
    sensor_.camera.cy = 240;
    Eigen::Matrix3d R_I_C;
    R_I_C << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    sensor_.T_imu_cam = SE3(R_I_C, Eigen::Vector3d(0.05, -0.02, 0.01));
    camera_ = makeCamera(sensor_.camera);
    walls_ = {{Plane(Eigen::Vector3d(-1, 0, 0), 4), PlaneKind::kVertical},
              {Plane(Eigen::Vector3d(1, 0, 0), 4), PlaneKind::kVertical},
              {Plane(Eigen::Vector3d(0, -1, 0), 3.5), PlaneKind::kVertical},
              {Plane(Eigen::Vector3d(0, 1, 0), 3.5), PlaneKind::kVertical},
              {Plane(Eigen::Vector3d(0, 0, 1), 0), PlaneKind::kHorizontal}};
    std::uniform_real_distribution<double> u(-1, 1);
    for (int k = 0; k < points; ++k) {
      Point p;
      p.x = Eigen::Vector3d(3.8 * u(random_), 3.3 * u(random_), 1.25 + 1.2 * u(random_));
      p.wall = k % 2 ? (k / 2) % static_cast<int>(walls_.size()) : -1;
      if (p.wall >= 0) p.x = walls_[p.wall].first.project(p.x);
      for (auto& byte : p.descriptor) byte = static_cast<std::uint8_t>(random_());
      points_.push_back(p);
    }
  }

  /// From now on keyframes have no IMU samples.
  void takeAwayImu() { sensor_.topics.imu.clear(); }
  const SensorConfig& sensor() const { return sensor_; }
  NavState truth(double t) const { return syntheticState(t); }
  double interval() const { return 0.3; }

  KeyframePtr next() {
    auto kf = std::make_shared<Keyframe>();
    kf->id = ++id_;
    kf->previous = id_ - 1;
    const double t = (id_ - 1) * interval();
    kf->frame.t = t;
    kf->frame.status.state = TrackingState::kTracking;
    kf->frame.T_I_C = sensor_.T_imu_cam;
    const NavState state = truth(t);
    // Odometry: truth with a drift that grows.
    if (id_ > 1) {
      Vector6d d;
      for (int k = 0; k < 6; ++k) d(k) = gauss(k < 3 ? (k == 2 ? 2e-3 : 2e-4) : 3e-3);
      drift_ = SE3(expQuaternion(d.head<3>()), d.tail<3>()) * drift_;
      kf->motion.T_a_b = truth(t - interval()).T_W_I.inverse() * state.T_W_I;
      for (int k = 0; k < 6; ++k) d(k) = gauss(k < 3 ? 1e-3 : 2e-3);
      kf->motion.T_a_b = kf->motion.T_a_b.boxplus(d);
      kf->motion.covariance.diagonal() << 1e-6, 1e-6, 1e-6, 4e-6, 4e-6, 4e-6;
      for (int s = 0; s <= 60 && sensor_.topics.hasInertial(); ++s) {
        ImuSample m = syntheticImu(t - interval() + s * interval() / 60);
        m.gyro += Eigen::Vector3d(gauss(.014), gauss(.014), gauss(.014));
        m.accel += Eigen::Vector3d(gauss(.14), gauss(.14), gauss(.14));
        kf->imu.push_back(m);
      }
    }
    kf->frame.state = state;
    kf->frame.state.T_W_I = drift_ * state.T_W_I;
    kf->frame.state.v_W = drift_.rotation() * state.v_W;
    kf->frame.T_chain_C = kf->frame.state.T_W_I * sensor_.T_imu_cam;
    const SE3 T_C_W = (state.T_W_I * sensor_.T_imu_cam).inverse();
    for (std::size_t k = 0; k < points_.size(); ++k) {
      Point& p = points_[k];
      const Eigen::Vector3d c = T_C_W * p.x;
      Eigen::Vector2d uv;
      const bool visible = c.z() > 0.5 && camera_->project(c, &uv) && camera_->inImage(uv, 5);
      if (!visible) {
        p.track = kNoLandmark;
        continue;
      }
      if (p.track == kNoLandmark || random_() % 20 == 0) {
        // A track follows its reference patch to 0.1 px, but the patch starts at a corner that is offset from the
        // point.
        p.track = next_track_++;
        p.beside = Eigen::Vector2d(gauss(0.5), gauss(0.5));
      }
      Feature f;
      if (random_() % 12 == 0) {  // a corner the tracker missed
        uv += Eigen::Vector2d(gauss(0.7), gauss(0.7));
      } else {
        f.id = p.track;
        f.pixel_sigma = 0.1f;
        uv += p.beside + Eigen::Vector2d(gauss(0.1), gauss(0.1));
      }
      f.pixel = uv.cast<float>();
      f.xy = Eigen::Vector2f((uv.x() - 320) / 460, (uv.y() - 240) / 460);
      if (random_() % 5 != 0) {
        f.depth_sigma = static_cast<float>(0.001 + 0.003 * c.z());
        f.depth = static_cast<float>(c.z() + read_too_long_(c.z()) + gauss(f.depth_sigma));
      }
      f.descriptor = p.descriptor;
      f.descriptor[random_() % 32] ^= static_cast<std::uint8_t>(1u << (random_() % 8));
      kf->frame.features.push_back(f);
    }
    last_ = kf;
    return kf;
  }

  /// Output of a perfect plane module after the newest keyframe: true planes seen by depth, all tracks on them
  /// associated.
  PlaneUpdate planes() {
    PlaneUpdate update;
    const NavState state = truth(last_->frame.t);
    const SE3 T_W_C = state.T_W_I * sensor_.T_imu_cam;
    std::uniform_real_distribution<double> u(-1, 1);
    for (std::size_t w = 0; w < walls_.size(); ++w) {
      PlaneEstimate e;
      e.id = w + 1;
      e.kind = walls_[w].second;
      e.plane = walls_[w].first;
      update.planes.push_back(e);
      PlaneObservation o;
      o.keyframe = last_->id;
      o.plane = e.id;
      for (int k = 0; k < points_on_planes_; ++k) {
        const Eigen::Vector3d ray(0.6 * u(random_), 0.45 * u(random_), 1);
        const double z = -walls_[w].first.signedDistance(T_W_C.t()) / walls_[w].first.n.dot(T_W_C.rotation() * ray);
        if (!(z > 0.4 && z < 6)) continue;
        PlaneSample p;
        p.sigma = static_cast<float>(1.25 * sigma_on_planes_);
        p.p_C = ((z + read_too_long_(z) + gauss(sigma_on_planes_)) * ray).cast<float>();
        o.points.push_back(p);
        const Eigen::Vector4d x = p.p_C.cast<double>().homogeneous();
        o.G += x * x.transpose() / (p.sigma * p.sigma);
      }
      if (o.points.size() <= 5) continue;
      // As the plane module states it before it has seen anything: what the points share is as large as their noise.
      o.weight_scale = 1 / (1 + o.G(3, 3) * sigma_on_planes_ * sigma_on_planes_);
      o.G *= o.weight_scale;
      update.observations.push_back(o);
    }
    for (const Point& p : points_)
      if (p.track != kNoLandmark && p.wall >= 0) update.associated.emplace_back(p.track, p.wall + 1);
    return update;
  }

  /// Sets the depth error over distance (m, positive: too long), and noise (m) and number of the points on each plane.
  void setDepthCamera(std::function<double(double)> read_too_long, double sigma_on_planes, int points_on_planes = 200) {
    read_too_long_ = std::move(read_too_long);
    sigma_on_planes_ = sigma_on_planes;
    points_on_planes_ = points_on_planes;
  }

  double gauss(double sigma) { return sigma * normal_(random_); }
  const std::vector<std::pair<Plane, PlaneKind>>& walls() const { return walls_; }

 private:
  struct Point {
    Eigen::Vector3d x;
    int wall = -1;
    LandmarkId track = kNoLandmark;
    Eigen::Vector2d beside = Eigen::Vector2d::Zero();  // px
    Descriptor descriptor{};
  };
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  SensorConfig sensor_;
  std::shared_ptr<const CameraModel> camera_;
  std::vector<std::pair<Plane, PlaneKind>> walls_;
  std::vector<Point> points_;
  KeyframeId id_ = 0;
  LandmarkId next_track_ = 0;
  SE3 drift_;
  KeyframePtr last_;
  std::function<double(double)> read_too_long_ = [](double) { return 0.0; };
  double sigma_on_planes_ = 0.012;
  int points_on_planes_ = 30;
};

/// The next keyframes at true poses, with the result of planes() after each; checked.
inline Map mapAtTruePoses(SimulatedKeyframes* world, int keyframes) {
  Map map;
  for (int k = 0; k < keyframes; ++k) {
    const KeyframePtr kf = world->next();
    map.addKeyframe(kf, world->truth(kf->frame.t), ImuNoise());
    const PlaneUpdate planes = world->planes();
    for (const PlaneEstimate& plane : planes.planes) map.setPlane(plane);
    for (const PlaneObservation& observation : planes.observations) map.setPlaneObservation(observation);
    EXPECT_EQ(checkMap(map), "") << "after keyframe " << kf->id;
  }
  return map;
}

}  // namespace vip_slam
