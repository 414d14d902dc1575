// SPDX-License-Identifier: BSD-3-Clause
// Turns radiance and exact depth into sensor images with blur, exposure, noise and missing depth.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_sim/render/auto_exposure.h"
#include "vip_slam_sim/render/coarse_depth.h"
#include "vip_slam_sim/render/disparity_steps.h"
#include "vip_slam_sim/render/jpeg_compression.h"
#include "vip_slam_sim/render/renderer.h"
#include "vip_slam_sim/sequence/sequence_spec.h"

namespace vip_slam {

/// Velocity of the camera in its own frame.
struct CameraTwist {
  Eigen::Vector3d v_C = Eigen::Vector3d::Zero(), omega_C = Eigen::Vector3d::Zero();
};

class SensorEffects {
 public:
  SensorEffects(const EffectOptions& effects, const DepthOptions& depth, const CameraModel& camera, int seed);

  /// From now on the exposure follows the scene.
  void setAutoExposure(std::shared_ptr<const AutoExposure> control) { control_ = std::move(control); }
  /// Smears the radiance along the optical flow of the exposure time.
  void motionBlur(const CameraTwist& twist, double t, FrameBuffers* frame) const;
  /// 8UC3 RGB of frame number `index`, taken `t` seconds into the sequence.
  cv::Mat colour(const FrameBuffers& frame, int index, double t) const;
  /// 16UC1 millimetres, 0 = invalid, from depth with its shared errors in it (SharedDepthError). `brightness` (8UC3,
  /// may be empty) shows which surfaces are dark.
  cv::Mat depth(const FrameBuffers& frame, const cv::Mat& brightness, int index) const;

 private:
  const float* noise(std::uint64_t key) const;
  Exposure exposure(double t) const;

  EffectOptions effects_;
  DepthOptions depth_;
  const CameraModel& camera_;
  DisparitySteps steps_;
  CoarseDepth coarse_;
  JpegCompression jpeg_;
  std::shared_ptr<const AutoExposure> control_;
  std::uint64_t seed_;
  std::vector<float> vignette_;
  std::vector<float> gauss_;  ///< standard normal deviates, read from random places
};

}  // namespace vip_slam
