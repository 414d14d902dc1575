// SPDX-License-Identifier: BSD-3-Clause
// Stray Scanner layout: rgb.mp4 (1920x1440, one frame per row of odometry.csv), depth/NNNNNN.png (16-bit millimetres,
// 256x192, registered to the colour camera), confidence/NNNNNN.png (0, 1, 2), odometry.csv (stamp, frame, position,
// quaternion xyzw [, fx, fy, cx, cy]), camera_matrix.csv, imu.csv (stamp, accelerometer, gyro). One clock for all.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

#include <rosbag/bag.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Imu.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "vip_slam_bringup/convert/bag_output.h"
#include "vip_slam_bringup/convert/converters.h"
#include "vip_slam_bringup/convert/image_messages.h"
#include "vip_slam_bringup/convert/text_table.h"
#include "vip_slam_core/camera/constant_camera.h"
#include "vip_slam_core/sensor/phone_geometry.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/size_text.h"
#include "vip_slam_core/util/statistics.h"

namespace fs = std::filesystem;

namespace vip_slam {
namespace {

const char* const kColor = "/phone/color/image_raw/compressed";
const char* const kColorInfo = "/phone/color/camera_info";
const char* const kDepth = "/phone/depth/image_raw/compressed";
const char* const kDepthInfo = "/phone/depth/camera_info";
const char* const kImu = "/phone/imu";
const char* const kFrame = "phone_color_optical_frame";

struct Row {
  double t = 0;
  int frame = 0;
  SE3 T_W_C;
  double fx = 0, fy = 0, cx = 0, cy = 0;
};

std::vector<Row> readOdometry(const std::string& folder) {
  const TextTable table(folder + "/odometry.csv", ",", 9);
  double k[4] = {0, 0, 0, 0};
  if (fs::exists(folder + "/camera_matrix.csv")) {
    const TextTable matrix(folder + "/camera_matrix.csv", ",", 3);
    if (matrix.rows().size() < 2) throw std::runtime_error(matrix.path() + ": expected three rows of three numbers");
    k[0] = matrix.number(matrix.rows()[0], 0, "fx");
    k[1] = matrix.number(matrix.rows()[1], 1, "fy");
    k[2] = matrix.number(matrix.rows()[0], 2, "cx");
    k[3] = matrix.number(matrix.rows()[1], 2, "cy");
  }
  std::vector<Row> rows;
  for (const TextRow& text : table.rows()) {
    Row row;
    double v[9];  // the first is the stamp
    for (int i = 1; i < 9; ++i) v[i] = table.number(text, i, "column " + std::to_string(i + 1));
    row.t = table.seconds(text);
    row.frame = static_cast<int>(v[1]);
    row.T_W_C = SE3(table.quaternion(text, v[8], v[5], v[6], v[7]), Eigen::Vector3d(v[2], v[3], v[4]));
    const bool own = text.cells.size() >= 13 && !text.cells[9].empty();
    row.fx = own ? table.number(text, 9, "fx") : k[0];
    row.fy = own ? table.number(text, 10, "fy") : k[1];
    row.cx = own ? table.number(text, 11, "cx") : k[2];
    row.cy = own ? table.number(text, 12, "cy") : k[3];
    if (row.fx <= 0 || row.fy <= 0)
      table.fail(text, "no intrinsics: neither columns fx fy cx cy nor camera_matrix.csv");
    if (!rows.empty()) table.ascending(text, rows.back().t, row.t);
    rows.push_back(row);
  }
  return rows;
}

/// CoreMotion reports minus the specific force, older versions of the app in m/s^2, newer ones in g: distinguished by
/// the median length. IMU axes: x right, y up, z out of the screen, phone upright.
/// Rows that the app wrote out of order are sorted, repeated stamps left out; both are counted.
std::vector<sensor_msgs::Imu> readStrayImu(const std::string& path, ConversionReport* report) {
  const TextTable table(path, ",", 7);
  std::vector<double> length;
  std::vector<sensor_msgs::Imu> samples;
  ros::Time newest;
  std::size_t late = 0;
  for (const TextRow& row : table.rows()) {
    double v[7];  // the first is the stamp
    for (int i = 1; i < 7; ++i) v[i] = table.number(row, i, i < 4 ? "accelerometer" : "gyro");
    sensor_msgs::Imu sample;
    sample.header.stamp.fromSec(table.seconds(row));
    sample.header.frame_id = "phone_imu_frame";
    newest = std::max(newest, sample.header.stamp);
    late += sample.header.stamp < newest;
    sample.orientation_covariance[0] = -1;
    sample.linear_acceleration.x = -v[1];
    sample.linear_acceleration.y = -v[2];
    sample.linear_acceleration.z = -v[3];
    sample.angular_velocity.x = v[4];
    sample.angular_velocity.y = v[5];
    sample.angular_velocity.z = v[6];
    samples.push_back(sample);
    length.push_back(std::sqrt(v[1] * v[1] + v[2] * v[2] + v[3] * v[3]));
  }
  const auto earlier = [](const auto& a, const auto& b) { return a.header.stamp < b.header.stamp; };
  const auto same = [](const auto& a, const auto& b) { return a.header.stamp == b.header.stamp; };
  std::stable_sort(samples.begin(), samples.end(), earlier);
  const std::size_t all = samples.size();
  samples.erase(std::unique(samples.begin(), samples.end(), same), samples.end());
  if (late > 0)
    report->warnings.push_back(formatted("%s: %zu of %zu rows come late and are sorted", path.c_str(), late, all));
  if (samples.size() < all)
    report->warnings.push_back(
        formatted("%s: %zu of %zu rows repeat a stamp and are left out", path.c_str(), all - samples.size(), all));
  const double median = upperMedian(std::move(length));
  if (median < 0.5 || (median > 2.0 && (median < 8.0 || median > 12.0)))
    throw std::runtime_error(path + ": median acceleration is " + std::to_string(median) +
                             ", expected about 1 (g) or about 9.81 (m/s^2)");
  if (median <= 2.0) {
    for (auto& sample : samples) {
      sample.linear_acceleration.x *= 9.81;
      sample.linear_acceleration.y *= 9.81;
      sample.linear_acceleration.z *= 9.81;
    }
  }
  return samples;
}

struct VideoFacts {
  int frames = 0;
  cv::Size size;
  int rotate_flag = 0;  ///< degrees by which a player is told to turn the picture
};

// cv::CAP_PROP_ORIENTATION_META and _AUTO, which OpenCV has since 4.5; before, it neither knew the flag nor turned.
constexpr int kOrientationMeta = 48, kOrientationAuto = 49;

/// Pictures come as they are stored, as the depth images are, whatever turn the file tells a player.
cv::VideoCapture openVideo(const std::string& path) {
  cv::VideoCapture video(path);
  if (!video.isOpened()) throw std::runtime_error(path + ": is not a readable video");
  video.set(kOrientationAuto, 0);
  return video;
}

VideoFacts factsOf(const std::string& path) {
  cv::VideoCapture video = openVideo(path);
  VideoFacts facts;
  facts.rotate_flag = static_cast<int>(std::lround(video.get(kOrientationMeta)));
  cv::Mat frame;
  if (!video.read(frame)) throw std::runtime_error(path + ": is a video without a picture");
  facts.size = frame.size();
  for (facts.frames = 1; video.grab(); ++facts.frames) continue;
  return facts;
}

/// Throws unless the video has the shape of the depth images and the size that the intrinsics are for.
void checkShape(const std::string& path, const cv::Size& video, const cv::Size& depth, const Row& row) {
  constexpr double kShape = 0.02;   // of the ratio of width to height
  constexpr double kCentre = 0.15;  // of the size, from the middle to the principal point
  const double shape = double(video.width) / video.height, depth_shape = double(depth.width) / depth.height;
  if (std::abs(shape / depth_shape - 1) > kShape)
    throw std::runtime_error(path + ": pictures of " + sizeText(video) +
                             " have another shape than the depth images of " + sizeText(depth) +
                             ": turned or cropped? Expected the app's own file");
  const double x = (row.cx + 0.5) / video.width, y = (row.cy + 0.5) / video.height;
  if (std::abs(x - 0.5) < kCentre && std::abs(y - 0.5) < kCentre) return;
  throw std::runtime_error(
      path + formatted(": pictures of %s, but the intrinsics (principal point %.0f, %.0f) are for pictures of about "
                       "%.0fx%.0f: resized by hand? Expected the app's own file",
                       sizeText(video).c_str(), row.cx, row.cy, 2 * row.cx + 1, 2 * row.cy + 1));
}

std::string numbered(const std::string& folder, int frame) { return folder + formatted("/%06d.png", frame); }

cv::Mat readDepth(const std::string& folder, int frame, int min_confidence) {
  const std::string path = numbered(folder + "/depth", frame);
  cv::Mat depth = cv::imread(path, cv::IMREAD_UNCHANGED);
  if (depth.empty()) throw std::runtime_error(path + ": is not a readable image");
  if (depth.type() != CV_16UC1) throw std::runtime_error(path + ": expected a 16-bit depth image");
  const std::string confidence_path = numbered(folder + "/confidence", frame);
  if (min_confidence > 0 && fs::exists(confidence_path)) {
    const cv::Mat confidence = cv::imread(confidence_path, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
    if (confidence.size() != depth.size())
      throw std::runtime_error(confidence_path + ": size differs from the depth image");
    depth.setTo(0, confidence < min_confidence);
  }
  return depth;
}

CameraIntrinsics cameraOf(const Row& row, const cv::Size& size) {
  CameraIntrinsics camera;
  camera.width = size.width;
  camera.height = size.height;
  camera.fx = row.fx;
  camera.fy = row.fy;
  camera.cx = row.cx;
  camera.cy = row.cy;
  return camera;
}

/// The one camera that all images are made to look like: the longest focal length, so that each of them fills it.
CameraIntrinsics constantCamera(const std::vector<Row>& rows, const cv::Size& video, const cv::Size& size) {
  const auto shorter = [](const Row& a, const Row& b) { return a.fx < b.fx; };
  return cameraOf(*std::max_element(rows.begin(), rows.end(), shorter), video).scaled(size.width, size.height);
}

sensor_msgs::CompressedImage compressed(const cv::Mat& image, const char* ending, const char* format,
                                        const std::vector<int>& parameters, const std_msgs::Header& header) {
  sensor_msgs::CompressedImage message;
  message.header = header;
  message.format = format;
  cv::imencode(ending, image, message.data, parameters);
  return message;
}

}  // namespace

ConversionReport convertStray(const StrayOptions& options) {
  for (const char* needed : {"rgb.mp4", "odometry.csv", "imu.csv"})
    if (!fs::exists(options.folder + "/" + needed))
      throw std::runtime_error(options.folder + "/" + needed + ": is not there; expected a Stray Scanner recording");
  ConversionReport report;
  std::vector<Row> rows = readOdometry(options.folder);
  const auto imu = readStrayImu(options.folder + "/imu.csv", &report);
  const VideoFacts facts = factsOf(options.folder + "/rgb.mp4");
  const int frames = facts.frames;
  const cv::Size video_size = facts.size;
  if (facts.rotate_flag % 360 != 0)
    report.warnings.push_back(
        formatted("rgb.mp4 tells players to turn it by %d degrees: its pictures are taken as they "
                  "are stored, as depth and intrinsics are for",
                  facts.rotate_flag));
  // The app's edit list hides the first frames from most decoders: then the video's frames belong to the last rows.
  std::size_t skip = 0;
  if (frames < static_cast<int>(rows.size())) {
    skip = rows.size() - frames;
    if (skip > 2)
      throw std::runtime_error(options.folder + "/rgb.mp4: " + std::to_string(frames) + " frames for " +
                               std::to_string(rows.size()) + " rows of odometry.csv");
    report.warnings.push_back("rgb.mp4 has " + std::to_string(skip) +
                              " frame(s) less than odometry.csv: the first rows get none");
  }
  rows.erase(rows.begin(), rows.begin() + skip);
  const cv::Size size(options.width,
                      static_cast<int>(std::lround(double(options.width) * video_size.height / video_size.width)));
  std::vector<int> without_depth;
  for (const Row& row : rows)
    if (!fs::exists(numbered(options.folder + "/depth", row.frame))) without_depth.push_back(row.frame);
  if (without_depth.size() == rows.size())
    throw std::runtime_error(options.folder + "/depth: no NNNNNN.png for any row");
  if (!without_depth.empty()) report.warnings.push_back(std::to_string(without_depth.size()) + " images have no depth");

  const auto with_depth = std::find_if(rows.begin(), rows.end(), [&](const Row& row) {
    return !std::binary_search(without_depth.begin(), without_depth.end(), row.frame);
  });
  checkShape(options.folder + "/rgb.mp4", video_size, readDepth(options.folder, with_depth->frame, 0).size(),
             *with_depth);
  const CameraIntrinsics constant = constantCamera(rows, video_size, size);
  const SE3 T_imu_cam = phoneCameraInImu();
  const SE3 T_zup_yup = arkitWorldZUp();
  Trajectory truth;
  auto video = std::make_shared<cv::VideoCapture>(openVideo(options.folder + "/rgb.mp4"));
  BagOutput bag(options.bag, options.overwrite);
  for (const Row& row : rows) {
    truth.push_back({row.t, T_zup_yup * row.T_W_C * T_imu_cam.inverse()});
    const bool has_depth = !std::binary_search(without_depth.begin(), without_depth.end(), row.frame);
    const ros::Time stamp(row.t);
    bag.add(stamp, [=](rosbag::Bag& out) {
      cv::Mat frame;
      if (!video->read(frame))
        throw std::runtime_error(options.folder + "/rgb.mp4: ends before frame " + std::to_string(row.frame));
      const CameraIntrinsics own = cameraOf(row, video_size);
      const cv::Mat image = warpColor(frame, own, constant);
      std_msgs::Header header;
      header.stamp = stamp;
      header.frame_id = kFrame;
      const auto info = cameraInfo(constant, header);
      out.write(kColor, stamp,
                compressed(image, ".jpg", "bgr8; jpeg compressed bgr8",
                           {cv::IMWRITE_JPEG_QUALITY, options.jpeg_quality}, header));
      out.write(kColorInfo, stamp, info);
      if (!has_depth) return;
      const cv::Mat read = readDepth(options.folder, row.frame, options.min_confidence);
      const cv::Mat depth = warpDepth(read, own.scaled(read.cols, read.rows), constant);
      out.write(kDepth, stamp,
                compressed(depth, ".png", "16UC1; png compressed ", {cv::IMWRITE_PNG_COMPRESSION, 3}, header));
      out.write(kDepthInfo, stamp, info);
    });
  }
  report.messages[kColor] = report.messages[kColorInfo] = rows.size();
  report.messages[kDepth] = report.messages[kDepthInfo] = rows.size() - without_depth.size();
  for (const auto& sample : imu)
    bag.add(sample.header.stamp, [sample](rosbag::Bag& out) { out.write(kImu, sample.header.stamp, sample); });
  report.messages[kImu] = imu.size();

  SensorConfig sensor;
  sensor.name = "phone";
  sensor.topics.color = kColor;
  sensor.topics.color_info = kColorInfo;
  sensor.topics.depth = kDepth;
  sensor.topics.depth_info = kDepthInfo;
  sensor.topics.imu = kImu;
  sensor.color_encoding = sensor.depth_encoding = "compressed";
  const double seconds = rows.back().t - rows.front().t;
  sensor.color_rate = sensor.depth_rate = seconds > 0 ? std::round((rows.size() - 1) / seconds) : 30;
  const double imu_seconds = (imu.back().header.stamp - imu.front().header.stamp).toSec();
  sensor.imu_rate = imu_seconds > 0 ? std::round((imu.size() - 1) / imu_seconds) : 100;
  sensor.T_imu_cam = T_imu_cam;
  sensor.imu_noise = {2e-3, 2e-5, 2e-2, 3e-4};
  sensor.depth_noise = DepthNoise::preset(DepthSensorType::kTof);
  sensor.depth_noise.max_range = 5.0;
  finishConversion(options, sensor, truth, &bag, &report);
  return report;
}

}  // namespace vip_slam
