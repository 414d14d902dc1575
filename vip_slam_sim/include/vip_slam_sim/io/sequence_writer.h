// SPDX-License-Identifier: BSD-3-Clause
// Output of a rendered sequence: a bag (vip_slam_sim_bag) or a folder.
#pragma once

#include <memory>
#include <string>

#include "vip_slam_sim/sequence/sequence_renderer.h"

namespace vip_slam {

/// Takes IMU samples and frames in time order. Never leaves partial output: commit() moves the complete files into
/// place, a writer destroyed without it removes what it wrote.
class SequenceWriter {
 public:
  virtual ~SequenceWriter() = default;
  /// omega_I: true angular velocity in the body frame, rad/s.
  virtual void imu(std::int64_t stamp_ns, const ImuSample& sample, const NavState& truth,
                   const Eigen::Vector3d& omega_I) = 0;
  virtual void frame(const SimFrame& frame) = 0;
  virtual void commit() = 0;
};

/// A folder in TUM RGB-D's layout (rgb/STAMP.png, depth/STAMP.png with 5000 per metre, rgb.txt, depth.txt,
/// associations.txt, groundtruth.txt of the colour camera) plus IMU and states in EuRoC's format (imu0/data.csv,
/// state_groundtruth_estimate0/data.csv).
std::unique_ptr<SequenceWriter> makeFolderWriter(const std::string& folder);

/// Bag with a RealSense driver's topics, lz4-compressed: colour rgb8, depth 16UC1, both camera_info, IMU, /tf_static,
/// /ground_truth/odometry.
std::unique_ptr<SequenceWriter> makeBagWriter(const std::string& path, const SensorConfig& sensor,
                                              std::int64_t start_ns);

}  // namespace vip_slam
