// SPDX-License-Identifier: BSD-3-Clause
// People who walk in front of the camera: upright elliptic cylinders with a texture. They occlude the scene in colour
// and depth, belong to no true plane, and cast no shadows.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_sim/render/renderer.h"
#include "vip_slam_sim/scene/texture.h"
#include "vip_slam_sim/sequence/sequence_spec.h"

namespace vip_slam {

class PassersBy {
 public:
  /// `camera(t)`: T_W_C at time t; they walk in front of it.
  PassersBy(const PasserOptions& options, std::function<SE3(double t)> camera, int seed);

  /// Draws those in view at time `t` over a frame rendered by `renderer`. `row_pose(row)`: T_W_C when the row is read.
  void draw(const Renderer& renderer, double t, const std::function<SE3(int row)>& row_pose, FrameBuffers* frame) const;

 private:
  struct Body;
  std::vector<Body> bodies(double t) const;

  PasserOptions options_;
  std::function<SE3(double t)> camera_;
  std::vector<std::unique_ptr<Texture>> clothes_;
};

}  // namespace vip_slam
