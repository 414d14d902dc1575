// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/sensor/sensor_config.h"

#include <filesystem>
#include <fstream>
#include <locale>
#include <sstream>
#include <stdexcept>

#include <yaml-cpp/yaml.h>
#include <opencv2/imgcodecs.hpp>

#include "util/text.h"
#include "util/yaml_section.h"
#include "vip_slam_core/util/atomic_file.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr double kMaxDepthShift = 50;  // px; a larger shift cannot be a registration error
constexpr double kMaxGyroCorrection = 0.2;

CameraIntrinsics cameraFrom(Section section) {
  CameraIntrinsics camera;
  std::string model;
  section.get("model", model);
  camera.model = distortionModelFromName(model);
  section.get("width", camera.width);
  section.get("height", camera.height);
  section.get("fx", camera.fx);
  section.get("fy", camera.fy);
  section.get("cx", camera.cx);
  section.get("cy", camera.cy);
  section.get("distortion", camera.distortion, false);
  section.finish();
  return camera;
}

std::string list(const std::vector<float>& numbers) {
  std::string out = "[";
  for (const float number : numbers) {
    // The shortest text that reads back as the same float; std::to_chars of floats needs GCC 11.
    std::string digits;
    double back = 0;
    for (int precision = 6; precision <= 9; ++precision) {
      std::ostringstream text;
      text.imbue(std::locale::classic());
      text.precision(precision);
      text << number;
      digits = text.str();
      if (parseDouble(digits, &back) && static_cast<float>(back) == number) break;
    }
    out += (out.size() > 1 ? ", " : "") + digits;
  }
  return out + "]";
}

std::string text(const Eigen::MatrixXd& M, const char* indent) {
  std::string out;
  for (int r = 0; r < M.rows(); ++r) {
    out += std::string("\n") + indent + "- [";
    for (int c = 0; c < M.cols(); ++c) out += (c ? ", " : "") + formatDouble(M(r, c));
    out += "]";
  }
  return out;
}

void writeCamera(std::ostream& out, const char* key, const CameraIntrinsics& camera) {
  out << key << ":\n  model: " << distortionModelName(camera.model) << "\n  width: " << camera.width
      << "\n  height: " << camera.height << "\n  fx: " << formatDouble(camera.fx)
      << "\n  fy: " << formatDouble(camera.fy) << "\n  cx: " << formatDouble(camera.cx)
      << "\n  cy: " << formatDouble(camera.cy) << "\n  distortion: [";
  for (std::size_t k = 0; k < camera.distortion.size(); ++k)
    out << (k ? ", " : "") << formatDouble(camera.distortion[k]);
  out << "]\n";
}

void writeImu(std::ostream& out, const SensorConfig& config) {
  const ImuNoise& noise = config.imu_noise;
  out << "\nimu:\n  rate: " << formatDouble(config.imu_rate);
  if (config.hasGyro())
    out << "\n  gyro_noise_density: " << formatDouble(noise.gyro_noise_density)
        << "\n  gyro_random_walk: " << formatDouble(noise.gyro_random_walk);
  if (config.hasAccel())
    out << "\n  accel_noise_density: " << formatDouble(noise.accel_noise_density)
        << "\n  accel_random_walk: " << formatDouble(noise.accel_random_walk);
  if (config.hasGyro())
    out << "\n  gyro_correction:" << text(config.gyro_correction, "    ")
        << "\n  gyro_correction_sigma: " << formatDouble(noise.gyro_correction_sigma);
  out << "\n  gravity: " << formatDouble(config.gravity);
}

