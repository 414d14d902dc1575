// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/sequence/sequence_renderer.h"

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <map>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "vip_slam_core/util/formatted.h"
#include "vip_slam_sim/motion/motion_generator.h"
#include "vip_slam_sim/render/light_baker.h"

namespace vip_slam {
namespace {

constexpr double kMargin = 0.1;  ///< s of IMU before the first and after the last image

}  // namespace

SequenceRenderer::SequenceRenderer(const SequenceSpec& spec, const RenderOptions& options)
    : spec_(spec),
      options_(options),
      sensor_(spec.sensorConfig()),
      trajectory_(makeMotion(spec.motion, spec.T_imu_cam(), spec.seed)),
      imu_(synthesiseImu(trajectory_, spec.imu, spec.seed, sensor_.gravity)) {
  options_.threads = std::max(1, options_.threads);
  camera_ = makeCamera(spec.trueCamera());
  auto scene = std::make_shared<Scene>(buildScene(spec.scene));
  tracer_ = std::make_shared<RayTracer>(*scene);
  scene_ = scene;
  if (spec.motion.check_collisions) {
    double when = 0;
    const double least = leastClearance(&when);
    if (least < spec.motion.clearance) {
      const Eigen::Vector3d p = (trajectory_.at(when).T_W_I * sensor_.T_imu_cam).t();
      std::ostringstream words;
      words << "sequence '" << spec.name << "': motion: the camera is " << least << " m from the scene at t = " << when
            << " s, (" << p.transpose() << "), expected at least " << spec.motion.clearance
            << " m (motion/clearance; motion/check_collisions: false to allow)";
      throw std::runtime_error(words.str());
    }
  }
  bakeLight(scene.get(), *tracer_, options_.threads, options_.light_spacing_scale);
  renderer_ = std::make_unique<Renderer>(scene_, tracer_, camera_, spec.effects.gloss);
  // Depth that is registered lies where the calibration says that the colour camera sees it.
  if (spec.depthApart())
    depth_renderer_ = std::make_unique<Renderer>(
        scene_, tracer_, makeCamera(spec.depth.registered ? sensor_.camera : sensor_.depth_camera));
  passers_ = std::make_unique<PassersBy>(
      spec.passers,
      [this](double t) { return trajectory_.at(std::clamp(t, 0.0, trajectory_.end())).T_W_I * sensor_.T_imu_cam; },
      spec.seed);
  effects_ = std::make_unique<SensorEffects>(spec.effects, spec.depth, *camera_, spec.seed);
  if (spec.effects.auto_exposure) effects_->setAutoExposure(meterExposure());
  shared_error_ = std::make_unique<SharedDepthError>(spec.depth, spec.seed);
  multipath_ = std::make_unique<Multipath>(spec.depth.multipath, scene_, tracer_);
  fattening_ = std::make_unique<EdgeFattening>(spec.depth.fattening, spec.seed);
  visibility_ = std::make_unique<VisibilityCounter>(scene_);
  const double usable = trajectory_.end() - 2 * kMargin - std::abs(spec.imu.time_offset) - spec.effects.rolling_shutter;
  if (usable <= 0)
    throw std::runtime_error(
        formatted("sequence '%s': motion: takes %.2f s, expected more than %.2f s for a single image",
                  spec.name.c_str(), trajectory_.end(), trajectory_.end() - usable));
  frame_count_ = static_cast<int>(usable * spec.camera.rate) + 1;
}

SequenceRenderer::~SequenceRenderer() = default;

std::shared_ptr<const AutoExposure> SequenceRenderer::meterExposure() const {
  CameraIntrinsics small = sensor_.camera;
  const double shrink = 32.0 / small.width;
  small.width = 32;
  small.height = std::max(2, static_cast<int>(std::lround(small.height * shrink)));
  for (double* k : {&small.fx, &small.fy, &small.cx, &small.cy}) *k *= shrink;
  const Renderer meter(scene_, tracer_, makeCamera(small));
  std::vector<double> brightness;
  FrameBuffers seen;
  for (double t = 0; t <= trajectory_.end(); t += AutoExposure::kStep) {
    meter.render(trajectory_.at(t).T_W_I * sensor_.T_imu_cam, &seen);
    const cv::Scalar mean = cv::mean(cv::min(seen.radiance, 1.0));
    brightness.push_back((mean[0] + mean[1] + mean[2]) / 3);
  }
  return std::make_shared<AutoExposure>(brightness, spec_.effects.exposure, spec_.effects.exposure_time);
}

cv::Mat SequenceRenderer::measuredDepth(int index, double t, const SE3& T_W_D, const FrameBuffers& seen,
                                        const cv::Mat& brightness, const Renderer& renderer) const {
  FrameBuffers measured = seen;
  if (!shared_error_->none() || spec_.depth.multipath > 0 || spec_.depth.fattening > 0) {
    measured.depth = shared_error_->apply(seen, *scene_, t);
    multipath_->apply(renderer, seen, T_W_D, &measured.depth);
    fattening_->apply(t, &measured.depth);
  }
  return effects_->depth(measured, brightness, index);
}

double SequenceRenderer::leastClearance(double* when) const {
  double least = 1e9;
  for (double t = 0; t <= trajectory_.end(); t += 0.05) {
    const Eigen::Vector3f p = (trajectory_.at(t).T_W_I * sensor_.T_imu_cam).t().cast<float>();
    const double c = tracer_->clearance({p.x(), p.y(), p.z()}, 1.0f);
    if (c < least) {
      least = c;
      if (when) *when = t;
    }
  }
  return least;
}

std::int64_t SequenceRenderer::toNanoseconds(double t) const {
  return std::llround(spec_.start_time) * 1000000000LL + std::llround(t * 1e9);
}

double SequenceRenderer::toSeconds(std::int64_t stamp_ns) const {
  return static_cast<double>(stamp_ns - std::llround(spec_.start_time) * 1000000000LL) * 1e-9;
}

double SequenceRenderer::frameTime(int index) const {
  const double t =
      kMargin + 0.5 * std::abs(spec_.imu.time_offset) + 0.5 * spec_.effects.rolling_shutter + index / spec_.camera.rate;
  return std::round(t * 1e9) * 1e-9;  // to the resolution of the stamp
}

NavState SequenceRenderer::stateAt(double t) const {
  const MotionState m = trajectory_.at(t);
  NavState s;
  s.t = t;
  s.T_W_I = m.T_W_I;
  s.v_W = m.v_W;
  const auto k = static_cast<std::size_t>(
      std::clamp(std::llround(t * spec_.imu.rate), 0LL, static_cast<long long>(imu_.biases.size()) - 1));
  s.bias_gyro = imu_.biases[k].gyro;
  s.bias_accel = imu_.biases[k].accel;
  return s;
}

SimFrame SequenceRenderer::renderFrame(int index) const {
  SimFrame f;
  f.index = index;
  const double t = frameTime(index);
  f.stamp_ns = toNanoseconds(t - spec_.imu.time_offset);
  const MotionState m = trajectory_.at(t);
  f.T_W_C = m.T_W_I * sensor_.T_imu_cam;
  const double readout = spec_.effects.rolling_shutter;
  std::function<SE3(int)> row_pose = [&](int) { return f.T_W_C; };
  if (readout > 0) {
    row_pose = [&, rows = static_cast<double>(camera_->height())](int row) {
      return trajectory_.at(t + readout * ((row + 0.5) / rows - 0.5)).T_W_I * sensor_.T_imu_cam;
    };
  }
  renderer_->render(row_pose, readout > 0, &f.exact);
  passers_->draw(*renderer_, t, row_pose, &f.exact);
  if (spec_.effects.motion_blur) {
    CameraTwist twist;
    const Eigen::Quaterniond R_C_I = sensor_.T_imu_cam.rotation().conjugate();
    twist.omega_C = R_C_I * m.omega_I;
    const Eigen::Vector3d v_I = m.T_W_I.rotation().conjugate() * m.v_W + m.omega_I.cross(sensor_.T_imu_cam.t());
    twist.v_C = R_C_I * v_I;
    effects_->motionBlur(twist, t, &f.exact);
  }
  f.rgb = effects_->colour(f.exact, index, t);
  f.depth_stamp_ns = toNanoseconds(t - spec_.imu.time_offset + spec_.depth.lag);
  if (!spec_.depthApart()) {
    f.depth = measuredDepth(index, t, f.T_W_C, f.exact, f.rgb, *renderer_);
  } else if (!spec_.depth.separate()) {
    FrameBuffers own;
    depth_renderer_->renderDepth(row_pose, readout > 0, &own);
    passers_->draw(*depth_renderer_, t, row_pose, &own);
    f.depth = measuredDepth(index, t, f.T_W_C, own, f.rgb, *depth_renderer_);
  } else {
    FrameBuffers own;
    const double t_depth = t + spec_.depth.lag;
    const SE3 T_W_D = trajectory_.at(t_depth).T_W_I * sensor_.T_imu_cam * sensor_.T_color_depth;
    depth_renderer_->renderDepth(T_W_D, &own);
    passers_->draw(
        *depth_renderer_, t_depth, [&](int) { return T_W_D; }, &own);
    // A few milliseconds apart, colour still shows which surfaces are dark.
    const cv::Mat brightness = spec_.depth.registered ? f.rgb : cv::Mat();
    f.depth = measuredDepth(index, t_depth, T_W_D, own, brightness, *depth_renderer_);
  }
  return f;
}

void SequenceRenderer::render(const std::function<bool(const SimFrame&)>& take) {
  const int first = options_.first;
  const int last = options_.count < 0 ? frame_count_ : std::min(frame_count_, first + options_.count);
  const int window = 2 * options_.threads + 2;
  std::mutex mutex;
  std::condition_variable changed;
  std::map<int, SimFrame> done;
  int next_to_render = first, next_to_take = first;
  bool stop = false;
  std::exception_ptr error;
  const auto work = [&] {
    for (;;) {
      int index;
      {
        std::unique_lock<std::mutex> lock(mutex);
        changed.wait(lock, [&] { return stop || next_to_render >= last || next_to_render < next_to_take + window; });
        if (stop || next_to_render >= last) return;
        index = next_to_render++;
      }
      try {
        SimFrame frame = renderFrame(index);
        std::lock_guard<std::mutex> lock(mutex);
        done.emplace(index, std::move(frame));
      } catch (...) {
        std::lock_guard<std::mutex> lock(mutex);
        error = std::current_exception();
        stop = true;
      }
      changed.notify_all();
    }
  };
  std::vector<std::thread> pool;
  for (int i = 0; i < options_.threads; ++i) pool.emplace_back(work);
  const auto finish = [&] {
    {
      std::lock_guard<std::mutex> lock(mutex);
      stop = true;
    }
    changed.notify_all();
    for (std::thread& t : pool) t.join();
    pool.clear();
  };
  try {
    while (next_to_take < last) {
      SimFrame frame;
      {
        std::unique_lock<std::mutex> lock(mutex);
        changed.wait(lock, [&] { return stop || done.count(next_to_take); });
        if (stop) break;
        frame = std::move(done.at(next_to_take));
        done.erase(next_to_take);
        ++next_to_take;
      }
      changed.notify_all();
      visibility_->add(frame.exact, *camera_, frame.T_W_C, 1.0 / spec_.camera.rate, spec_.depth.max_range);
      if (!take(frame)) break;
    }
  } catch (...) {
    finish();
    throw;
  }
  finish();
  if (error) std::rethrow_exception(error);
}

std::vector<TruePlane> SequenceRenderer::planes() const { return truthPlanes(*scene_, *visibility_); }

}  // namespace vip_slam
