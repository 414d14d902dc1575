// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/render/sensor_effects.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_sim/rng.h"

namespace vip_slam {
namespace {

constexpr std::size_t kTable = 1 << 20;
constexpr std::size_t kMargin = 1 << 14;  ///< longest run of deviates read from one random position

}  // namespace

SensorEffects::SensorEffects(const EffectOptions& effects, const DepthOptions& depth, const CameraModel& camera,
                             int seed)
    : effects_(effects),
      depth_(depth),
      camera_(camera),
      steps_(camera.intrinsics().fx * depth.disparity_baseline, depth.disparity_step),
      coarse_(depth.coarse),
      jpeg_(effects.jpeg),
      seed_(static_cast<std::uint64_t>(seed)) {
  Rng rng(seed_ * 31 + 1);
  gauss_.reserve(kTable + kMargin);
  for (std::size_t i = 0; i < kTable + kMargin; ++i) gauss_.push_back(static_cast<float>(rng.gauss()));
  const int w = camera.width(), h = camera.height();
  const double half = 0.25 * (w * w + h * h);
  for (int v = 0; v < h; ++v)
    for (int u = 0; u < w; ++u) {
      const double r2 = (std::pow(u - 0.5 * (w - 1), 2) + std::pow(v - 0.5 * (h - 1), 2)) / half;
      vignette_.push_back(static_cast<float>(1 - effects.vignetting * r2));
    }
}

const float* SensorEffects::noise(std::uint64_t key) const {
  Rng rng(seed_ * 1000003 + key);
  return gauss_.data() + rng.next() % kTable;
}

void SensorEffects::motionBlur(const CameraTwist& twist, double t, FrameBuffers* frame) const {
  const double exposure_time = exposure(t).time;
  if (!effects_.motion_blur || exposure_time <= 0) return;
  const int w = camera_.width(), h = camera_.height();
  const auto& k = camera_.intrinsics();
  cv::Mat out(h, w, CV_32FC4);
  const Eigen::Vector3d& v = twist.v_C;
  const Eigen::Vector3d& o = twist.omega_C;
  for (int y = 0; y < h; ++y) {
    const float* depth = frame->depth.ptr<float>(y);
    auto* to = reinterpret_cast<Vec4*>(out.ptr<float>(y));
    for (int x = 0; x < w; ++x) {
      const double a = (x - k.cx) / k.fx, b = (y - k.cy) / k.fy;
      const double iz = depth[x] > 0 ? 1.0 / depth[x] : 0.0;
      const double dx = (-v.x() + a * v.z()) * iz - o.y() + b * o.z() + a * (a * -o.y() + b * o.x());
      const double dy = (-v.y() + b * v.z()) * iz + o.x() - a * o.z() + b * (b * o.x() - a * o.y());
      const double fx = dx * k.fx * exposure_time, fy = dy * k.fy * exposure_time;
      const int taps = std::min(24, 1 + static_cast<int>(std::hypot(fx, fy)));
      Vec4 sum = splat(0);
      for (int i = 0; i < taps; ++i) {
        const double s = (i + 0.5) / taps - 0.5;
        const double px = std::clamp(x + s * fx, 0.0, w - 1.001), py = std::clamp(y + s * fy, 0.0, h - 1.001);
        const int x0 = static_cast<int>(px), y0 = static_cast<int>(py);
        const auto* r0 = reinterpret_cast<const Vec4*>(frame->radiance.ptr<float>(y0)) + x0;
        const auto* r1 = reinterpret_cast<const Vec4*>(frame->radiance.ptr<float>(y0 + 1)) + x0;
        const Vec4 gx = splat(static_cast<float>(px - x0)), gy = splat(static_cast<float>(py - y0));
        const Vec4 top = r0[0] + (r0[1] - r0[0]) * gx, bottom = r1[0] + (r1[1] - r1[0]) * gx;
        sum += top + (bottom - top) * gy;
      }
      to[x] = sum * splat(1.f / static_cast<float>(taps));
    }
  }
  frame->radiance = out;
}

Exposure SensorEffects::exposure(double t) const {
  const double phase = static_cast<double>(seed_ % 17);
  const double drift = 0.65 * std::sin(2 * M_PI * t / 19.0 + phase) + 0.35 * std::sin(2 * M_PI * t / 7.3 + 2 * phase);
  // The exposure alternates between two levels; the seed selects the first.
  const auto jumps = static_cast<long>(std::floor(t / effects_.exposure_jump_interval)) + static_cast<long>(seed_ % 2);
  const double level = std::pow(effects_.exposure_jump, jumps % 2 == 0 ? 0.5 : -0.5);
  Exposure e{effects_.exposure, 1, effects_.exposure_time};
  if (control_) e = control_->at(t);
  e.gain *= level * (1 + effects_.exposure_drift * drift);
  return e;
}

cv::Mat SensorEffects::colour(const FrameBuffers& frame, int index, double t) const {
  const int w = camera_.width(), h = camera_.height();
  const Exposure exposed = exposure(t);
  const auto gain = static_cast<float>(exposed.gain), more = static_cast<float>(exposed.noise);
  const float read = more * static_cast<float>(effects_.read_noise);
  const float shot = more * static_cast<float>(effects_.shot_noise);
  cv::Mat out(h, w, CV_8UC3);
  std::vector<float> line(4 * static_cast<std::size_t>(w));
  for (int v = 0; v < h; ++v) {
    const float* in = frame.radiance.ptr<float>(v);
    const float* vignette = vignette_.data() + static_cast<std::size_t>(v) * w;
    const float* g = noise(static_cast<std::uint64_t>(index) * 8192 + v);
    for (int i = 0; i < 4 * w; ++i) {
      const float s = std::sqrt(std::min(std::max(in[i] * gain * vignette[i / 4], 0.f), 1.f));
      const float value = s * 255.f + (read + shot * s) * g[i];
      line[i] = std::min(std::max(value, 0.f), 255.f) + 0.5f;
    }
    unsigned char* to = out.ptr<unsigned char>(v);
    for (int u = 0; u < w; ++u)
      for (int c = 0; c < 3; ++c) to[3 * u + c] = static_cast<unsigned char>(line[4 * u + c]);
  }
  jpeg_.apply(&out);
  return out;
}

cv::Mat SensorEffects::depth(const FrameBuffers& frame, const cv::Mat& brightness, int index) const {
  const int w = frame.depth.cols, h = frame.depth.rows;
  cv::Mat out(h, w, CV_16UC1);
  const auto a = static_cast<float>(depth_.a), b = static_cast<float>(depth_.b), c = static_cast<float>(depth_.c);
  const auto near = static_cast<float>(depth_.min_range), far = static_cast<float>(depth_.max_range);
  const bool hard = depth_.dropout > 0 || depth_.edge_hole > 0 || depth_.grazing_limit > 0 || depth_.dark_limit > 0;
  const std::uint64_t key = (static_cast<std::uint64_t>(index) + 1) * 8192 + 4096;
  const auto wiggle = static_cast<float>(depth_.bias_amplitude), white = static_cast<float>(depth_.white);
  for (int v = 0; v < h; ++v) {
    const float* in = frame.depth.ptr<float>(v);
    auto* to = out.ptr<std::uint16_t>(v);
    const float* g = noise(key + v);
    for (int u = 0; u < w; ++u) {
      const float z = in[u];
      const float m = steps_(z + white * (a + (b + c * z) * z) * g[u] + wiggle * std::sin(4.1f * z));
      to[u] = z >= near && z <= far && m > 0 ? static_cast<std::uint16_t>(std::min(m * 1000.f + 0.5f, 65535.f)) : 0;
    }
  }
  if (!hard) {
    coarse_.apply(&out);
    return out;
  }

  // Missing depth: drop-outs in clumps of about 3 px; increasing loss at edges, grazing angles and on dark surfaces.
  Rng rng(seed_ * 77003 + key);
  const int cw = (w + 2) / 3, ch = (h + 2) / 3;
  std::vector<char> lost(static_cast<std::size_t>(cw) * ch);
  for (char& l : lost) l = rng.uniform() < depth_.dropout;
  for (int v = 0; v < h; ++v)
    for (int u = 0; u < w; ++u) {
      auto& mm = out.at<std::uint16_t>(v, u);
      if (mm == 0) continue;
      const float z = frame.depth.at<float>(v, u);
      bool gone = lost[(v / 3) * cw + u / 3] != 0;
      if (depth_.edge_hole > 0) {
        float lo = z, hi = z;
        for (int dv = -1; dv <= 1; ++dv)
          for (int du = -1; du <= 1; ++du) {
            const float q = frame.depth.at<float>(std::clamp(v + dv, 0, h - 1), std::clamp(u + du, 0, w - 1));
            lo = std::min(lo, q);
            hi = std::max(hi, q);
          }
        if (hi - lo > 0.03f * z + 0.02f && rng.uniform() < depth_.edge_hole) {
          if (rng.uniform() < 0.7)
            gone = true;
          else  // a flying pixel between foreground and background
            mm = static_cast<std::uint16_t>(std::min(1000.0 * (lo + rng.uniform() * (hi - lo)), 65535.0));
        }
      }
      const double cosine = frame.grazing.at<float>(v, u);
      if (cosine < depth_.grazing_limit && rng.uniform() > cosine / depth_.grazing_limit) gone = true;
      if (depth_.dark_limit > 0 && !brightness.empty() && brightness.size() == out.size()) {
        const cv::Vec3b p = brightness.at<cv::Vec3b>(v, u);
        const double level = (p[0] + p[1] + p[2]) / 765.0;
        if (level < depth_.dark_limit && rng.uniform() > level / depth_.dark_limit) gone = true;
      }
      if (gone) mm = 0;
    }
  coarse_.apply(&out);
  return out;
}

}  // namespace vip_slam
