// SPDX-License-Identifier: BSD-3-Clause
// Renders what a camera sees: radiance, exact depth and which piece of the scene each pixel shows.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_sim/render/ray_tracer.h"
#include "vip_slam_sim/scene/scene.h"

namespace vip_slam {

struct FrameBuffers {
  cv::Mat radiance;  ///< CV_32FC4, linear, 1 = full scale at exposure 1
  cv::Mat depth;     ///< CV_32FC1, z in metres, exact; 0 where nothing is hit
  cv::Mat piece;     ///< CV_32SC1, -1 where nothing is hit
  cv::Mat grazing;   ///< CV_32FC1, cosine between ray and surface normal
};

class Renderer {
 public:
  /// `gloss`: how much the shiniest surfaces mirror the scene, of what a polished one would; surfaces differ.
  Renderer(std::shared_ptr<const Scene> scene, std::shared_ptr<const RayTracer> tracer,
           std::shared_ptr<const CameraModel> camera, double gloss = 0);

  /// `row_pose(row)` gives T_W_C when the row is read out (the same for all rows with a global shutter). Several
  /// threads may render with one Renderer.
  void render(const std::function<SE3(int row)>& row_pose, bool rolling, FrameBuffers* out) const;
  void render(const SE3& T_W_C, FrameBuffers* out) const;
  /// Depth, piece and grazing angle only.
  void renderDepth(const std::function<SE3(int row)>& row_pose, bool rolling, FrameBuffers* out) const;
  void renderDepth(const SE3& T_W_C, FrameBuffers* out) const;

  /// Direction of a pixel, z = 1 in the camera.
  Eigen::Vector3d ray(int u, int v) const { return {x_[v * camera_->width() + u], y_[v * camera_->width() + u], 1.0}; }
  const CameraModel& camera() const { return *camera_; }
  const Scene& scene() const { return *scene_; }

 private:
  struct RowFrame;  // camera axes and centre of one row, in floats
  struct Ray;
  Vec4 lightOn(int piece, const Vec3& p, float u, float v) const;
  Vec4 shade(int piece, float t, const Ray& ray) const;
  void antialias(const std::vector<RowFrame>& rows, FrameBuffers* out) const;
  void addReflections(const std::vector<RowFrame>& rows, FrameBuffers* out) const;
  void cast(const std::function<SE3(int)>& row_pose, bool rolling, bool shading, FrameBuffers* out) const;

  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<const RayTracer> tracer_;
  std::shared_ptr<const CameraModel> camera_;
  std::vector<float> gloss_;  ///< of each chart; empty when nothing mirrors
  std::vector<float> x_, y_;  ///< normalised coordinates of every pixel
};

}  // namespace vip_slam
