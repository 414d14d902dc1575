// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/preflight/recorder.h"

#include <algorithm>
#include <cmath>

#include <opencv2/core.hpp>

#include "vip_slam_bringup/preflight/camera_readings.h"
#include "vip_slam_core/depth/depth_image.h"
#include "vip_slam_core/imu/gyro_correction.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/same_pixels.h"
#include "vip_slam_core/util/statistics.h"
#include "vip_slam_ros/camera_info.h"
#include "vip_slam_ros/geometry_conversions.h"
#include "vip_slam_ros/input_options.h"

namespace vip_slam {
namespace {

/// Whether neighbours are far more alike with the two bytes of each value changed over. `unit`: metres.
bool smootherSwapped(const cv::Mat& depth, double unit) {
  double as_is = 0, swapped = 0;
  const auto raw = [&](int v, int u) {
    const float z = depth.at<float>(v, u);
    return z > 0 && std::isfinite(z) ? std::uint16_t(std::min(65535.0, std::round(z / unit))) : std::uint16_t(0);
  };
  const auto swap = [](std::uint16_t x) { return std::uint16_t(x << 8 | x >> 8); };
  for (int v = 0; v < depth.rows; v += 8)
    for (int u = 0; u + 1 < depth.cols; u += 8) {
      const std::uint16_t a = raw(v, u), b = raw(v, u + 1);
      if (a == 0 || b == 0) continue;
      as_is += std::abs(a - b);
      swapped += std::abs(swap(a) - swap(b));
    }
  return swapped < 0.2 * as_is;
}

}  // namespace

Recorder::Recorder(const SensorConfig& sensor, bool live, double image_seconds)
    : image_seconds_(image_seconds),
      time_(kStreams, InputOptions().time_jump,
            {[this](const ClockStep& step) { recording_.clock_steps.push_back(step); },
             [this](double seconds) {
               recording_.restarts.push_back(seconds);
               restarted_by_ += seconds;
             }}),
      rotation_(sensor.mask) {
  recording_.sensor = sensor;
  recording_.live = live;
  if (sensor.intrinsics_from_camera_info) return;
  startRotation(sensor.camera);
  recording_.camera_readings = otherReadings(sensor.camera);
}

void Recorder::startRotation(const CameraIntrinsics& camera) {
  camera_ = makeCamera(camera);
  depth_unit_ = std::make_unique<frontend::DepthUnit>(camera_, recording_.sensor.depth_noise);
  if (!recording_.sensor.depth_registered) return;
  SensorConfig resolved = recording_.sensor;
  resolved.camera = camera;
  to_colour_ = std::make_unique<DepthToColour>(resolved);
  depth_edges_ = std::make_unique<DepthEdges>(camera);
}

void Recorder::take(Stream stream, double arrival, const std_msgs::Header& header, StreamTime::Deliver deliver) {
  StreamRecord& record = recordOf(stream);
  record.frame_id = header.frame_id;
  time_.take(stream, header.stamp.toSec(), arrival, [this, &record, arrival, deliver = std::move(deliver)](double t) {
    record.stamps.push_back(t + restarted_by_);
    record.arrivals.push_back(arrival);
    deliver(t + restarted_by_);
  });
  record.ahead = time_.leftOut(stream).ahead;
}

StreamRecord& Recorder::recordOf(Stream stream) {
  switch (stream) {
    case kColor:
      return recording_.color;
    case kDepth:
      return recording_.depth;
    case kAccel:
      return recording_.accel;
    default:
      return recording_.sensor.topics.imu.empty() ? recording_.gyro : recording_.imu;
  }
}

void Recorder::finish() {
  time_.end();
  recording_.gray_note = gray_.note();
  flushGray(true);
  if (depth_edges_) recording_.depth_edges = depth_edges_->record();
  recording_.edge_shifts = edge_shifts_.record();
}

void Recorder::add(const std::string& topic, double arrival, const sensor_msgs::Image& message,
                   const MessageOwner& owner) {
  addImage(topic, arrival, message, message.encoding, [&] { return gray_(message, owner); });
}

void Recorder::add(const std::string& topic, double arrival, const sensor_msgs::CompressedImage& message) {
  addImage(topic, arrival, message, "compressed (" + message.format + ")", [&] { return gray_(message); });
}

template <class ImageMessage, class Gray>
void Recorder::addImage(const std::string& topic, double arrival, const ImageMessage& message,
                        const std::string& encoding, const Gray& gray) {
  const bool is_color = topic == recording_.sensor.topics.color;
  if (!is_color && topic != recording_.sensor.topics.depth) return;
  StreamRecord& stream = is_color ? recording_.color : recording_.depth;
  if (!stream.one_frame.admits(message.header.frame_id)) return;
  if (first_image_ < 0) first_image_ = arrival;
  cv::Mat image;
  if (arrival - first_image_ <= image_seconds_) {
    try {
      const SensorConfig& sensor = recording_.sensor;
      image = is_color ? gray() : decodeDepth(message, sensor.depth_scale, sensor.depth_offset);
      stream.sizes.emplace(image.cols, image.rows);
    } catch (const std::exception& e) {
      ++stream.unusable;
      stream.unusable_reason = e.what();
    }
  }
  take(is_color ? kColor : kDepth, arrival, message.header, [this, is_color, encoding, image](double t) {
    (is_color ? recording_.color : recording_.depth).encodings.insert(encoding);
    if (image.empty()) return;
    if (is_color)
      addGray(t, image);
    else
      addDepth(t, image);
  });
}

void Recorder::add(const std::string& topic, double arrival, const sensor_msgs::CameraInfo& message) {
  const auto take = [&](StreamRecord* stream, const std::string& image_topic, CameraIntrinsics* camera,
                        std::string* error) {
    if (!stream->one_frame.admits(message.header.frame_id)) return;
    stream->stamps.push_back(message.header.stamp.toSec());
    stream->arrivals.push_back(arrival);
    stream->frame_id = message.header.frame_id;
    if (camera->width > 0) return;  // the first that can be used, as live
    error->clear();
    try {
      *camera = intrinsicsFromCameraInfo(message, image_topic);
      const std::string wrong = camera->validate();
      if (!wrong.empty()) *error = wrong;
    } catch (const std::exception& e) {
      *error = e.what();
    }
    if (!error->empty()) *camera = CameraIntrinsics();
  };
  const SensorTopics& topics = recording_.sensor.topics;
  if (topic == topics.color_info) {
    const bool first_usable = recording_.color_camera.width == 0;
    take(&recording_.color_info, topics.color, &recording_.color_camera, &recording_.color_camera_error);
    if (recording_.color_camera_note.empty()) recording_.color_camera_note = cameraInfoNote(message);
    const double focal = message.K[0];
    if (focal > 0) {
      const bool first = recording_.color_focal_to == 0;
      recording_.color_focal_from = first ? focal : std::min(recording_.color_focal_from, focal);
      recording_.color_focal_to = std::max(recording_.color_focal_to, focal);
    }
    const CameraIntrinsics& found = recording_.color_camera;
    if (first_usable && found.width > 0) {
      const bool used = recording_.sensor.intrinsics_from_camera_info;
      if (used) startRotation(found);
      recording_.camera_readings =
          used ? otherReadings(found, message) : otherReadings(recording_.sensor.camera, found);
    }
  }
  if (topic == topics.depth_info)
    take(&recording_.depth_info, topics.depth, &recording_.depth_camera, &recording_.depth_camera_error);
}

void Recorder::add(const std::string& topic, double arrival, const sensor_msgs::Imu& message) {
  const SensorTopics& topics = recording_.sensor.topics;
  const Eigen::Vector3d w = fromMsg(message.angular_velocity), a = fromMsg(message.linear_acceleration);
  const bool has_gyro = topic == topics.imu || topic == topics.gyro;
  const bool has_accel = topic == topics.imu || topic == topics.accel;
  const Stream stream = has_gyro ? kInertial : kAccel;
  if (!recordOf(stream).one_frame.admits(message.header.frame_id)) return;
  take(stream, arrival, message.header, [this, w, a, has_gyro, has_accel](double t) {
    if (has_gyro) {
      recording_.gyro_range.add(t, w);
      recording_.gyro_samples.push_back({t, correctedRate(w, recording_.sensor.gyro_correction)});
    }
    if (has_accel) recording_.accel_samples.push_back({t, a});
  });
}

void Recorder::add(const tf2_msgs::TFMessage& message) {
  for (const auto& transform : message.transforms) {
    const auto same = [&](const geometry_msgs::TransformStamped& old) {
      return old.child_frame_id == transform.child_frame_id && old.header.frame_id == transform.header.frame_id;
    };
    const auto old = std::find_if(recording_.tf.begin(), recording_.tf.end(), same);
    if (old == recording_.tf.end())
      recording_.tf.push_back(transform);
    else
      *old = transform;
  }
}

void Recorder::addDepth(double t, cv::Mat depth) {
  ++recording_.depth.decoded;
  recording_.depth.repeated += frozen_depth_.repeats(depth) && turns();
  missing_reading_.look(depth);
  if (const float none = missing_reading_.value(); none > 0) {
    recording_.missing_reading = none;
    depth.setTo(0, depth == none);
  }
  if (recording_.depth.stamps.size() % 5 == 1) {
    std::vector<double> values;
    std::size_t all = 0, usable = 0;
    for (int v = 0; v < depth.rows; v += 8)
      for (int u = 0; u < depth.cols; u += 8) {
        ++all;
        const float z = depth.at<float>(v, u);
        if (z > 0 && std::isfinite(z)) values.push_back(z);
        usable += recording_.sensor.depth_noise.inRange(z);
      }
    DepthSample sample;
    sample.valid = double(values.size()) / double(std::max<std::size_t>(all, 1));
    sample.usable = double(usable) / double(std::max<std::size_t>(all, 1));
    if (!values.empty()) {
      const auto [nearest, farthest] = std::minmax_element(values.begin(), values.end());
      sample.spread = *farthest - *nearest;
      sample.median = upperMedian(values);
      const SensorConfig& sensor = recording_.sensor;
      const bool plain = sensor.depth_encoding == "16UC1" && sensor.depth_offset == 0;
      sample.swapped = plain && smootherSwapped(depth, sensor.depth_scale);
    }
    recording_.depths.push_back(sample);
  }
  recent_depth_.push_back({t, depth});
  if (recent_depth_.size() > 12) recent_depth_.erase(recent_depth_.begin());
  flushGray(false);
}

// Images simulated without noise repeat while the camera stands, so repetitions count only while it rotates.
bool Recorder::turns() const {
  constexpr double kTurns = 0.05;  // rad/s
  return !recording_.gyro_samples.empty() && recording_.gyro_samples.back().value.norm() > kTurns;
}

void Recorder::addGray(double t, const cv::Mat& gray) {
  ++recording_.color.decoded;
  if (turns() && samePixels(gray, newest_gray_)) {
    ++recording_.color.repeated;
    return;  // a repetition has no information on the motion at this time
  }
  newest_gray_ = gray;
  if (recording_.color.stamps.size() % 5 == 1) {
    cv::Scalar mean, sigma;
    cv::meanStdDev(gray, mean, sigma);
    recording_.brightness.push_back({mean[0], sigma[0]});
  }
  waiting_gray_.push_back({t, gray});
  flushGray(false);
}

/// A colour image is processed once its depth has arrived, or when others already wait behind it.
void Recorder::flushGray(bool all) {
  while (!waiting_gray_.empty()) {
    const Stamped& gray = waiting_gray_.front();
    const cv::Mat* depth = nullptr;
    for (const Stamped& d : recent_depth_)
      if (std::abs(d.t - gray.t) < 0.02 && d.image.size() == gray.image.size()) depth = &d.image;
    if (!depth && !all && waiting_gray_.size() < 4) return;
    if (camera_ && gray.image.size() == cv::Size(camera_->width(), camera_->height())) {
      constexpr double kEvery = 0.09;  // s
      const bool look = depth && std::abs(gray.t - edges_at_) > kEvery;
      if (look) edges_at_ = gray.t;
      if (look && depth_edges_) depth_edges_->add(gray.image, *depth);
      const cv::Mat aligned = !depth ? cv::Mat() : to_colour_ ? (*to_colour_)(*depth) : *depth;
      if (look && to_colour_) edge_shifts_.add(gray.t, gray.image, aligned);
      addMotion(gray.t, gray.image, aligned);
    }
    waiting_gray_.erase(waiting_gray_.begin());
  }
}

void Recorder::addMotion(double t, const cv::Mat& gray, cv::Mat depth) {
  const auto step = rotation_.add(t, gray);
  if (step) recording_.pixel_steps.push_back(*step);
  const auto seen = step ? seenBy(*camera_, *step) : std::nullopt;
  if (seen) recording_.rotations.push_back(*seen);
  if (seen && seen->T_now_before)
    T_odom_C_ = T_odom_C_ * seen->T_now_before->inverse();
  else
    depth_unit_->forget();
  const double before = depth_unit_->factor();
  if (before != 1 && !depth.empty()) depth = depth * before;
  if (depth_unit_->changes(depth, gray, T_odom_C_, t)) {
    depth = depth * (depth_unit_->factor() / before);
    recording_.depth_unit_changes.push_back({t, before / depth_unit_->factor()});
  }
  depth_unit_->remember(depth, gray, T_odom_C_, t);
  rotation_.setDepth(depth);
}

}  // namespace vip_slam
