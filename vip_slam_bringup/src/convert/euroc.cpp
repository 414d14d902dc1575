// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <filesystem>
#include <memory>

#include <rosbag/bag.h>
#include <sensor_msgs/Imu.h>
#include <yaml-cpp/yaml.h>
#include <opencv2/imgcodecs.hpp>

#include "vip_slam_bringup/convert/bag_output.h"
#include "vip_slam_bringup/convert/converters.h"
#include "vip_slam_bringup/convert/image_messages.h"
#include "vip_slam_bringup/convert/text_table.h"
#include "vip_slam_core/geometry/rigid_check.h"
#include "vip_slam_core/util/size_text.h"

namespace fs = std::filesystem;

namespace vip_slam {
namespace {

struct StampedFile {
  ros::Time stamp;
  std::string path;
};

ros::Time rosTime(long long nanoseconds) {
  ros::Time stamp;
  stamp.fromNSec(static_cast<std::uint64_t>(nanoseconds));
  return stamp;
}

YAML::Node loadYaml(const std::string& path) {
  try {
    return YAML::LoadFile(path);
  } catch (const YAML::Exception& e) {
    throw std::runtime_error(path + ": cannot be read as YAML: " + e.what());
  }
}

std::vector<double> numbers(const YAML::Node& node, const std::string& path, const std::string& key,
                            std::size_t count) {
  const std::string where = path + ": " + key + ": ", expected = ", expected " + std::to_string(count) + " numbers";
  if (!node) throw std::runtime_error(where + "missing" + expected);
  std::vector<double> values;
  try {
    values = node.as<std::vector<double>>();
  } catch (const YAML::Exception&) {
    throw std::runtime_error(where + "not a list of numbers" + expected);
  }
  if (values.size() != count) throw std::runtime_error(where + std::to_string(values.size()) + " numbers" + expected);
  return values;
}

void readCamera(const std::string& path, CameraIntrinsics* camera, SE3* T_imu_cam) {
  const YAML::Node node = loadYaml(path);
  const auto size = numbers(node["resolution"], path, "resolution", 2);
  const auto k = numbers(node["intrinsics"], path, "intrinsics", 4);
  *camera = CameraIntrinsics();
  camera->width = static_cast<int>(size[0]);
  camera->height = static_cast<int>(size[1]);
  camera->fx = k[0];
  camera->fy = k[1];
  camera->cx = k[2];
  camera->cy = k[3];
  const std::string model = node["distortion_model"].as<std::string>("radial-tangential");
  if (model != "radial-tangential" && model != "equidistant")
    throw std::runtime_error(path + ": distortion_model: '" + model + "', expected radial-tangential or equidistant");
  camera->model = model == "equidistant" ? DistortionModel::kEquidistant : DistortionModel::kRadTan;
  camera->distortion = numbers(node["distortion_coefficients"], path, "distortion_coefficients", 4);
  const YAML::Node pose = node["T_BS"];
  const auto entries = numbers(pose ? pose["data"] : pose, path, "T_BS/data", 16);
  const Eigen::Matrix4d T = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(entries.data());
  const RigidTransform rigid = rigidTransform(T);
  if (!rigid.problem.empty()) throw std::runtime_error(path + ": T_BS/data: not a rigid transform: " + rigid.problem);
  *T_imu_cam = rigid.T;
  const std::string wrong = camera->validate();
  if (!wrong.empty()) throw std::runtime_error(path + ": " + wrong);
}

std::vector<StampedFile> readImages(const std::string& camera_folder) {
  const TextTable table(camera_folder + "/data.csv", ",", 2);
  std::vector<StampedFile> images;
  for (const TextRow& row : table.rows()) {
    StampedFile image{rosTime(table.nanoseconds(row, 0)), camera_folder + "/data/" + row.cells[1]};
    if (!images.empty()) table.ascending(row, images.back().stamp, image.stamp);
    if (!fs::exists(image.path)) table.fail(row, "image " + image.path + " is not there");
    images.push_back(std::move(image));
  }
  return images;
}

std::vector<sensor_msgs::Imu> readImu(const std::string& path) {
  const TextTable table(path, ",", 7);
  std::vector<sensor_msgs::Imu> samples;
  for (const TextRow& row : table.rows()) {
    sensor_msgs::Imu sample;
    sample.header.frame_id = "imu0";
    sample.header.stamp = rosTime(table.nanoseconds(row, 0));
    if (!samples.empty()) table.ascending(row, samples.back().header.stamp, sample.header.stamp);
    sample.orientation_covariance[0] = -1;
    sample.angular_velocity.x = table.number(row, 1, "gyro x");
    sample.angular_velocity.y = table.number(row, 2, "gyro y");
    sample.angular_velocity.z = table.number(row, 3, "gyro z");
    sample.linear_acceleration.x = table.number(row, 4, "accelerometer x");
    sample.linear_acceleration.y = table.number(row, 5, "accelerometer y");
    sample.linear_acceleration.z = table.number(row, 6, "accelerometer z");
    samples.push_back(sample);
  }
  return samples;
}

Trajectory readTruth(const std::string& path) {
  const TextTable table(path, ",", 8);
  Trajectory truth;
  for (const TextRow& row : table.rows()) {
    double v[7];
    for (int i = 0; i < 7; ++i) v[i] = table.number(row, i + 1, "column " + std::to_string(i + 2));
    const Eigen::Quaterniond q = table.quaternion(row, v[3], v[4], v[5], v[6]);
    truth.push_back({1e-9 * static_cast<double>(table.nanoseconds(row, 0)), SE3(q, Eigen::Vector3d(v[0], v[1], v[2]))});
  }
  return truth;
}

cv::Mat readGray(const std::string& path, const CameraIntrinsics& camera) {
  const cv::Mat image = cv::imread(path, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  if (image.empty()) throw std::runtime_error(path + ": is not a readable image");
  if (image.cols != camera.width || image.rows != camera.height)
    throw std::runtime_error(path + ": image is " + sizeText(image.size()) + ", sensor.yaml says " +
                             sizeText({camera.width, camera.height}));
  return image;
}

SensorConfig sensorOf(const StereoDepth& stereo, const std::string& imu_yaml, double image_rate) {
  SensorConfig sensor;
  sensor.name = "euroc";
  sensor.topics.color = "/stereo/rectified/image";
  sensor.topics.color_info = "/stereo/rectified/camera_info";
  sensor.topics.depth = "/stereo/depth/image";
  sensor.topics.depth_info = "/stereo/depth/camera_info";
  sensor.topics.imu = "/imu0";
  sensor.color_encoding = "mono8";
  sensor.depth_encoding = "32FC1";
  sensor.color_rate = sensor.depth_rate = image_rate;
  sensor.imu_rate = 200;
  sensor.camera = stereo.rectified();
  sensor.T_imu_cam = stereo.T_imu_rectified();
  const YAML::Node imu = loadYaml(imu_yaml);
  const auto noise = [&](const char* key) {
    const YAML::Node value = imu[key];
    return numbers(value ? YAML::Load("[" + value.as<std::string>("") + "]") : value, imu_yaml, key, 1)[0];
  };
  sensor.imu_noise.gyro_noise_density = noise("gyroscope_noise_density");
  sensor.imu_noise.gyro_random_walk = noise("gyroscope_random_walk");
  sensor.imu_noise.accel_noise_density = noise("accelerometer_noise_density");
  sensor.imu_noise.accel_random_walk = noise("accelerometer_random_walk");
  // One sigma of half a pixel of disparity: dz = z^2 / (f B) * 0.5.
  sensor.depth_noise = DepthNoise::preset(DepthSensorType::kStereo);
  sensor.depth_noise.c = 0.5 / (stereo.rectified().fx * stereo.baseline());
  return sensor;
}

}  // namespace

ConversionReport convertEuroc(const EurocOptions& options) {
  const std::string root = fs::exists(options.folder + "/mav0") ? options.folder + "/mav0" : options.folder;
  for (const char* needed : {"cam0/data.csv", "cam1/data.csv", "imu0/data.csv"})
    if (!fs::exists(root + "/" + needed))
      throw std::runtime_error(root + "/" + needed +
                               ": is not there; expected a EuRoC folder with mav0/cam0, cam1, imu0");
  const auto left = readImages(root + "/cam0"), right = readImages(root + "/cam1");
  const auto imu = readImu(root + "/imu0/data.csv");
  auto calibration = std::make_shared<StereoCalibration>();
  readCamera(root + "/cam0/sensor.yaml", &calibration->left, &calibration->T_imu_left);
  readCamera(root + "/cam1/sensor.yaml", &calibration->right, &calibration->T_imu_right);
  const auto stereo = std::make_shared<StereoDepth>(*calibration, options.stereo);
  Trajectory truth;
  const std::string truth_csv = root + "/state_groundtruth_estimate0/data.csv";
  if (fs::exists(truth_csv)) truth = readTruth(truth_csv);

  ConversionReport report;
  BagOutput bag(options.bag, options.overwrite);
  const auto addImages = [&](const std::vector<StampedFile>& images, const std::string& name,
                             const CameraIntrinsics& camera) {
    for (const StampedFile& image : images) {
      bag.add(image.stamp, [=](rosbag::Bag& out) {
        std_msgs::Header header;
        header.stamp = image.stamp;
        header.frame_id = name;
        out.write("/" + name + "/image_raw", image.stamp, imageMessage(readGray(image.path, camera), "mono8", header));
      });
    }
    report.messages["/" + name + "/image_raw"] = images.size();
  };
  addImages(left, "cam0", calibration->left);
  addImages(right, "cam1", calibration->right);
  for (const auto& sample : imu)
    bag.add(sample.header.stamp, [sample](rosbag::Bag& out) { out.write("/imu0", sample.header.stamp, sample); });
  report.messages["/imu0"] = imu.size();

  std::size_t unpaired = 0, r = 0;
  for (const StampedFile& image : left) {
    while (r < right.size() && right[r].stamp < image.stamp) ++r;
    if (r == right.size() || right[r].stamp != image.stamp) {
      ++unpaired;
      continue;
    }
    if (!options.depth) continue;
    const StampedFile other = right[r];
    bag.add(image.stamp, [=](rosbag::Bag& out) {
      const auto frame =
          stereo->compute(readGray(image.path, calibration->left), readGray(other.path, calibration->right));
      std_msgs::Header header;
      header.stamp = image.stamp;
      header.frame_id = "cam0_rectified";
      const auto info = cameraInfo(stereo->rectified(), header);
      out.write("/stereo/rectified/image", image.stamp, imageMessage(frame.gray, "mono8", header));
      out.write("/stereo/rectified/camera_info", image.stamp, info);
      out.write("/stereo/depth/image", image.stamp, imageMessage(frame.depth, "32FC1", header));
      out.write("/stereo/depth/camera_info", image.stamp, info);
    });
    for (const char* topic : {"rectified/image", "rectified/camera_info", "depth/image", "depth/camera_info"})
      ++report.messages[std::string("/stereo/") + topic];
  }
  if (unpaired > 0)
    report.warnings.push_back(std::to_string(unpaired) + " images of cam0 have no partner in cam1 and give no depth");
  if (!options.depth)
    report.warnings.push_back("no depth in the bag: play it with stereo:=true, or convert with --depth for run_bag");

  const double seconds = (left.back().stamp - left.front().stamp).toSec();
  const SensorConfig sensor =
      sensorOf(*stereo, root + "/imu0/sensor.yaml", seconds > 0 ? std::round((left.size() - 1) / seconds) : 20.0);
  finishConversion(options, sensor, truth, &bag, &report);
  return report;
}

}  // namespace vip_slam
