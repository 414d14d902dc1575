// A bag as a sequence of decoded sensor data: IMU samples and paired images, in the order of the bag. Reading, decoding
// and pairing run ahead in a thread of their own; what comes out does not depend on its speed.
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
using SensorEvent = std::variant<ImuSample, GyroSample, AccelSample, ImagePair>;

struct BagReaderOptions {
  double start = 0;      ///< seconds after the first message
  double duration = -1;  ///< seconds; negative: to the end
  PairerOptions pairing;
};

class BagReader {
 public:
  /// Opens the bag and looks for the sensor's topics; fills `sensor.camera` from camera_info when the sensor says so.
  /// Throws std::runtime_error naming the file, the topics that are missing and those that are there.
  BagReader(const std::string& path, SensorConfig& sensor, const BagReaderOptions& options = {});
  ~BagReader();
  BagReader(const BagReader&) = delete;
  BagReader& operator=(const BagReader&) = delete;

  /// Starts to read ahead.
  void start();
  /// The next event; empty at the end. A bag that breaks off in the middle ends there, with a warning.
  std::optional<SensorEvent> next();

  double beginTime() const;  ///< seconds, of the part that is read
  double endTime() const;
  /// After the end: what was counted ("undecodable_images", "images_without_depth", ...), and what a user should know.
  const std::map<std::string, std::uint64_t>& counters() const { return counters_; }
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  struct Source;
  void read();

  std::unique_ptr<Source> source_;
  SensorConfig sensor_;
  const BagReaderOptions options_;
  Channel<SensorEvent> channel_;
  std::atomic<bool> stop_{false};
  std::map<std::string, std::uint64_t> counters_;
  std::vector<std::string> warnings_;
  std::thread thread_;
};

}  // namespace vip_slam
