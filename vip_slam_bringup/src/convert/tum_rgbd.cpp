// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <filesystem>

#include <rosbag/bag.h>
#include <sensor_msgs/Imu.h>
#include <opencv2/imgcodecs.hpp>

#include "vip_slam_bringup/convert/bag_output.h"
#include "vip_slam_bringup/convert/converters.h"
#include "vip_slam_bringup/convert/image_messages.h"
#include "vip_slam_bringup/convert/text_table.h"
#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_bringup/preflight/recorder.h"
#include "vip_slam_core/depth/depth_factor.h"
#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/size_text.h"

namespace fs = std::filesystem;

namespace vip_slam {
namespace {

const char* const kColor = "/camera/rgb/image_color";
const char* const kColorInfo = "/camera/rgb/camera_info";
const char* const kDepth = "/camera/depth_registered/image_raw";
const char* const kDepthInfo = "/camera/depth_registered/camera_info";
const char* const kImu = "/camera/imu";
const char* const kAccel = "/camera/accel/sample";
const char* const kFrame = "camera_rgb_optical_frame";
// m/s^2/sqrt(Hz): 750 micro-g by the data sheet of the KXSD9, the Kinect's accelerometer, and as much for its 12 bits.
constexpr double kKinectNoise = 1.5e-2;

struct ListedFile {
  double t;
  std::string path;
};

std::vector<ListedFile> readList(const std::string& folder, const std::string& name) {
  const TextTable table(folder + "/" + name, " \t", 2);
  std::vector<ListedFile> files;
  for (const TextRow& row : table.rows()) {
    ListedFile file{table.seconds(row), folder + "/" + row.cells[1]};
    // Some public recordings repeat lines.
    if (!files.empty() && files.back().t == file.t && files.back().path == file.path) continue;
    if (!files.empty()) table.ascending(row, files.back().t, file.t);
    if (!fs::exists(file.path)) table.fail(row, "image " + file.path + " is not there");
    files.push_back(std::move(file));
  }
  return files;
}

CameraIntrinsics freiburg(double fx, double fy, double cx, double cy, std::vector<double> distortion) {
  CameraIntrinsics camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = fx;
  camera.fy = fy;
  camera.cx = cx;
  camera.cy = cy;
  camera.model = distortion.empty() ? DistortionModel::kNone : DistortionModel::kRadTan;
  camera.distortion = std::move(distortion);
  return camera;
}

std::string folderName(const std::string& folder) {
  return fs::absolute(folder + "/.").lexically_normal().parent_path().filename().string();
}

/// The given one, else calibration.txt (fx fy cx cy), else the published calibration of the three Freiburg cameras.
CameraIntrinsics findCamera(const TumRgbdOptions& options, const cv::Size& size) {
  CameraIntrinsics camera;
  const std::string file = options.folder + "/calibration.txt";
  const std::string name = folderName(options.folder);
  if (options.camera) {
    camera = *options.camera;
  } else if (fs::exists(file)) {
    const TextTable table(file, " \t", 4);
    const TextRow& row = table.rows().front();
    camera = freiburg(table.number(row, 0, "fx"), table.number(row, 1, "fy"), table.number(row, 2, "cx"),
                      table.number(row, 3, "cy"), {});
  } else if (name.find("freiburg1") != std::string::npos) {
    camera = freiburg(517.3, 516.5, 318.6, 255.3, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633});
  } else if (name.find("freiburg2") != std::string::npos) {
    camera = freiburg(520.9, 521.0, 325.1, 249.7, {0.2312, -0.7849, -0.0033, -0.0001, 0.9172});
  } else if (name.find("freiburg3") != std::string::npos) {
    camera = freiburg(535.4, 539.2, 320.1, 247.6, {});
  } else {
    throw std::runtime_error(options.folder + ": no calibration: give --camera fx fy cx cy, add calibration.txt, or " +
                             "keep 'freiburg1', 'freiburg2' or 'freiburg3' in the folder's name");
  }
  camera.width = size.width;
  camera.height = size.height;
  const std::string wrong = camera.validate();
  if (!wrong.empty()) throw std::runtime_error(options.folder + ": camera: " + wrong);
  return camera;
}

/// The Kinect's accelerometer is read more often than it measures: a reading that repeats the one before is that one.
bool repeats(const sensor_msgs::Imu& sample, const sensor_msgs::Imu& before) {
  constexpr double kLongest = 0.02;  // s, between measurements; a sensor at rest may read the same again
  const auto &a = sample.linear_acceleration, &b = before.linear_acceleration;
  return a.x == b.x && a.y == b.y && a.z == b.z && (sample.header.stamp - before.header.stamp).toSec() < kLongest;
}

/// Leaves out what was measured long before the first image or after the last.
void keepDuring(const std::vector<ListedFile>& images, std::vector<sensor_msgs::Imu>* samples) {
  constexpr double kAround = 1.0;  // s
  const auto apart = [&](const sensor_msgs::Imu& sample) {
    const double t = sample.header.stamp.toSec();
    return t < images.front().t - kAround || t > images.back().t + kAround;
  };
  samples->erase(std::remove_if(samples->begin(), samples->end(), apart), samples->end());
}

std::vector<sensor_msgs::Imu> readInertial(const std::string& path, bool gyro) {
  const TextTable table(path, " \t,", gyro ? 7 : 4);
  std::vector<sensor_msgs::Imu> samples;
  for (const TextRow& row : table.rows()) {
    sensor_msgs::Imu sample;
    sample.header.stamp.fromSec(table.seconds(row));
    sample.header.frame_id = gyro ? "camera_imu_optical_frame" : kFrame;
    if (!samples.empty()) table.ascending(row, samples.back().header.stamp, sample.header.stamp);
    sample.orientation_covariance[0] = -1;
    const std::size_t accel = gyro ? 4 : 1;
    const double to_camera = gyro ? 1 : -1;  // a Kinect's accelerometer has the axes -x -y z of its camera
    if (gyro) {
      sample.angular_velocity.x = table.number(row, 1, "gyro x");
      sample.angular_velocity.y = table.number(row, 2, "gyro y");
      sample.angular_velocity.z = table.number(row, 3, "gyro z");
    } else {
      sample.angular_velocity_covariance[0] = -1;  // not measured
    }
    sample.linear_acceleration.x = to_camera * table.number(row, accel, "accelerometer x");
    sample.linear_acceleration.y = to_camera * table.number(row, accel + 1, "accelerometer y");
    sample.linear_acceleration.z = table.number(row, accel + 2, "accelerometer z");
    if (!gyro && !samples.empty() && repeats(sample, samples.back())) continue;
    samples.push_back(sample);
  }
  return samples;
}

Trajectory readGroundTruth(const std::string& path, const SE3& T_cam_imu) {
  const TextTable table(path, " \t", 8);
  Trajectory truth;
  for (const TextRow& row : table.rows()) {
    double v[8];
    v[0] = table.seconds(row);
    for (int i = 1; i < 8; ++i) v[i] = table.number(row, i, "column " + std::to_string(i + 1));
    const Eigen::Quaterniond q = table.quaternion(row, v[7], v[4], v[5], v[6]);
    if (!truth.empty() && v[0] <= truth.back().t) continue;  // the public files repeat a few stamps
    truth.push_back({v[0], SE3(q, Eigen::Vector3d(v[1], v[2], v[3])) * T_cam_imu});
  }
  return truth;
}

/// By which of their own stamps the poses fit the images, from the rotation of both; empty when it is not known.
std::string delayOfPoses(const Recorder& images, const Trajectory& truth) {
  std::vector<StampedVector> rates;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const double dt = truth[i].t - truth[i - 1].t;
    const Eigen::Matrix3d turned = truth[i - 1].T_W_B.R().transpose() * truth[i].T_W_B.R();
    rates.push_back({0.5 * (truth[i - 1].t + truth[i].t), logSO3(turned) / dt});
  }
  Recording recording = images.recording();
  recording.gyro_samples = std::move(rates);
  recording.accel_samples.clear();
  const MotionEstimate motion = estimateMotion(recording, recording.rotations);
  if (!motion.usable) return "";
  return formatted(
      "groundtruth.txt: its poses fit the images %+.1f ms after the images' stamps (one sigma %.1f, by their "
      "rotation): evaluate --time-offset %.4f",
      1e3 * motion.time_offset, 1e3 * motion.time_sigma, motion.time_offset);
}

