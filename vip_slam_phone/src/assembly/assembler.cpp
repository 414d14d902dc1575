// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_phone/assembly/assembler.h"

#include <cmath>

#include "vip_slam_core/camera/constant_camera.h"

namespace vip_slam::phone {
namespace {

constexpr double kSameImage = 0.002;     // s: RTP counts 90000 a second, the clocks are one
constexpr double kWait = 0.25;           // s for an image's own camera
constexpr std::size_t kMaxWaiting = 30;  // images
constexpr std::size_t kMaxCameras = 300;

}  // namespace

void Assembler::reconnected(bool new_session) {
  sequence_.reset();
  if (!new_session) return;
  clock_ = {};
  cameras_.clear();
  color_.clear();
  depth_.clear();
  gyro_.clear();
  accel_.clear();
  newest_record_ = 0;
}

void Assembler::addRecord(const Record& record, double arrival, Assembled* out) {
  if (sequence_) {
    // A snapshot after a connect repeats a number.
    const std::uint16_t step = record.sequence - *sequence_;
    if (step > 1 && step < 0x8000) counts_.imu_lost += step - 1;
  }
  sequence_ = record.sequence;
  if (const auto* imu = std::get_if<ImuRecord>(&record.what)) {
    clock_.add(record.unix_time, arrival);
    addImu(record.unix_time, *imu, out);
  } else if (const auto* intrinsics = std::get_if<IntrinsicsRecord>(&record.what)) {
    cameras_[record.unix_time] = {intrinsics->camera, intrinsics->exposure};
    if (cameras_.size() > kMaxCameras) cameras_.erase(cameras_.begin());
  } else if (const auto* pose = std::get_if<PoseRecord>(&record.what)) {
    if (clock_.ready()) out->pose.push_back({clock_.toLocal(record.unix_time), *pose});
  } else if (const auto* format = std::get_if<FormatRecord>(&record.what)) {
    format_ = *format;
  }
  newest_record_ = std::max(newest_record_, record.unix_time);
  release(&color_, false, out);
  release(&depth_, true, out);
}

void Assembler::addImu(double unix_time, const ImuRecord& record, Assembled* out) {
  const auto emit = [&](double t, const Eigen::Vector3d& gyro, const Eigen::Vector3d& accel) {
    if (!clock_.ready()) return;
    const double local = clock_.toLocal(t);
    if (local <= last_imu_) return;
    last_imu_ = local;
    out->imu.push_back({local, gyro, accel});
  };
  if (record.gyro && record.accel) return emit(unix_time, *record.gyro, *record.accel);
  // Apart: the accelerometer at the gyroscope's stamps.
  if (record.gyro) gyro_.emplace_back(unix_time, *record.gyro);
  if (record.accel) accel_.emplace_back(unix_time, *record.accel);
  while (!gyro_.empty() && accel_.size() >= 2) {
    const double t = gyro_.front().first;
    const auto &a = accel_[0], &b = accel_[1];
    if (t < a.first) {
      gyro_.pop_front();
    } else if (t > b.first) {
      accel_.pop_front();
    } else {
      const double w = b.first > a.first ? (t - a.first) / (b.first - a.first) : 0;
      emit(t, gyro_.front().second, (1 - w) * a.second + w * b.second);
      gyro_.pop_front();
    }
  }
  while (gyro_.size() > 200) gyro_.pop_front();
  while (accel_.size() > 200) accel_.pop_front();
}

void Assembler::addColor(double unix_time, cv::Mat bgr, Assembled* out) {
  if (bgr.rows > bgr.cols) {
    ++counts_.portrait;
    return;
  }
  color_.push_back({unix_time, std::move(bgr)});
  release(&color_, false, out);
}

void Assembler::addDepth(DepthFrame frame, Assembled* out) {
  if (frame.metres.rows > frame.metres.cols) {
    ++counts_.portrait;
    return;
  }
  depth_.push_back({frame.unix_time, std::move(frame.metres)});
  release(&depth_, true, out);
}

const Assembler::Camera* Assembler::cameraAt(double unix_time, bool last_resort) const {
  const auto after = cameras_.lower_bound(unix_time - kSameImage);
  if (after != cameras_.end() && after->first <= unix_time + kSameImage) return &after->second;
  if (!last_resort || cameras_.empty()) return nullptr;
  return after == cameras_.begin() ? &after->second : &std::prev(after)->second;
}

void Assembler::release(std::deque<Waiting>* waiting, bool depth, Assembled* out) {
  while (!waiting->empty()) {
    const double t = waiting->front().unix_time;
    const bool long_enough = newest_record_ > t + kWait || waiting->size() > kMaxWaiting;
    const Camera* own = clock_.ready() ? cameraAt(t, long_enough) : nullptr;
    // Depth is made as large as the colour images, whose camera the first of them settles.
    if (!own || (depth && !constant_)) {
      if (!long_enough) return;
      ++counts_.dropped;
      waiting->pop_front();
      continue;
    }
    const cv::Mat image = std::move(waiting->front().image);
    waiting->pop_front();
    // A camera that is stated for another size of the same image.
    const CameraIntrinsics from = own->camera.scaled(image.cols, image.rows);
    if (!constant_) {
      const int width = std::min(width_, image.cols);
      const int height = static_cast<int>(std::lround(double(width) * image.rows / image.cols));
      constant_ = from.scaled(width, height);
    }
    breathing_ = from.fx * constant_->width / (constant_->fx * image.cols);
    const double readout = format_ ? format_->readout : 0;
    const double stamp = clock_.toLocal(t) - 0.5 * own->exposure + 0.5 * readout;
    double& last = depth ? last_depth_ : last_color_;
    if (stamp <= last) {
      ++counts_.dropped;
      continue;
    }
    last = stamp;
    (depth ? out->depth : out->color)
        .push_back(
            {stamp, depth ? warpDepth(image, from, *constant_) : warpColor(image, from, *constant_), *constant_});
  }
}

}  // namespace vip_slam::phone