/// White: 255, black: 0.
cv::Mat loadMask(const std::string& path) {
  if (!std::ifstream(path)) throw std::runtime_error("mask: " + path + " cannot be read");
  const cv::Mat picture = cv::imread(path, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  if (picture.empty()) throw std::runtime_error("mask: " + path + " is no picture, expected PNG");
  const cv::Mat mask = picture > 127;
  if (cv::countNonZero(mask) == 0)
    throw std::runtime_error("mask: " + path + " is black all over; white is what is looked at");
  return mask;
}

void readTopics(Section topics, SensorTopics* config) {
  topics.get("color", config->color);
  topics.get("color_info", config->color_info, false);
  topics.get("depth", config->depth, false);
  topics.get("depth_info", config->depth_info, false);
  const bool said = topics.has("imu") || topics.has("gyro") || topics.has("accel");
  topics.get("imu", config->imu, false);
  topics.get("gyro", config->gyro, false);
  topics.get("accel", config->accel, false);
  topics.finish();
  if (!said)
    throw std::runtime_error(
        "topics/imu: missing, expected the IMU's topic; for a camera without IMU write imu: \"\"; "
        "gyro, accel or both are topics of their own");
  if (!config->imu.empty() && (!config->gyro.empty() || !config->accel.empty()))
    throw std::runtime_error(
        "topics/imu: there are topics/gyro or topics/accel beside it, expected one united topic or the two, not all: "
        "leave out (\"\") those that are not to be read");
}

void readColor(Section color, SensorConfig* config) {
  color.choice("encoding", config->color_encoding,
               {"rgb8", "bgr8", "mono8", "mono16", "rgba8", "bgra8", "yuv422", "compressed"});
  color.number("rate", config->color_rate, 0.1, 1000);
  color.number("rolling_shutter", config->rolling_shutter, 0, 0.1, false);
  color.finish();
}

void readDepth(Section depth, SensorConfig* config) {
  depth.choice("encoding", config->depth_encoding, {"16UC1", "32FC1", "compressed"});
  depth.number("scale", config->depth_scale, 1e-6, 1.0);
  depth.number("offset", config->depth_offset, -0.5, 0.5, false);
  depth.number("delay", config->depth_delay, -0.2, 0.2, false);
  std::vector<double> shift;
  depth.get("shift", shift, false);
  if (!shift.empty() && shift.size() != 2)
    throw std::runtime_error("depth/shift: " + std::to_string(shift.size()) + " numbers, expected two: right and down");
  if (!shift.empty()) config->depth_shift = {shift[0], shift[1]};
  if (!config->depth_shift.allFinite() || config->depth_shift.cwiseAbs().maxCoeff() > kMaxDepthShift)
    throw std::runtime_error(formatted("depth/shift: [%g, %g], expected at most %g pixels", config->depth_shift.x(),
                                       config->depth_shift.y(), kMaxDepthShift));
  std::vector<double> added;
  depth.get("curve", added, false);
  config->depth_curve.added.assign(added.begin(), added.end());
  const std::string bent = validateDepthCurve(config->depth_curve);
  if (!bent.empty()) throw std::runtime_error("depth/curve: " + bent);
  depth.number("rate", config->depth_rate, 0.1, 1000);
  depth.get("registered", config->depth_registered);
  depth.get("undistorted", config->depth_undistorted, false);
  if (config->depth_undistorted && !config->depth_registered)
    throw std::runtime_error(
        "depth/undistorted: is true though depth/registered is false, expected false: depth_camera says how the depth "
        "image is distorted");
  depth.number("rolling_shutter", config->depth_rolling_shutter, 0, 0.1, false);
  depth.finish();
}

/// To be called after topics and depth, which determine the keys required here.
void readCameras(Section* root, SensorConfig* config, std::vector<std::string>* notes) {
  root->get("intrinsics_from_camera_info", config->intrinsics_from_camera_info);
  if (root->has("camera")) config->camera = cameraFrom(root->section("camera"));
  if (root->has("depth_camera")) config->depth_camera = cameraFrom(root->section("depth_camera"));
  root->pose("T_color_depth", config->T_color_depth, notes, !config->depth_registered);
  const bool own_depth = !config->depth_registered && !config->topics.depth.empty();
  if (config->intrinsics_from_camera_info) {
    if (config->topics.color_info.empty())
      throw std::runtime_error("topics/color_info: missing, though intrinsics_from_camera_info is true");
    if (own_depth && config->topics.depth_info.empty())
      throw std::runtime_error(
          "topics/depth_info: missing, though depth/registered is false and intrinsics_from_camera_info is true");
  } else {
    const std::string wrong = config->camera.validate();
    if (!wrong.empty()) throw std::runtime_error("camera: " + wrong);
    const std::string depth_wrong = config->depth_registered ? "" : config->depth_camera.validate();
    if (!depth_wrong.empty()) throw std::runtime_error("depth_camera: " + depth_wrong);
  }
  root->pose("T_imu_cam", config->T_imu_cam, notes, config->topics.hasInertial());
  root->pose("T_base_imu", config->T_base_imu, notes, false);
}

/// To be called after topics: figures of a stream that does not exist may be left out.
void readImu(Section imu, SensorConfig* config) {
  const bool gyro = config->hasGyro(), accel = config->hasAccel();
  imu.number("rate", config->imu_rate, 1, 10000, gyro || accel);
  imu.number("gyro_noise_density", config->imu_noise.gyro_noise_density, 1e-9, 10, gyro);
  imu.number("gyro_random_walk", config->imu_noise.gyro_random_walk, 1e-9, 10, gyro);
  imu.number("accel_noise_density", config->imu_noise.accel_noise_density, 1e-9, 10, accel);
  imu.number("accel_random_walk", config->imu_noise.accel_random_walk, 1e-9, 10, accel);
  imu.matrix("gyro_correction", config->gyro_correction, false);
  for (Eigen::Index k = 0; k < config->gyro_correction.size(); ++k) {
    const double entry = config->gyro_correction.data()[k];
    if (!(std::abs(entry) <= kMaxGyroCorrection))
      throw std::runtime_error(formatted("imu/gyro_correction: has %g, expected numbers from %g to %g", entry,
                                         -kMaxGyroCorrection, kMaxGyroCorrection));
  }
  imu.number("gyro_correction_sigma", config->imu_noise.gyro_correction_sigma, 1e-6, 0.2, false);
  imu.number("gravity", config->gravity, 9.0, 10.5, false);
  imu.finish();
}

void readDepthNoise(Section noise, DepthNoise* config) {
  std::string type;
  noise.get("model", type);
  *config = DepthNoise::preset(depthSensorTypeFromName(type));
  noise.get("a", config->a, false);
  noise.get("b", config->b, false);
  noise.get("c", config->c, false);
  noise.get("min_range", config->min_range, false);
  noise.get("max_range", config->max_range, false);
  noise.get("bias_floor", config->bias_floor, false);
  noise.finish();
  const std::string wrong = config->validate();
  if (!wrong.empty()) throw std::runtime_error("depth_noise: " + wrong);
}

/// `folder`: of the sensor file, where the mask is searched. To be called after the cameras, whose size it must have.
void readMask(Section* root, const std::filesystem::path& folder, SensorConfig* config) {
  root->get("mask", config->mask_file, false);
  if (config->mask_file.empty()) return;
  config->mask_file = std::filesystem::absolute(folder / config->mask_file).lexically_normal().string();
  config->mask = loadMask(config->mask_file);
  const std::string problem = maskProblem(*config, config->camera.width, config->camera.height);
  if (!config->intrinsics_from_camera_info && !problem.empty()) throw std::runtime_error(problem);
}

SensorConfig configFrom(const YAML::Node& node, const std::filesystem::path& folder, std::vector<std::string>* notes) {
  SensorConfig config;
  Section root(node, "");
  root.get("name", config.name);
  readTopics(root.section("topics"), &config.topics);
  readColor(root.section("color"), &config);
  readDepth(root.section("depth"), &config);
  readCameras(&root, &config, notes);
  if (config.topics.hasInertial() || root.has("imu")) readImu(root.section("imu"), &config);
  readDepthNoise(root.section("depth_noise"), &config.depth_noise);
  readMask(&root, folder, &config);
  root.number("time_offset", config.time_offset, -1, 1, false);
  root.finish();
  return config;
}

}  // namespace

