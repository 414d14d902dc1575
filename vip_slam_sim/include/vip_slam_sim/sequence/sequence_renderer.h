// SPDX-License-Identifier: BSD-3-Clause
// Renders a sequence in memory: frames in order to a callback, IMU, truth. No ROS.
//
//   SequenceRenderer sequence(loadSequence("smoke", library));
//   sequence.render([&](const SimFrame& f) { ...; return true; });
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_core/types/true_plane.h"
#include "vip_slam_sim/motion/imu_synthesiser.h"
#include "vip_slam_sim/motion/spline_trajectory.h"
#include "vip_slam_sim/render/edge_fattening.h"
#include "vip_slam_sim/render/multipath.h"
#include "vip_slam_sim/render/passers_by.h"
#include "vip_slam_sim/render/renderer.h"
#include "vip_slam_sim/render/sensor_effects.h"
#include "vip_slam_sim/render/shared_depth_error.h"
#include "vip_slam_sim/scene/truth_planes.h"
#include "vip_slam_sim/sequence/sequence_spec.h"

namespace vip_slam {

struct SimFrame {
  int index = 0;
  std::int64_t stamp_ns = 0;  ///< header stamp (image clock), exposure middle
  std::int64_t depth_stamp_ns = 0;
  cv::Mat rgb;         ///< CV_8UC3, RGB
  cv::Mat depth;       ///< CV_16UC1, mm, 0 = invalid; of the depth camera when not registered
  SE3 T_W_C;           ///< true colour camera
  FrameBuffers exact;  ///< noise-free, colour camera
};

struct RenderOptions {
  int threads = 2;
  double light_spacing_scale = 1;  ///< > 1: coarser light maps, quicker start
  int first = 0, count = -1;       ///< frames; -1: all
};

class SequenceRenderer {
 public:
  /// Builds and lights the scene, plans the motion, synthesises the IMU. Throws std::runtime_error or
  /// std::invalid_argument naming what is wrong (unknown scene, motion through a wall, ...).
  explicit SequenceRenderer(const SequenceSpec& spec, const RenderOptions& options = {});
  ~SequenceRenderer();

  const SequenceSpec& spec() const { return spec_; }
  const SensorConfig& sensor() const { return sensor_; }
  const SplineTrajectory& trajectory() const { return trajectory_; }
  const Scene& scene() const { return *scene_; }
  const ImuLog& imu() const { return imu_; }  ///< times from 0
  int frameCount() const { return frame_count_; }
  std::shared_ptr<const CameraModel> camera() const { return camera_; }  ///< as it is, not as stated

  /// Nanoseconds of trajectory time t on the IMU clock, and back.
  std::int64_t toNanoseconds(double t) const;
  double toSeconds(std::int64_t stamp_ns) const;
  /// True body state at IMU clock time, biases of the nearest sample.
  NavState stateAt(double t) const;

  /// One frame; thread-safe.
  SimFrame renderFrame(int index) const;
  /// All frames in order on the calling thread; returning false stops. Visibility is counted on the way.
  void render(const std::function<bool(const SimFrame&)>& take);
  /// The true planes, with the time and area for which the frames rendered so far show them.
  std::vector<TruePlane> planes() const;
  /// Least distance between camera and scene over the motion, and when.
  double leastClearance(double* when) const;

 private:
  double frameTime(int index) const;  ///< trajectory time of the exposure middle
  std::shared_ptr<const AutoExposure> meterExposure() const;
  cv::Mat measuredDepth(int index, double t, const SE3& T_W_D, const FrameBuffers& seen, const cv::Mat& brightness,
                        const Renderer& renderer) const;

  SequenceSpec spec_;
  RenderOptions options_;
  SensorConfig sensor_;
  SplineTrajectory trajectory_;
  ImuLog imu_;
  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<const RayTracer> tracer_;
  std::shared_ptr<const CameraModel> camera_;
  std::unique_ptr<Renderer> renderer_, depth_renderer_;
  std::unique_ptr<PassersBy> passers_;
  std::unique_ptr<SensorEffects> effects_;
  std::unique_ptr<SharedDepthError> shared_error_;
  std::unique_ptr<Multipath> multipath_;
  std::unique_ptr<EdgeFattening> fattening_;
  std::unique_ptr<VisibilityCounter> visibility_;
  int frame_count_ = 0;
};

}  // namespace vip_slam
