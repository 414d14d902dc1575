// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/render/passers_by.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "vip_slam_sim/scene/procedural.h"
#include "vip_slam_sim/scene/vec_eigen.h"

namespace vip_slam {
namespace {

constexpr float kHalfThickness = 0.14f;  // m
constexpr float kTexelsPerMetre = 400;
constexpr int kTextureSize = 1024;
constexpr float kNear = 0.05f;
constexpr float kLight = 0.75f;  // illumination on them, as the radiance of a white surface

/// A texture made of photographs, so that there are corners at every scale.
cv::Mat pattern(int seed) {
  cv::Mat image(kTextureSize, kTextureSize, CV_32FC3);
  constexpr int kCells = 8, kSide = kTextureSize / kCells;
  for (int i = 0; i < kCells * kCells; ++i) {
    photograph(kSide, kSide, static_cast<std::uint64_t>(1000 * seed + i))
        .copyTo(image(cv::Rect(kSide * (i % kCells), kSide * (i / kCells), kSide, kSide)));
  }
  return image;
}

}  // namespace

struct PassersBy::Body {
  Vec3 foot, aside, towards;  ///< middle on the ground; level axes, `towards` the camera
  float half_width;
  const Texture* clothes;
};

PassersBy::PassersBy(const PasserOptions& options, std::function<SE3(double t)> camera, int seed)
    : options_(options), camera_(std::move(camera)) {
  for (int k = 0; k < options.count; ++k) clothes_.push_back(std::make_unique<Texture>(pattern(seed * 10 + k), true));
}

std::vector<PassersBy::Body> PassersBy::bodies(double t) const {
  std::vector<Body> list;
  for (int k = 0; k < options_.count && t >= options_.start; ++k) {
    const double since = t - options_.start;
    double side = 0, distance = options_.distance, heading_t = t;
    if (options_.way == "across") {
      // On a straight line: its direction is that of the camera at mid-crossing, even if the camera turns.
      const double reach = 0.8 * options_.distance + 0.5 * options_.width;
      const double passing = std::fmod(since + k * options_.interval / options_.count, options_.interval);
      side = -reach + options_.speed * passing;
      if (side > reach) continue;
      heading_t = t - passing + reach / options_.speed;
    } else {
      const double reach = 0.45 * options_.distance, phase = options_.speed / reach * since * (k % 2 ? -1 : 1) + 2 * k;
      side = reach * std::sin(phase);
      distance += 0.25 * options_.distance * std::sin(0.7 * phase);
    }
    Eigen::Vector3d ahead = camera_(heading_t).R().col(2);
    ahead.z() = 0;
    if (ahead.norm() < 0.1) continue;
    ahead.normalize();
    const Eigen::Vector3d right(ahead.y(), -ahead.x(), 0);
    Eigen::Vector3d foot = camera_(t).t() + distance * ahead + side * right;
    foot.z() = 0;
    list.push_back(
        {toVec(foot), toVec(right), toVec(-ahead), static_cast<float>(0.5 * options_.width), clothes_[k].get()});
  }
  return list;
}

void PassersBy::draw(const Renderer& renderer, double t, const std::function<SE3(int row)>& row_pose,
                     FrameBuffers* frame) const {
  const auto height = static_cast<float>(options_.height);
  const auto focal = static_cast<float>(renderer.camera().intrinsics().fx);
  for (const Body& body : bodies(t)) {
    const float ia = 1 / body.half_width, ib = 1 / kHalfThickness;
    for (int v = 0; v < frame->depth.rows; ++v) {
      const SE3 pose = row_pose(v);
      const Vec3 o = toVec(pose.t()) - body.foot;
      const Eigen::Matrix3d R = pose.R();
      const float ox = dot(o, body.aside) * ia, oy = dot(o, body.towards) * ib;
      for (int u = 0; u < frame->depth.cols; ++u) {
        const Vec3 d = toVec(R * renderer.ray(u, v));
        const float dx = dot(d, body.aside) * ia, dy = dot(d, body.towards) * ib;
        const float A = dx * dx + dy * dy, B = ox * dx + oy * dy, C = ox * ox + oy * oy - 1;
        const float root = B * B - A * C;
        if (root <= 0) continue;
        const float z = (-B - std::sqrt(root)) / A;
        float& depth = frame->depth.at<float>(v, u);
        const float up = o.z + z * d.z;
        if (z < kNear || (depth > 0 && depth <= z) || up < 0 || up > height) continue;
        depth = z;
        frame->piece.at<int>(v, u) = -1;
        const float x = ox + z * dx, y = oy + z * dy;  // on the unit circle
        const Vec3 n = normalised(body.aside * (x * ia) + body.towards * (y * ib));
        const float facing = std::abs(dot(n, d)) / length(d);
        frame->grazing.at<float>(v, u) = facing;
        if (frame->radiance.empty()) continue;
        const float step = z / focal * kTexelsPerMetre;
        const Vec4 colour = body.clothes->sample(x * body.half_width * kTexelsPerMetre, -up * kTexelsPerMetre,
                                                 step / std::max(0.15f, facing), 0, 0, step);
        *reinterpret_cast<Vec4*>(frame->radiance.ptr<float>(v) + 4 * u) =
            colour * colour * splat(kLight * (0.6f + 0.4f * facing));
      }
    }
  }
}

}  // namespace vip_slam
