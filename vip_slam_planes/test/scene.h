// SPDX-License-Identifier: BSD-3-Clause
// Test support: exact depth images of scenes made of flat rectangles, and keyframes taken in them.
#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "vip_slam_core/camera/bearing_correction.h"
#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/types/map_update.h"

namespace vip_slam {
namespace testing {

struct Rectangle {
  Eigen::Vector3d corner, u, v;  ///< corner + s u + t v with s, t in [0, 1]
};

struct Scene {
  std::vector<Rectangle> rectangles;

  void add(const Eigen::Vector3d& corner, const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    rectangles.push_back({corner, u, v});
  }
  /// Inside faces of an axis-aligned room.
  void addRoom(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    const Eigen::Vector3d s = high - low;
    const Eigen::Vector3d x(s.x(), 0, 0), y(0, s.y(), 0), z(0, 0, s.z());
    add(low, x, y);
    add(low + z, x, y);
    add(low, x, z);
    add(low + y, x, z);
    add(low, y, z);
    add(low + x, y, z);
  }
  /// Ray parameter of the nearest hit along direction (not normalised), infinity: none.
  double cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    double best = std::numeric_limits<double>::infinity();
    for (const Rectangle& r : rectangles) {
      const Eigen::Vector3d n = r.u.cross(r.v);
      const double facing = n.dot(direction);
      if (std::abs(facing) < 1e-12) continue;
      const double s = n.dot(r.corner - origin) / facing;
      if (s < 1e-3 || s > best) continue;
      const Eigen::Vector3d q = origin + s * direction - r.corner;
      const double a = q.dot(r.u) / r.u.squaredNorm(), b = q.dot(r.v) / r.v.squaredNorm();
      if (a >= 0 && a <= 1 && b >= 0 && b <= 1) best = s;
    }
    return best;
  }
};

/// The camera with the true intrinsics, if those of `given` have to be corrected by `bearing`.
inline std::shared_ptr<const CameraModel> cameraThatMeans(const CameraModel& given, const BearingCorrection& bearing) {
  CameraIntrinsics k = given.intrinsics();
  const Eigen::Vector4d right = correctedIntrinsics({k.fx, k.fy, k.cx, k.cy}, bearing);
  k.fx = right(0), k.fy = right(1), k.cx = right(2), k.cy = right(3);
  return makeCamera(k);
}

inline std::shared_ptr<const CameraModel> testCamera() {
  CameraIntrinsics k;
  k.width = 640, k.height = 480, k.fx = k.fy = 525, k.cx = 319.5, k.cy = 239.5;
  return makeCamera(k);
}

inline DepthNoise quietNoise() {
  DepthNoise noise;
  noise.a = 0.001, noise.b = 0.0017, noise.c = 0, noise.min_range = 0.2, noise.max_range = 10;
  return noise;
}

/// Camera at `eye` that looks at `target` with the image upright (z up).
inline SE3 lookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  const Eigen::Vector3d forward = (target - eye).normalized();
  Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ());
  if (right.norm() < 1e-6) right = Eigen::Vector3d::UnitX();
  right.normalize();
  Eigen::Matrix3d R;
  R << right, forward.cross(right), forward;
  return SE3(R, eye);
}

class SceneCamera {
 public:
  explicit SceneCamera(DepthNoise noise = quietNoise(), double noise_scale = 0, unsigned seed = 1)
      : camera(testCamera()), noise(noise), noise_scale_(noise_scale), random_(seed) {}

  cv::Mat depth(const Scene& scene, const SE3& T_W_C) {
    cv::Mat image(camera->height(), camera->width(), CV_32FC1, cv::Scalar(0));
    const Eigen::Matrix3d R = T_W_C.R();
    std::normal_distribution<double> gauss;
    for (int v = 0; v < image.rows; ++v) {
      for (int u = 0; u < image.cols; ++u) {
        const Eigen::Vector3d ray = camera->unproject(Eigen::Vector2d(u, v), 1.0);
        double z = scene.cast(T_W_C.t(), R * ray);
        if (noise_scale_ > 0) z += noise_scale_ * noise.sigma(z) * gauss(random_);
        if (noise.inRange(z)) image.at<float>(v, u) = float(z);
      }
    }
    return image;
  }

  TrackedFrame frame(const Scene& scene, const SE3& T_W_C, double t, int stride) {
    TrackedFrame f;
    f.t = t;
    f.status.state = TrackingState::kTracking;
    f.state.t = t;
    f.state.T_W_I = T_W_C;  // camera and IMU coincide
    const cv::Mat image = depth(scene, T_W_C);
    f.depth_grid = makeDepthGrid(image, stride, noise);
    last_depth_ = image;
    return f;
  }

  /// A keyframe taken at T_W_C. `points` become features with their index as id where they are visible.
  std::shared_ptr<Keyframe> keyframe(const Scene& scene, const SE3& T_W_C,
                                     const std::vector<Eigen::Vector3d>& points = {}, double pixel_noise = 0) {
    auto k = std::make_shared<Keyframe>();
    k->id = ++last_id_;
    k->previous = last_id_ - 1;
    k->frame = frame(scene, T_W_C, 0.5 * double(last_id_), 8);
    k->frame.keyframe = k->id;
    k->depth_noise = parts;
    std::normal_distribution<double> gauss;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d p = T_W_C.inverse() * points[i];
      Eigen::Vector2d uv;
      if (!camera->project(p, &uv) || !camera->inImage(uv, 3)) continue;
      if (scene.cast(T_W_C.t(), points[i] - T_W_C.t()) < 1 - 0.02 / p.norm()) continue;  // hidden
      uv += pixel_noise * Eigen::Vector2d(gauss(random_), gauss(random_));
      Feature f;
      f.id = LandmarkId(i);
      f.pixel = uv.cast<float>();
      Eigen::Vector2d xy;
      camera->undistort(uv, &xy);
      f.xy = xy.cast<float>();
      f.depth = safeDepth(last_depth_, uv.x(), uv.y(), noise);
      f.depth_sigma = float(noise.sigma(f.depth));
      k->frame.features.push_back(f);
    }
    return k;
  }

  std::shared_ptr<const CameraModel> camera;
  DepthNoise noise;
  DepthNoiseParts parts{0.15, 0.0};  ///< as the front end learns them of white noise

 private:
  double noise_scale_;
  std::mt19937 random_;
  KeyframeId last_id_ = 0;
  cv::Mat last_depth_;
};

/// The update for one keyframe by a back end that knows the truth.
inline MapUpdate updateFor(const Keyframe& keyframe, const SE3& T_W_I) {
  MapUpdate update;
  update.revision = keyframe.id;
  update.t = keyframe.frame.t;
  update.newest_keyframe = keyframe.id;
  KeyframeEstimate estimate;
  estimate.id = keyframe.id;
  estimate.state.T_W_I = T_W_I;
  update.keyframes.push_back(estimate);
  return update;
}

}  // namespace testing
}  // namespace vip_slam
