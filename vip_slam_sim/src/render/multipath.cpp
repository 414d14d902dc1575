// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/render/multipath.h"

#include <algorithm>
#include <cmath>

#include "hemisphere.h"
#include "vip_slam_sim/scene/vec_eigen.h"

namespace vip_slam {
namespace {

constexpr int kNode = 8;              ///< px between the pixels for which light is followed
constexpr int kDirections = 32;       ///< followed from each
constexpr float kStart = 5e-3f;       ///< m; rays start this far off the surface
constexpr double kBeyond = 0.05;      ///< share of the image's width by which the light reaches beyond the image
constexpr float kFarthest = 12.f;     ///< m; no light comes back from farther
constexpr float kSameSurface = 0.1f;  ///< share of the depth by which neighbours that are blended differ at most

}  // namespace

Multipath::Multipath(double reflectance, std::shared_ptr<const Scene> scene, std::shared_ptr<const RayTracer> tracer)
    : reflectance_(reflectance), scene_(std::move(scene)), tracer_(std::move(tracer)) {}

void Multipath::apply(const Renderer& renderer, const FrameBuffers& frame, const SE3& T_W_C, cv::Mat* depth) const {
  if (reflectance_ <= 0) return;
  const std::vector<Vec3> sky = hemisphere(kDirections);
  const Vec3 eye = toVec(T_W_C.t());
  const SE3 T_C_W = T_W_C.inverse();
  const CameraModel& camera = renderer.camera();
  // The lamp beside the lens lights what the camera sees, and hardly more.
  const auto lit = [&](const Vec3& p) {
    Eigen::Vector2d uv;
    return camera.project(T_C_W * toEigen(p), &uv) && camera.inImage(uv, -kBeyond * camera.width());
  };
  const int cols = (frame.depth.cols - 1) / kNode + 2, rows = (frame.depth.rows - 1) / kNode + 2;
  // How much longer, as a share of the distance, at every kNode-th pixel; its depth beside it, 0 where there is none.
  cv::Mat longer = cv::Mat::zeros(rows, cols, CV_32FC2);
  RayBatch rays;
  rays.resize(kDirections);
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < cols; ++x) {
      const int u = std::min(x * kNode, frame.depth.cols - 1), v = std::min(y * kNode, frame.depth.rows - 1);
      const float z = frame.depth.at<float>(v, u);
      const int piece = frame.piece.at<int>(v, u);
      if (z <= 0 || piece < 0) continue;
      const Vec3 p = toVec(T_W_C * Eigen::Vector3d(renderer.ray(u, v) * static_cast<double>(z)));
      const Vec3 to_eye = eye - p;
      const float distance = length(to_eye);
      Vec3 n = scene_->normalOf(piece);
      if (dot(n, to_eye) < 0) n = n * -1.f;
      const float direct = std::max(dot(n, to_eye) / distance, 0.05f) / (distance * distance);
      const Vec3 t = normalised(cross(n, std::abs(n.z) < 0.9f ? Vec3{0, 0, 1} : Vec3{1, 0, 0})), b = cross(n, t);
      const Vec3 from = p + n * kStart;
      for (int k = 0; k < kDirections; ++k) rays.set(k, from, t * sky[k].x + b * sky[k].y + n * sky[k].z, kFarthest);
      tracer_->intersect(&rays, kDirections, 0, false);
      float light = 1, way = 0;
      for (int k = 0; k < kDirections; ++k) {
        if (rays.piece[k] < 0) continue;
        const Vec3 q = from + Vec3{rays.dx[k], rays.dy[k], rays.dz[k]} * rays.t[k];
        const Vec3 q_eye = eye - q;
        const float r = std::max(length(q_eye), 0.2f);
        const Vec3 nq = scene_->normalOf(rays.piece[k]), way_there{rays.dx[k], rays.dy[k], rays.dz[k]};
        const float cosine =
            (dot(nq, way_there) < 0 ? dot(nq, q_eye) : -dot(nq, q_eye)) / r;  // of the side that is seen
        if (cosine <= 0 || !lit(q)) continue;
        const float weight = static_cast<float>(reflectance_) / kDirections * (cosine / (r * r)) / direct;
        light += weight;
        way += weight * 0.5f * (r + rays.t[k] - distance);
      }
      longer.at<cv::Vec2f>(y, x) = {std::max(way, 0.f) / light / distance, z};
    }
  for (int v = 0; v < depth->rows; ++v)
    for (int u = 0; u < depth->cols; ++u) {
      auto& z = depth->at<float>(v, u);
      const float exact = frame.depth.at<float>(v, u);
      if (z <= 0 || frame.piece.at<int>(v, u) < 0) continue;
      const int x = u / kNode, y = v / kNode;
      const float fx = static_cast<float>(u % kNode) / kNode, fy = static_cast<float>(v % kNode) / kNode;
      float sum = 0, weights = 0;
      for (int k = 0; k < 4; ++k) {
        const auto& node = longer.at<cv::Vec2f>(y + k / 2, x + k % 2);
        if (std::abs(node[1] - exact) > kSameSurface * exact) continue;
        const float w = (k % 2 ? fx : 1 - fx) * (k / 2 ? fy : 1 - fy) + 1e-3f;
        sum += w * node[0];
        weights += w;
      }
      if (weights > 0) z *= 1 + sum / weights;
    }
}

}  // namespace vip_slam
