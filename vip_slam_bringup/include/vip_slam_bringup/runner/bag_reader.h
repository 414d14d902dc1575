// SPDX-License-Identifier: BSD-3-Clause
// The bags of a recording as a sequence of decoded sensor data: IMU samples and paired images, in the order they were
// recorded. Reading, decoding and pairing run ahead in their own thread; the output does not depend on its speed.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "vip_slam_bringup/runner/channel.h"
#include "vip_slam_core/imu/imu_types.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_ros/bag_files.h"
#include "vip_slam_ros/image_pairer.h"

namespace vip_slam {

struct GyroSample {
  double t;
  Eigen::Vector3d gyro;
};
struct AccelSample {
  double t;
  Eigen::Vector3d accel;
};
/// Stamps have run back: the following events are not related to those before.
struct TimeJump {
  double seconds;
};
/// The clock of all stamps was set. The events' times go on from before; stamps from time `t` on are later by
/// `seconds`.
struct ClockSet {
  double t, seconds;
};
using SensorEvent = std::variant<ImuSample, GyroSample, AccelSample, ImagePair, TimeJump, ClockSet>;

struct BagReaderOptions {
  double start = 0;      ///< seconds after the first message
  double duration = -1;  ///< seconds; negative: to the end
  InputOptions input;
  std::string extrinsics = "auto";  ///< "tf", "config" (the sensor file), or tf when the bag has it
  double tf_patience = 2.0;         ///< seconds of /tf that are read; /tf_static is used always
};

class BagReader {
 public:
  /// Finds the topics of the sensor; fills `sensor.camera` from camera_info when the sensor file
  /// says so, and `sensor.T_imu_cam` from tf. Throws std::runtime_error naming the file, the missing and the existing
  /// topics, or the frames that tf should connect and does not.
  BagReader(BagSet bags, SensorConfig& sensor, const BagReaderOptions& options = {});
  ~BagReader();
  BagReader(const BagReader&) = delete;
  BagReader& operator=(const BagReader&) = delete;

  /// Starts to read ahead.
  void start();
  /// Stops reading before the end of the bag.
  void stop();
  /// The next event; empty at the end. Unreadable parts of a damaged bag are skipped, with a warning.
  std::optional<SensorEvent> next();

  const BagSet& bags() const;
  double beginTime() const;  ///< seconds, of the part that is read
  double endTime() const;
  /// Where `sensor.T_imu_cam` comes from: "sensor file", or "tf" with the frames that it connects.
  const std::string& extrinsicsSource() const { return extrinsics_source_; }
  /// After the end: counters ("undecodable_images", "images_without_depth", ...), and warnings for the user.
  const std::map<std::string, std::uint64_t>& counters() const { return counters_; }
  const SensorConfig& sensor() const { return sensor_; }
  bool damaged() const { return damaged_; }  ///< after the end: whether parts of the bag could not be read
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  struct Source;
  void read();
  void takeExtrinsics(SensorConfig* sensor);

  std::unique_ptr<Source> source_;
  SensorConfig sensor_;
  const BagReaderOptions options_;
  Channel<SensorEvent> channel_;
  std::atomic<bool> stop_{false};
  bool damaged_ = false;
  std::string extrinsics_source_ = "sensor file";
  std::map<std::string, std::uint64_t> counters_;
  std::vector<std::string> warnings_;
  std::thread thread_;
};

}  // namespace vip_slam
