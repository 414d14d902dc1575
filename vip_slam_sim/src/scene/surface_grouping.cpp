// SPDX-License-Identifier: BSD-3-Clause
#include "surface_grouping.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace vip_slam {
namespace {

constexpr float kTouch = 2e-3f;  ///< metres; pieces no further apart count as touching

struct Rect {
  float u0, v0, u1, v1;
};

/// The piece in the frame of chart `f`; false when their axes are not parallel.
bool inFrame(const Scene& scene, const Piece& piece, const Chart& f, Rect* out) {
  const Chart& c = scene.charts[piece.chart];
  const float cuu = dot(c.eu, f.eu), cuv = dot(c.eu, f.ev);
  const bool parallel = std::abs(cuu) > 0.9999f || std::abs(cuv) > 0.9999f;
  if (!parallel) return false;
  const Vec3 p = c.o + c.eu * piece.u0 + c.ev * piece.v0 - f.o, q = c.o + c.eu * piece.u1 + c.ev * piece.v1 - f.o;
  const float a = dot(p, f.eu), b = dot(q, f.eu), d = dot(p, f.ev), e = dot(q, f.ev);
  *out = {std::min(a, b), std::min(d, e), std::max(a, b), std::max(d, e)};
  return true;
}

/// Shares an edge of positive length, or overlaps.
bool touch(const Rect& a, const Rect& b) {
  const float ou = std::min(a.u1, b.u1) - std::max(a.u0, b.u0), ov = std::min(a.v1, b.v1) - std::max(a.v0, b.v0);
  return ou > -kTouch && ov > -kTouch && (ou > kTouch || ov > kTouch);
}

int root(std::vector<int>& parent, int i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

}  // namespace

void groupSurfaces(Scene* scene) {
  // Sort by the plane's offset n . o, so that each piece is compared only with pieces within 1 mm of its plane.
  std::vector<int> planar;
  for (std::size_t i = 0; i < scene->pieces.size(); ++i)
    if (scene->charts[scene->pieces[i].chart].planar) planar.push_back(static_cast<int>(i));
  const auto offset = [&](int piece) {
    const Chart& c = scene->charts[scene->pieces[piece].chart];
    return dot(c.n, c.o);
  };
  std::vector<int> order = planar;
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return offset(a) < offset(b); });
  std::vector<int> parent(scene->pieces.size());
  std::iota(parent.begin(), parent.end(), 0);
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t j = i + 1; j < order.size() && offset(order[j]) - offset(order[i]) < 1e-3f; ++j) {
      const Piece &a = scene->pieces[order[i]], &b = scene->pieces[order[j]];
      if (dot(scene->charts[a.chart].n, scene->charts[b.chart].n) < 0.999995f) continue;
      Rect ra, rb;
      const Chart& frame = scene->charts[a.chart];
      if (a.chart != b.chart && (!inFrame(*scene, a, frame, &ra) || !inFrame(*scene, b, frame, &rb) || !touch(ra, rb)))
        continue;
      const int x = root(parent, order[i]), y = root(parent, order[j]);
      parent[std::max(x, y)] = std::min(x, y);
    }
  // Pieces of one chart always belong together (a wall cut by full-height openings is still one wall).
  std::map<int, int> first_of_chart;
  for (int p : planar) {
    const auto [it, fresh] = first_of_chart.emplace(scene->pieces[p].chart, p);
    if (fresh) continue;
    const int x = root(parent, it->second), y = root(parent, p);
    parent[std::max(x, y)] = std::min(x, y);
  }
  std::map<int, int> surface_of_root;
  for (int p : planar) {
    const auto [it, fresh] = surface_of_root.emplace(root(parent, p), static_cast<int>(scene->surfaces.size()));
    if (fresh) {
      scene->surfaces.emplace_back();
      scene->surfaces.back().frame_chart = scene->pieces[p].chart;
    }
    Surface& s = scene->surfaces[it->second];
    s.pieces.push_back(p);
    const Piece& piece = scene->pieces[p];
    s.area += (piece.u1 - piece.u0) * (piece.v1 - piece.v0);
    scene->charts[piece.chart].surface = it->second;
  }
}

}  // namespace vip_slam
