// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/render/renderer.h"

#include <algorithm>
#include <cmath>

#include "vip_slam_sim/rng.h"
#include "vip_slam_sim/scene/vec_eigen.h"

namespace vip_slam {
namespace {

/// Share of a pixel of width f at u that lies in [a, b].
inline float coverage(float u, float f, float a, float b) {
  const float h = 0.5f * f;
  return (std::min(b, u + h) - std::max(a, u - h)) / f;
}

// Sample positions in the pixel: a rotated grid without its centre.
constexpr float kSamples[6][2] = {{-0.417f, -0.083f}, {-0.25f, 0.417f}, {-0.083f, -0.25f},
                                  {0.083f, 0.25f},    {0.25f, -0.417f}, {0.417f, 0.083f}};
constexpr int kSampleCount = 6;

constexpr float kRoughness = 0.01f;    ///< rad; mirrored directions are spread by this
constexpr float kFaintest = 0.004f;    ///< weaker reflections are left out
constexpr float kReflectance = 0.04f;  ///< of a polished surface at right angles (glass, varnish)

}  // namespace

struct Renderer::RowFrame {
  Vec3 o, x, y, z;
  explicit RowFrame(const SE3& T_W_C) {
    const Eigen::Matrix3d R = T_W_C.R();
    o = toVec(T_W_C.t());
    x = toVec(R.col(0));
    y = toVec(R.col(1));
    z = toVec(R.col(2));
  }
  Vec3 direction(float u, float v) const { return x * u + y * v + z; }
};

struct Renderer::Ray {
  Vec3 o, d;         ///< d has z = 1 in the camera, so t is depth
  Vec3 right, down;  ///< change of d per pixel
};

Renderer::Renderer(std::shared_ptr<const Scene> scene, std::shared_ptr<const RayTracer> tracer,
                   std::shared_ptr<const CameraModel> camera, double gloss)
    : scene_(std::move(scene)), tracer_(std::move(tracer)), camera_(std::move(camera)) {
  if (gloss > 0)
    for (std::size_t i = 0; i < scene_->charts.size(); ++i) {
      const double shine = Rng(i * 7717 + 3).uniform();
      gloss_.push_back(static_cast<float>(gloss * shine * shine));  // most surfaces are dull
    }
  const int w = camera_->width(), h = camera_->height();
  for (int v = 0; v < h; ++v)
    for (int u = 0; u < w; ++u) {
      Eigen::Vector2d xy;
      camera_->undistort({double(u), double(v)}, &xy);
      x_.push_back(static_cast<float>(xy.x()));
      y_.push_back(static_cast<float>(xy.y()));
    }
}

/// Light at a point of a piece, at (u, v) of its chart.
Vec4 Renderer::lightOn(int piece, const Vec3& p, float u, float v) const {
  if (const MeshTriangle* t = scene_->triangleOf(piece)) {
    const MeshVertex &a = scene_->vertices[t->vertex[0]], &b = scene_->vertices[t->vertex[1]];
    const MeshVertex& c = scene_->vertices[t->vertex[2]];
    const Vec3 twice = cross(b.p - a.p, c.p - a.p);  // barycentric coordinates by areas
    const float whole = std::max(dot(twice, twice), 1e-20f);
    const float fb = std::clamp(dot(cross(p - a.p, c.p - a.p), twice) / whole, 0.f, 1.f);
    const float fc = std::clamp(dot(cross(b.p - a.p, p - a.p), twice) / whole, 0.f, 1.f);
    return a.light + (b.light - a.light) * splat(fb) + (c.light - a.light) * splat(fc);
  }
  const Chart& c = scene_->charts[scene_->chartOf(piece)];
  const float gu = std::clamp(u / c.su, 0.f, 1.f) * static_cast<float>(c.light_w - 1);
  const float gv = std::clamp(v / c.sv, 0.f, 1.f) * static_cast<float>(c.light_h - 1);
  const int x0 = std::min(static_cast<int>(gu), c.light_w - 2), y0 = std::min(static_cast<int>(gv), c.light_h - 2);
  const Vec4* l = scene_->light.data() + c.light_offset + static_cast<std::ptrdiff_t>(y0) * c.light_w + x0;
  const Vec4 fx = splat(gu - static_cast<float>(x0)), fy = splat(gv - static_cast<float>(y0));
  const Vec4 top = l[0] + (l[1] - l[0]) * fx, bottom = l[c.light_w] + (l[c.light_w + 1] - l[c.light_w]) * fx;
  return top + (bottom - top) * fy;
}

Vec4 Renderer::shade(int piece, float t, const Ray& ray) const {
  const Chart& c = scene_->charts[scene_->chartOf(piece)];
  const Vec3 hit = ray.o + ray.d * t, p = hit - c.o, n = scene_->normalOf(piece);
  const float u = dot(p, c.eu), v = dot(p, c.ev);
  // The pixel's footprint: dp = t (dd - d (n.dd)/(n.d)).
  float nd = dot(n, ray.d);
  if (std::abs(nd) < 1e-3f) nd = nd < 0 ? -1e-3f : 1e-3f;
  const float fr = dot(n, ray.right) / nd, fd = dot(n, ray.down) / nd;
  const float ud = dot(c.eu, ray.d), vd = dot(c.ev, ray.d);
  const float ux = t * (dot(c.eu, ray.right) - ud * fr), vx = t * (dot(c.ev, ray.right) - vd * fr);
  const float uy = t * (dot(c.eu, ray.down) - ud * fd), vy = t * (dot(c.ev, ray.down) - vd * fd);

  Vec4 colour = c.material.tint;
  if (c.material.texture >= 0) {
    const float k = c.material.texels_per_metre;
    colour *=
        scene_->textures[c.material.texture].sample((u + c.tu) * k, -(v + c.tv) * k, ux * k, -vx * k, uy * k, -vy * k);
  }
  float emission = 0;
  if (c.decal_count) {
    const float fu = std::max(std::abs(ux) + std::abs(uy), 1e-6f), fv = std::max(std::abs(vx) + std::abs(vy), 1e-6f);
    for (int i = c.decal_begin; i < c.decal_begin + c.decal_count; ++i) {
      const Decal& d = scene_->decals[i];
      const float au = coverage(u, fu, d.u0, d.u1);
      if (au <= 0) continue;
      const float av = coverage(v, fv, d.v0, d.v1);
      if (av <= 0) continue;
      Vec4 over = d.tint;
      if (d.texture >= 0) {
        const Texture& texture = scene_->textures[d.texture];
        const float ku = static_cast<float>(texture.width()) / (d.u1 - d.u0);
        const float kv = static_cast<float>(texture.height()) / (d.v1 - d.v0);
        over *= texture.sample((u - d.u0) * ku, (d.v1 - v) * kv, ux * ku, -vx * kv, uy * ku, -vy * kv);
      }
      const float a = au * av;
      colour += (over - colour) * splat(a);
      emission += (d.emission - emission) * a;
    }
  }

  return colour * colour * lightOn(piece, hit, u, v) + splat(emission);
}

void Renderer::cast(const std::function<SE3(int)>& row_pose, bool rolling, bool shading, FrameBuffers* out) const {
  const int w = camera_->width(), h = camera_->height();
  if (shading) out->radiance.create(h, w, CV_32FC4);
  out->depth.create(h, w, CV_32FC1);
  out->piece.create(h, w, CV_32SC1);
  out->grazing.create(h, w, CV_32FC1);
  const float step_x = 1.f / static_cast<float>(camera_->intrinsics().fx);
  const float step_y = 1.f / static_cast<float>(camera_->intrinsics().fy);
  std::vector<RowFrame> rows(h, RowFrame(row_pose(h / 2)));
  if (rolling)
    for (int v = 0; v < h; ++v) rows[v] = RowFrame(row_pose(v));

  // Packets are 8 x 2 pixels: two rows at a time, interleaved.
  RayBatch rays;
  rays.resize(static_cast<std::size_t>(2 * w));
  for (int v0 = 0; v0 < h; v0 += 2) {
    const int count = std::min(2, h - v0);
    std::vector<int> pixel;
    pixel.reserve(2 * w);
    for (int u0 = 0; u0 < w; u0 += 8)
      for (int v = v0; v < v0 + count; ++v)
        for (int u = u0; u < std::min(u0 + 8, w); ++u) {
          rays.set(pixel.size(), rows[v].o, rows[v].direction(x_[v * w + u], y_[v * w + u]));
          pixel.push_back(v * w + u);
        }
    tracer_->intersect(&rays, pixel.size(), 0.02f, true);
    for (std::size_t i = 0; i < pixel.size(); ++i) {
      const int at = pixel[i], v = at / w;
      const int piece = rays.piece[i];
      out->piece.at<int>(at / w, at % w) = piece;
      auto& depth = out->depth.at<float>(at / w, at % w);
      auto& grazing = out->grazing.at<float>(at / w, at % w);
      if (piece < 0) {
        depth = grazing = 0;
        if (shading) *reinterpret_cast<Vec4*>(out->radiance.ptr<float>(v) + 4 * (at % w)) = splat(0);
        continue;
      }
      depth = rays.t[i];
      const Vec3 d{rays.dx[i], rays.dy[i], rays.dz[i]};
      grazing = std::abs(dot(d, scene_->normalOf(piece))) / length(d);
      if (!shading) continue;
      const Ray ray{rows[v].o, d, rows[v].x * step_x, rows[v].y * step_y};
      *reinterpret_cast<Vec4*>(out->radiance.ptr<float>(v) + 4 * (at % w)) = shade(piece, rays.t[i], ray);
    }
  }
  if (shading) antialias(rows, out);
  if (shading && !gloss_.empty()) addReflections(rows, out);
}

void Renderer::antialias(const std::vector<RowFrame>& rows, FrameBuffers* out) const {
  const int w = camera_->width(), h = camera_->height();
  const float step_x = 1.f / static_cast<float>(camera_->intrinsics().fx);
  const float step_y = 1.f / static_cast<float>(camera_->intrinsics().fy);
  const auto chart = [&](int v, int u) {
    const int piece = out->piece.at<int>(v, u);
    return piece < 0 ? -1 : scene_->chartOf(piece);
  };
  std::vector<int> edge;
  std::vector<int> above(w, -2), here(w);
  std::vector<char> marked(static_cast<std::size_t>(w) * h, 0);
  for (int v = 0; v < h; ++v) {
    for (int u = 0; u < w; ++u) here[u] = chart(v, u);
    for (int u = 0; u < w; ++u) {
      if (u > 0 && here[u] != here[u - 1]) marked[v * w + u] = marked[v * w + u - 1] = 1;
      if (v > 0 && here[u] != above[u]) marked[v * w + u] = marked[(v - 1) * w + u] = 1;
    }
    std::swap(above, here);
  }
  for (int i = 0; i < w * h; ++i)
    if (marked[i]) edge.push_back(i);

  RayBatch rays;
  rays.resize(kSampleCount * 64);
  for (std::size_t first = 0; first < edge.size(); first += 64) {
    const std::size_t count = std::min<std::size_t>(64, edge.size() - first);
    for (std::size_t k = 0; k < count; ++k) {
      const int at = edge[first + k];
      for (int s = 0; s < kSampleCount; ++s)
        rays.set(k * kSampleCount + s, rows[at / w].o,
                 rows[at / w].direction(x_[at] + kSamples[s][0] * step_x, y_[at] + kSamples[s][1] * step_y));
    }
    tracer_->intersect(&rays, count * kSampleCount, 0.02f, true);
    for (std::size_t k = 0; k < count; ++k) {
      const int at = edge[first + k], v = at / w;
      Vec4 sum = splat(0);
      for (int s = 0; s < kSampleCount; ++s) {
        const std::size_t i = k * kSampleCount + s;
        if (rays.piece[i] < 0) continue;
        sum += shade(rays.piece[i], rays.t[i],
                     {rows[v].o, {rays.dx[i], rays.dy[i], rays.dz[i]}, rows[v].x * step_x, rows[v].y * step_y});
      }
      *reinterpret_cast<Vec4*>(out->radiance.ptr<float>(v) + 4 * (at % w)) = sum * splat(1.f / kSampleCount);
    }
  }
}

void Renderer::addReflections(const std::vector<RowFrame>& rows, FrameBuffers* out) const {
  const int w = camera_->width(), h = camera_->height();
  const float step = 1.f / static_cast<float>(camera_->intrinsics().fx);
  RayBatch rays;
  rays.resize(w);
  std::vector<int> column(w);
  std::vector<float> weight(w);
  for (int v = 0; v < h; ++v) {
    std::size_t count = 0;
    for (int u = 0; u < w; ++u) {
      const int piece = out->piece.at<int>(v, u);
      if (piece < 0) continue;
      const float away = 1 - out->grazing.at<float>(v, u);
      const float fresnel = kReflectance + (1 - kReflectance) * away * away * away * away * away;
      weight[count] = gloss_[scene_->chartOf(piece)] * fresnel;
      if (weight[count] < kFaintest) continue;
      const Vec3 d = rows[v].direction(x_[v * w + u], y_[v * w + u]), n = scene_->normalOf(piece);
      const Vec3 mirrored = d - n * (2 * dot(n, d));
      rays.set(count, rows[v].o + d * out->depth.at<float>(v, u), mirrored);
      column[count++] = u;
    }
    tracer_->intersect(&rays, count, 5e-3f, false);
    for (std::size_t i = 0; i < count; ++i) {
      if (rays.piece[i] < 0) continue;
      const int u = column[i];
      const Vec3 n = scene_->normalOf(out->piece.at<int>(v, u));
      const float t = rays.t[i];
      const float spread = (out->depth.at<float>(v, u) + t) / t * step + kRoughness;
      const auto mirror = [&](const Vec3& a) { return (a - n * (2 * dot(n, a))) * spread; };
      auto* to = reinterpret_cast<Vec4*>(out->radiance.ptr<float>(v) + 4 * u);
      *to += splat(weight[i]) * shade(rays.piece[i], t,
                                      {{rays.ox[i], rays.oy[i], rays.oz[i]},
                                       {rays.dx[i], rays.dy[i], rays.dz[i]},
                                       mirror(rows[v].x),
                                       mirror(rows[v].y)});
    }
  }
}

void Renderer::render(const std::function<SE3(int row)>& row_pose, bool rolling, FrameBuffers* out) const {
  cast(row_pose, rolling, true, out);
}

void Renderer::render(const SE3& T_W_C, FrameBuffers* out) const {
  cast([&](int) { return T_W_C; }, false, true, out);
}

void Renderer::renderDepth(const std::function<SE3(int row)>& row_pose, bool rolling, FrameBuffers* out) const {
  cast(row_pose, rolling, false, out);
}

void Renderer::renderDepth(const SE3& T_W_C, FrameBuffers* out) const {
  cast([&](int) { return T_W_C; }, false, false, out);
}

}  // namespace vip_slam