double rateOf(const std::vector<ListedFile>& files) {
  const double seconds = files.back().t - files.front().t;
  return seconds > 0 ? (files.size() - 1) / seconds : 30.0;
}

/// Depth units per metre: as given, else the data set's own for its recordings, else as the images tell.
double depthFactor(const TumRgbdOptions& options, const std::vector<ListedFile>& depth, ConversionReport* report) {
  constexpr std::size_t kLookedAt = 12;
  if (options.depth_factor) return *options.depth_factor;
  if (folderName(options.folder).find("freiburg") != std::string::npos) return 5000;
  std::vector<cv::Mat> images;
  for (std::size_t i = 0; i < depth.size(); i += std::max<std::size_t>(1, depth.size() / kLookedAt)) {
    const cv::Mat image = cv::imread(depth[i].path, cv::IMREAD_UNCHANGED);
    if (image.type() == CV_16UC1) images.push_back(image);  // others are named when they are written
  }
  const DepthFactor guess = guessDepthFactor(images);
  const std::string words = formatted("depth: %g units per metre are guessed: %s (--depth-factor says otherwise)",
                                      guess.units_per_metre, guess.reason.c_str());
  (guess.certain ? report->notes : report->warnings).push_back(words);
  return guess.units_per_metre;
}

}  // namespace