std::string maskProblem(const SensorConfig& config, int width, int height) {
  const cv::Mat& mask = config.mask;
  if (mask.empty() || (mask.cols == width && mask.rows == height)) return "";
  return "mask: " + config.mask_file + " is " + std::to_string(mask.cols) + "x" + std::to_string(mask.rows) +
         ", the colour image is " + std::to_string(width) + "x" + std::to_string(height);
}

SensorConfig loadSensorConfig(const std::string& path) {
  std::vector<std::string> unused;
  return loadSensorConfig(path, &unused);
}

SensorConfig loadSensorConfig(const std::string& path, std::vector<std::string>* notes) {
  YAML::Node root;
  try {
    root = YAML::LoadFile(path);
  } catch (const YAML::BadFile&) {
    throw std::runtime_error(path + ": cannot be read");
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(path + ": line " + std::to_string(error.mark.line + 1) + ": " + error.msg);
  }
  try {
    std::vector<std::string> found;
    const SensorConfig config = configFrom(root, std::filesystem::path(path).parent_path(), &found);
    for (const std::string& note : found) notes->push_back(path + ": " + note);
    return config;
  } catch (const std::exception& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

void saveSensorConfig(const std::string& path, const SensorConfig& config) {
  AtomicFile file(path);
  std::ofstream& out = file.stream();
  const SensorTopics& topics = config.topics;
  out << "name: " << config.name << "\ntopics:\n  color: \"" << topics.color << "\"\n  color_info: \""
      << topics.color_info << "\"\n  depth: \"" << topics.depth << "\"\n  depth_info: \"" << topics.depth_info
      << "\"\n  imu: \"" << topics.imu << "\"\n  gyro: \"" << topics.gyro << "\"\n  accel: \"" << topics.accel
      << "\"\ncolor:\n  encoding: " << config.color_encoding << "\n  rate: " << formatDouble(config.color_rate)
      << "\n  rolling_shutter: " << formatDouble(config.rolling_shutter)
      << "\ndepth:\n  encoding: " << config.depth_encoding << "\n  scale: " << formatDouble(config.depth_scale)
      << "\n  offset: " << formatDouble(config.depth_offset) << "\n  delay: " << formatDouble(config.depth_delay)
      << "\n  shift: [" << formatDouble(config.depth_shift.x()) << ", " << formatDouble(config.depth_shift.y())
      << "]\n  curve: " << list(config.depth_curve.added) << "\n  rate: " << formatDouble(config.depth_rate)
      << "\n  registered: " << (config.depth_registered ? "true" : "false")
      << "\n  undistorted: " << (config.depth_undistorted ? "true" : "false")
      << "\n  rolling_shutter: " << formatDouble(config.depth_rolling_shutter)
      << "\nintrinsics_from_camera_info: " << (config.intrinsics_from_camera_info ? "true" : "false") << "\n";
  if (config.camera.width > 0) writeCamera(out, "camera", config.camera);
  if (!config.depth_registered) {
    writeCamera(out, "depth_camera", config.depth_camera);
    out << "T_color_depth:" << text(config.T_color_depth.matrix(), "  ") << "\n";
  }
  out << "T_imu_cam:" << text(config.T_imu_cam.matrix(), "  ")
      << "\nT_base_imu:" << text(config.T_base_imu.matrix(), "  ");
  if (topics.hasInertial()) writeImu(out, config);
  out << "\ndepth_noise:\n  model: " << depthSensorTypeName(config.depth_noise.type)
      << "\n  a: " << formatDouble(config.depth_noise.a) << "\n  b: " << formatDouble(config.depth_noise.b)
      << "\n  c: " << formatDouble(config.depth_noise.c)
      << "\n  min_range: " << formatDouble(config.depth_noise.min_range)
      << "\n  max_range: " << formatDouble(config.depth_noise.max_range)
      << "\n  bias_floor: " << formatDouble(config.depth_noise.bias_floor)
      << "\ntime_offset: " << formatDouble(config.time_offset) << "\n";
  if (!config.mask_file.empty()) out << "mask: \"" << config.mask_file << "\"\n";
  file.commit();
}

}  // namespace vip_slam
