// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/render/light_baker.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include "hemisphere.h"

namespace vip_slam {
namespace {

constexpr int kAmbientRays = 64;
constexpr float kAmbientReach = 1.6f;  ///< metres; surfaces nearer than this block ambient light
constexpr float kLampReach = 9.f;      ///< metres; a lamp's light has faded to zero here
constexpr float kOffset = 3e-3f;       ///< metres; rays start this far off the surface
constexpr float kInset = 0.012f;       ///< metres; and this far from its edges, clear of the adjoining wall

class Baker {
 public:
  Baker(const Scene& scene, const RayTracer& tracer) : scene_(scene), tracer_(tracer), sky_(hemisphere(kAmbientRays)) {
    rays_.resize(kAmbientRays);
  }

  Vec4 at(const Vec3& p, const Vec3& n, const Vec3& tangent) {
    const Vec3 t = normalised(tangent - n * dot(tangent, n)), b = cross(n, t);
    const Vec3 from = p + n * kOffset;
    for (int i = 0; i < kAmbientRays; ++i)
      rays_.set(i, from, t * sky_[i].x + b * sky_[i].y + n * sky_[i].z, kAmbientReach);
    tracer_.intersect(&rays_, kAmbientRays, 0, false);
    float open = 0;
    for (int i = 0; i < kAmbientRays; ++i)
      open += rays_.piece[i] < 0 ? 1.f : std::sqrt(std::max(0.f, rays_.t[i] / kAmbientReach));
    return scene_.ambient * splat(open / kAmbientRays) + splat(direct(from, n));
  }

 private:
  float direct(const Vec3& from, const Vec3& n) {
    gains_.clear();
    std::size_t count = 0;
    for (const Lamp& lamp : scene_.lamps) {
      const Vec3 to = lamp.centre - from;
      if (dot(to, to) > kLampReach * kLampReach) continue;
      const float area = 4 * length(lamp.half_u) * length(lamp.half_v);
      for (int k = 0; k < 4; ++k) {
        const Vec3 q =
            lamp.centre + lamp.half_u * (k & 1 ? 0.5f : -0.5f) + lamp.half_v * (k & 2 ? 0.5f : -0.5f) + lamp.n * 2e-3f;
        const Vec3 d = q - from;
        const float r2 = dot(d, d), r = std::sqrt(r2);
        const float c = dot(d, n) / r, cl = -dot(d, lamp.n) / r;
        if (c <= 0 || cl <= 0 || r >= kLampReach) continue;
        const float s = r / kLampReach, fade = (1 - s * s * s * s) * (1 - s * s * s * s);
        gains_.push_back(lamp.power * area * 0.25f * c * cl / (r2 + 0.05f) * fade / 3.1415927f);
        if (rays_.size() <= count) rays_.resize(rays_.size() * 2);
        rays_.set(count++, from, d, 0.999f);
      }
    }
    tracer_.intersect(&rays_, count, 0, false);
    float sum = 0;
    for (std::size_t i = 0; i < count; ++i)
      if (rays_.piece[i] < 0) sum += gains_[i];
    return sum;
  }

  const Scene& scene_;
  const RayTracer& tracer_;
  const std::vector<Vec3> sky_;
  RayBatch rays_;
  std::vector<float> gains_;
};

/// Nodes without surface (openings) take the mean of neighbours that have one; then a light blur against banding.
void completeChart(const Chart& c, std::vector<char> valid, Vec4* light) {
  const int w = c.light_w, h = c.light_h;
  for (int pass = 0; pass < 64; ++pass) {
    std::vector<char> next = valid;
    bool open = false;
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        if (valid[y * w + x]) continue;
        Vec4 sum = splat(0);
        int n = 0;
        for (int k = 0; k < 4; ++k) {
          const int xx = x + (k == 0) - (k == 1), yy = y + (k == 2) - (k == 3);
          if (xx < 0 || yy < 0 || xx >= w || yy >= h || !valid[yy * w + xx]) continue;
          sum += light[yy * w + xx];
          ++n;
        }
        if (n) {
          light[y * w + x] = sum * splat(1.f / static_cast<float>(n));
          next[y * w + x] = 1;
        } else {
          open = true;
        }
      }
    valid = next;
    if (!open) break;
  }
  std::vector<Vec4> copy(light, light + static_cast<std::size_t>(w) * h);
  const float k[3] = {0.25f, 0.5f, 0.25f};
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      Vec4 sum = splat(0);
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
          sum += splat(k[dx + 1] * k[dy + 1]) * copy[std::clamp(y + dy, 0, h - 1) * w + std::clamp(x + dx, 0, w - 1)];
      light[y * w + x] = sum;
    }
}

}  // namespace