ConversionReport convertTumRgbd(const TumRgbdOptions& options) {
  const auto color = readList(options.folder, "rgb.txt"), depth = readList(options.folder, "depth.txt");
  const cv::Mat first = cv::imread(color.front().path, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  if (first.empty()) throw std::runtime_error(color.front().path + ": is not a readable image");
  const CameraIntrinsics camera = findCamera(options, first.size());
  const auto inertial = [&](const char* name) { return !options.no_imu && fs::exists(options.folder + name); };
  const bool gyro = inertial("/imu.txt"), accel = inertial("/accelerometer.txt");
  std::vector<sensor_msgs::Imu> imu;
  if (gyro || accel) imu = readInertial(options.folder + (gyro ? "/imu.txt" : "/accelerometer.txt"), gyro);
  keepDuring(color, &imu);
  const SE3 T_imu_cam = gyro ? options.T_imu_cam : SE3();
  Trajectory truth;
  if (fs::exists(options.folder + "/groundtruth.txt"))
    truth = readGroundTruth(options.folder + "/groundtruth.txt", T_imu_cam.inverse());

  ConversionReport report;
  const double depth_factor = depthFactor(options, depth, &report);
  BagOutput bag(options.bag, options.overwrite);
  SensorConfig sensor;
  sensor.name = "tum_rgbd";
  sensor.topics.color = kColor;
  sensor.topics.color_info = kColorInfo;
  sensor.topics.depth = kDepth;
  sensor.topics.depth_info = kDepthInfo;
  if (gyro)
    sensor.topics.imu = kImu;
  else if (accel)
    sensor.topics.accel = kAccel;
  sensor.color_encoding = "bgr8";
  sensor.depth_encoding = "16UC1";
  sensor.depth_scale = 1.0 / depth_factor;
  sensor.color_rate = std::round(rateOf(color));
  sensor.depth_rate = std::round(rateOf(depth));
  if (imu.size() > 1) {
    const double seconds = (imu.back().header.stamp - imu.front().header.stamp).toSec();
    if (seconds > 0) sensor.imu_rate = std::round((imu.size() - 1) / seconds);
  }
  if (!gyro) sensor.imu_noise.accel_noise_density = kKinectNoise;
  sensor.rolling_shutter = options.rolling_shutter;
  sensor.camera = camera;
  sensor.T_imu_cam = T_imu_cam;
  sensor.depth_noise = DepthNoise::preset(DepthSensorType::kStructuredLight);
  constexpr double kLookedAt = 60;  // s of images
  Recorder seen(sensor, false, truth.empty() ? -1 : kLookedAt);

  const auto addImages = [&](const std::vector<ListedFile>& files, const std::string& topic, const std::string& info,
                             bool is_color) {
    for (const ListedFile& file : files) {
      const ros::Time stamp(file.t);
      bag.add(stamp, [=, &seen](rosbag::Bag& out) {
        const cv::Mat image =
            cv::imread(file.path, is_color ? cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION : cv::IMREAD_UNCHANGED);
        if (image.empty()) throw std::runtime_error(file.path + ": is not a readable image");
        if (image.type() != (is_color ? CV_8UC3 : CV_16UC1))
          throw std::runtime_error(file.path + ": image is " + cv::typeToString(image.type()) + ", expected " +
                                   (is_color ? "8-bit colour" : "16-bit depth"));
        if (image.cols != camera.width || image.rows != camera.height)
          throw std::runtime_error(file.path + ": image is " + sizeText(image.size()) + ", the first colour image is " +
                                   sizeText({camera.width, camera.height}));
        std_msgs::Header header;
        header.stamp = stamp;
        header.frame_id = kFrame;
        const auto message = imageMessage(image, is_color ? "bgr8" : "16UC1", header);
        out.write(topic, stamp, message);
        seen.add(topic, file.t, message);
        const auto of_camera = cameraInfo(camera, header);
        out.write(info, stamp, of_camera);
        seen.add(info, file.t, of_camera);
      });
    }
    report.messages[topic] = report.messages[info] = files.size();
  };
  addImages(color, kColor, kColorInfo, true);
  addImages(depth, kDepth, kDepthInfo, false);
  for (const auto& sample : imu)
    bag.add(sample.header.stamp,
            [sample, gyro](rosbag::Bag& out) { out.write(gyro ? kImu : kAccel, sample.header.stamp, sample); });
  if (!imu.empty()) report.messages[gyro ? kImu : kAccel] = imu.size();

  finishConversion(options, sensor, truth, &bag, &report);
  seen.finish();
  if (const std::string delay = delayOfPoses(seen, truth); !delay.empty()) report.notes.push_back(delay);
  return report;
}

}  // namespace vip_slam
