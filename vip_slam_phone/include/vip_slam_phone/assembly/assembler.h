// SPDX-License-Identifier: BSD-3-Clause
// Puts images, their cameras, depth and IMU of the phone together: all on our clock, stamped at the middle row's
// mid-exposure, as one camera with one constant K.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_phone/assembly/clock_offset.h"
#include "vip_slam_phone/wire/depth_frame.h"
#include "vip_slam_phone/wire/record.h"

namespace vip_slam::phone {

struct ImuSample {
  double t = 0;
  Eigen::Vector3d gyro, accel;  ///< rad/s, m/s^2, axes of the phone
};
struct ImageOut {
  double t = 0;
  cv::Mat image;  ///< bgr8, or 32FC1 metres
  CameraIntrinsics camera;
};
struct PoseOut {
  double t = 0;
  PoseRecord pose;
};

/// What has become whole, in order of time within each.
struct Assembled {
  std::vector<ImuSample> imu;
  std::vector<ImageOut> color, depth;
  std::vector<PoseOut> pose;
};

struct AssemblyCounts {
  std::size_t imu_lost = 0;  ///< gaps in the sequence of records
  std::size_t dropped = 0;   ///< images that came before the clock and their camera were known, or waited too long
  std::size_t portrait = 0;  ///< images higher than wide
};

class Assembler {
 public:
  /// `width` of the images that come out.
  explicit Assembler(int width) : width_(width) {}

  /// Times `arrival` are ours, s; `unix_time` the phone's.
  void addRecord(const Record& record, double arrival, Assembled* out);
  void addColor(double unix_time, cv::Mat bgr, Assembled* out);
  void addDepth(DepthFrame frame, Assembled* out);
  /// A new connection to the records: the sequence begins anew. A new session has other anchors: `new_session`.
  void reconnected(bool new_session);

  const ClockOffset& clock() const { return clock_; }
  const AssemblyCounts& counts() const { return counts_; }
  /// The one camera that images are made to look like; empty until the first image.
  const std::optional<CameraIntrinsics>& camera() const { return constant_; }
  const std::optional<FormatRecord>& format() const { return format_; }
  /// Ratio of the present focal length to the constant one's.
  double breathing() const { return breathing_; }

 private:
  struct Waiting {
    double unix_time;
    cv::Mat image;
  };
  struct Camera {
    CameraIntrinsics camera;
    double exposure;
  };
  void addImu(double unix_time, const ImuRecord& record, Assembled* out);
  void release(std::deque<Waiting>* waiting, bool depth, Assembled* out);
  const Camera* cameraAt(double unix_time, bool last_resort) const;

  int width_;
  ClockOffset clock_;
  AssemblyCounts counts_;
  std::optional<std::uint16_t> sequence_;
  std::optional<FormatRecord> format_;
  std::map<double, Camera> cameras_;  ///< by the phone's time of their images, the last seconds
  double newest_record_ = 0;          ///< the phone's time
  std::deque<Waiting> color_, depth_;
  double last_color_ = 0, last_depth_ = 0, last_imu_ = 0;        ///< ours; what comes out ascends
  std::deque<std::pair<double, Eigen::Vector3d>> gyro_, accel_;  ///< raw mode: until both are there
  std::optional<CameraIntrinsics> constant_;
  double breathing_ = 1;
};

}  // namespace vip_slam::phone