void bakeLight(Scene* scene, const RayTracer& tracer, int threads, double spacing_scale) {
  const float spacing = static_cast<float>(scene->light_spacing * spacing_scale);
  std::size_t total = 0;
  for (Chart& c : scene->charts) {
    c.light_w = std::max(2, static_cast<int>(std::ceil(c.su / spacing)) + 1);
    c.light_h = std::max(2, static_cast<int>(std::ceil(c.sv / spacing)) + 1);
    c.light_offset = static_cast<int>(total);
    total += static_cast<std::size_t>(c.light_w) * c.light_h;
  }
  scene->light.assign(total, splat(0));
  std::vector<std::vector<int>> pieces(scene->charts.size());
  for (std::size_t i = 0; i < scene->pieces.size(); ++i) pieces[scene->pieces[i].chart].push_back(static_cast<int>(i));

  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    Baker baker(*scene, tracer);
    for (std::size_t i = next++; i < scene->charts.size(); i = next++) {
      const Chart& c = scene->charts[i];
      Vec4* light = scene->light.data() + c.light_offset;
      std::vector<char> valid(static_cast<std::size_t>(c.light_w) * c.light_h, 0);
      const float inset_u = std::min(kInset, c.su / 4), inset_v = std::min(kInset, c.sv / 4);
      for (int y = 0; y < c.light_h; ++y)
        for (int x = 0; x < c.light_w; ++x) {
          const float u = c.su * static_cast<float>(x) / static_cast<float>(c.light_w - 1);
          const float v = c.sv * static_cast<float>(y) / static_cast<float>(c.light_h - 1);
          bool inside = false;
          for (int p : pieces[i]) {
            const Piece& r = scene->pieces[p];
            inside = inside || (u > r.u0 - 0.01f && u < r.u1 + 0.01f && v > r.v0 - 0.01f && v < r.v1 + 0.01f);
          }
          if (!inside) continue;
          valid[y * c.light_w + x] = 1;
          const float ui = std::clamp(u, inset_u, c.su - inset_u), vi = std::clamp(v, inset_v, c.sv - inset_v);
          const Vec3 p = c.o + c.eu * ui + c.ev * vi;
          const float f = u / c.su;
          light[y * c.light_w + x] = baker.at(p, normalised(c.n0 * (1 - f) + c.n1 * f), c.ev);
        }
      completeChart(c, valid, light);
    }
  };
  std::atomic<std::size_t> next_vertex{0};
  const auto workOnMesh = [&] {
    constexpr std::size_t kBatch = 256;
    Baker baker(*scene, tracer);
    for (std::size_t first = next_vertex.fetch_add(kBatch); first < scene->vertices.size();
         first = next_vertex.fetch_add(kBatch))
      for (std::size_t i = first; i < std::min(first + kBatch, scene->vertices.size()); ++i) {
        MeshVertex& v = scene->vertices[i];
        v.light = baker.at(v.p, v.n, std::abs(v.n.z) < 0.9f ? Vec3{0, 0, 1} : Vec3{1, 0, 0});
      }
  };
  std::vector<std::thread> pool;
  for (int i = 1; i < threads; ++i)
    pool.emplace_back([&] {
      work();
      workOnMesh();
    });
  work();
  workOnMesh();
  for (std::thread& t : pool) t.join();
}

}  // namespace vip_slam
