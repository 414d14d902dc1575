// SPDX-License-Identifier: BSD-3-Clause
// Converts data-set folders to bags. Each converter reads all tables before it writes, reports file and line of what it
// cannot read (std::runtime_error, one line), and leaves either all of its files or none.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "vip_slam_bringup/stereo/stereo_depth.h"
#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/trajectory/tum_io.h"

namespace vip_slam {

class BagOutput;

struct ConversionReport {
  std::map<std::string, std::size_t> messages;  ///< per topic
  std::vector<std::string> files;               ///< written
  std::vector<std::string> notes;               ///< what was found out, and holds if the user says nothing else
  std::vector<std::string> warnings;
};

struct ConversionOptions {
  std::string folder;  ///< the data set
  std::string bag;     ///< NAME.bag; next to it NAME_sensor.yaml and, with ground truth, NAME_truth.tum
  bool overwrite = false;
  std::function<void(std::size_t, std::size_t)> progress;
};

struct EurocOptions : ConversionOptions {
  bool depth = false;  ///< also write the rectified left image and the stereo depth
  StereoDepthOptions stereo;
};
/// EuRoC MAV folder (with or without the inner mav0): /cam0/image_raw, /cam1/image_raw, /imu0 as in the data set's own
/// bags; with `depth` also the topics of config/sensors/euroc.yaml.
ConversionReport convertEuroc(const EurocOptions& options);

struct TumRgbdOptions : ConversionOptions {
  std::optional<CameraIntrinsics> camera;  ///< else calibration.txt, else from "freiburg1..3" in the folder's name
  std::optional<double> depth_factor;      ///< depth units per metre; else guessed from the images
  /// Of the colour camera, s, as in a sensor file. Nearly all such folders were recorded by structured-light cameras;
  /// this is a Kinect v1's, and what another one differs by the odometry finds.
  double rolling_shutter = 0.025;
  bool no_imu = false;  ///< leave out imu.txt and accelerometer.txt
  SE3 T_imu_cam;        ///< identity unless the folder's imu.txt has other axes
};
/// TUM RGB-D folder: rgb.txt, depth.txt, optional groundtruth.txt, and inertial data from imu.txt (stamp, gyro, accel),
/// else from accelerometer.txt (stamp, accel, in the axes of a Kinect's: -x -y z of its camera; written in the
/// camera's). The sensor file names the streams that there are. Without imu.txt the body is the colour camera.
ConversionReport convertTumRgbd(const TumRgbdOptions& options);

struct StrayOptions : ConversionOptions {
  int width = 640;         ///< colour and depth are resized to this width
  int min_confidence = 1;  ///< depth of lower ARKit confidence (0, 1, 2) is dropped
  int jpeg_quality = 92;
};
/// Stray Scanner recording (iPhone or iPad with LiDAR): rgb.mp4, depth/, confidence/, odometry.csv, imu.csv.
ConversionReport convertStray(const StrayOptions& options);

/// NAME of NAME.bag, with its folder. Throws std::runtime_error when the name does not end in .bag.
std::string bagStem(const std::string& bag);
/// Writes NAME_sensor.yaml, NAME_truth.tum (when not empty) and the bag, and notes them in the report; all or none.
void finishConversion(const ConversionOptions& options, const SensorConfig& sensor, const Trajectory& truth,
                      BagOutput* bag, ConversionReport* report);

}  // namespace vip_slam
