// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/scene/truth_planes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "vip_slam_sim/scene/vec_eigen.h"

namespace vip_slam {
namespace {

constexpr double kCell = 0.1;         ///< m, seen-area grid
constexpr int kStride = 8;            ///< px between samples
constexpr double kSeenShare = 0.005;  ///< share of the image that a plane must fill to count as seen

struct SurfaceRect {
  double u0, v0, u1, v1;
};

/// Pieces in the frame of the surface, exact to float rounding; coordinates closer than 1 mm are made equal.
std::vector<SurfaceRect> surfaceRects(const Scene& scene, const Surface& surface) {
  const Chart& f = scene.charts[surface.frame_chart];
  std::vector<SurfaceRect> rects;
  if (surface.pieces.empty()) rects.push_back({0, 0, f.su, f.sv});
  for (int index : surface.pieces) {
    const Piece& piece = scene.pieces[index];
    const Chart& c = scene.charts[piece.chart];
    const Vec3 p = c.o + c.eu * piece.u0 + c.ev * piece.v0 - f.o, q = c.o + c.eu * piece.u1 + c.ev * piece.v1 - f.o;
    const double a = dot(p, f.eu), b = dot(q, f.eu), d = dot(p, f.ev), e = dot(q, f.ev);
    rects.push_back({std::min(a, b), std::min(d, e), std::max(a, b), std::max(d, e)});
  }
  return rects;
}

std::vector<double> distinct(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  std::vector<double> out;
  for (double v : values)
    if (out.empty() || v - out.back() > 1e-3) out.push_back(v);
  return out;
}

std::size_t indexOf(const std::vector<double>& grid, double value) {
  const auto it = std::lower_bound(grid.begin(), grid.end(), value - 1e-3);
  return static_cast<std::size_t>(it - grid.begin());
}

using Node = std::pair<int, int>;

double signedArea(const std::vector<Eigen::Vector2d>& ring) {
  double sum = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const auto& a = ring[i];
    const auto& b = ring[(i + 1) % ring.size()];
    sum += a.x() * b.y() - b.x() * a.y();
  }
  return sum / 2;
}

bool contains(const std::vector<Eigen::Vector2d>& ring, const Eigen::Vector2d& p) {
  bool in = false;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++)
    if ((ring[i].y() > p.y()) != (ring[j].y() > p.y()) &&
        p.x() < (ring[j].x() - ring[i].x()) * (p.y() - ring[i].y()) / (ring[j].y() - ring[i].y()) + ring[i].x())
      in = !in;
  return in;
}

/// Newell's sum: outlines count positive, holes negative. Pieces that overlap count once.
double outlineArea(const std::vector<PlanePolygon>& outline, const Eigen::Vector3d& n) {
  double area = 0;
  const auto add = [&](const Ring& ring) {
    for (std::size_t i = 0; i < ring.size(); ++i) area += 0.5 * ring[i].cross(ring[(i + 1) % ring.size()]).dot(n);
  };
  for (const PlanePolygon& polygon : outline) {
    add(polygon.outer);
    for (const Ring& hole : polygon.holes) add(hole);
  }
  return area;
}

/// Boundaries of a set of grid cells, inside on the left; turning left where cells meet at a corner only.
std::vector<std::vector<Node>> traceCells(const std::vector<std::vector<char>>& cell) {
  const int nu = static_cast<int>(cell.size()), nv = static_cast<int>(cell[0].size());
  const auto full = [&](int i, int j) { return i >= 0 && j >= 0 && i < nu && j < nv && cell[i][j]; };
  std::map<Node, std::set<Node>> edges;
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j) {
      if (!full(i, j)) continue;
      if (!full(i, j - 1)) edges[{i, j}].insert({i + 1, j});
      if (!full(i + 1, j)) edges[{i + 1, j}].insert({i + 1, j + 1});
      if (!full(i, j + 1)) edges[{i + 1, j + 1}].insert({i, j + 1});
      if (!full(i - 1, j)) edges[{i, j + 1}].insert({i, j});
    }
  std::vector<std::vector<Node>> rings;
  while (!edges.empty()) {
    const Node start = edges.begin()->first;
    std::vector<Node> ring;
    Node at = start, before{0, 0};
    bool first = true;
    do {
      auto it = edges.find(at);
      Node next = *it->second.begin();
      if (!first && it->second.size() > 1)
        for (const Node& option : it->second) {
          const int cross = (at.first - before.first) * (option.second - at.second) -
                            (at.second - before.second) * (option.first - at.first);
          if (cross > 0) next = option;  // stay on the boundary of the same cell
        }
      it->second.erase(next);
      if (it->second.empty()) edges.erase(it);
      ring.push_back(at);
      before = at;
      at = next;
      first = false;
    } while (at != start);
    rings.push_back(ring);
  }
  return rings;
}

}  // namespace

std::vector<PlanePolygon> surfaceOutline(const Scene& scene, const Surface& surface) {
  const std::vector<SurfaceRect> rects = surfaceRects(scene, surface);
  std::vector<double> us, vs;
  for (const SurfaceRect& r : rects) {
    us.insert(us.end(), {r.u0, r.u1});
    vs.insert(vs.end(), {r.v0, r.v1});
  }
  us = distinct(us);
  vs = distinct(vs);
  if (us.size() < 2 || vs.size() < 2) return {};
  std::vector<std::vector<char>> cell(us.size() - 1, std::vector<char>(vs.size() - 1, 0));
  for (const SurfaceRect& r : rects)
    for (std::size_t i = indexOf(us, r.u0); i < indexOf(us, r.u1); ++i)
      for (std::size_t j = indexOf(vs, r.v0); j < indexOf(vs, r.v1); ++j) cell[i][j] = 1;

  std::vector<std::vector<Eigen::Vector2d>> outers, holes;
  for (const std::vector<Node>& nodes : traceCells(cell)) {
    std::vector<Eigen::Vector2d> ring;
    const std::size_t n = nodes.size();
    for (std::size_t i = 0; i < n; ++i) {
      const Node &a = nodes[(i + n - 1) % n], &b = nodes[i], &c = nodes[(i + 1) % n];
      const bool straight =
          (a.first == b.first && b.first == c.first) || (a.second == b.second && b.second == c.second);
      if (!straight) ring.emplace_back(us[b.first], vs[b.second]);
    }
    (signedArea(ring) > 0 ? outers : holes).push_back(ring);
  }
  const Chart& f = scene.charts[surface.frame_chart];
  const auto lift = [&](const std::vector<Eigen::Vector2d>& ring) {
    Ring out;
    for (const auto& p : ring) out.push_back(toEigen(f.o) + p.x() * toEigen(f.eu) + p.y() * toEigen(f.ev));
    return out;
  };
  std::vector<PlanePolygon> polygons(outers.size());
  for (std::size_t i = 0; i < outers.size(); ++i) polygons[i].outer = lift(outers[i]);
  for (const auto& hole : holes) {
    // The smallest outline around the hole owns it.
    int owner = -1;
    const Eigen::Vector2d inside = 0.5 * (hole[0] + hole[1]);
    for (std::size_t i = 0; i < outers.size(); ++i)
      if (contains(outers[i], inside) && (owner < 0 || signedArea(outers[i]) < signedArea(outers[owner])))
        owner = static_cast<int>(i);
    if (owner >= 0) polygons[owner].holes.push_back(lift(hole));
  }
  return polygons;
}

VisibilityCounter::VisibilityCounter(std::shared_ptr<const Scene> scene)
    : scene_(std::move(scene)), seconds_(scene_->surfaces.size(), 0.0) {
  for (const Surface& s : scene_->surfaces) {
    SurfaceRect all{1e9, 1e9, -1e9, -1e9};
    for (const SurfaceRect& r : surfaceRects(*scene_, s))
      all = {std::min(all.u0, r.u0), std::min(all.v0, r.v0), std::max(all.u1, r.u1), std::max(all.v1, r.v1)};
    Grid g;
    g.u0 = static_cast<float>(all.u0);
    g.v0 = static_cast<float>(all.v0);
    g.cols = static_cast<int>((all.u1 - all.u0) / kCell) + 1;
    g.rows = static_cast<int>((all.v1 - all.v0) / kCell) + 1;
    grids_.push_back(std::move(g));
  }
}

void VisibilityCounter::add(const FrameBuffers& frame, const CameraModel& camera, const SE3& T_W_C, double seconds,
                            double max_depth) {
  std::map<int, int> counts;
  int samples = 0;
  for (int v = kStride / 2; v < frame.piece.rows; v += kStride)
    for (int u = kStride / 2; u < frame.piece.cols; u += kStride) {
      ++samples;
      const int piece = frame.piece.at<int>(v, u);
      if (piece < 0) continue;
      const int surface = scene_->surfaceOf(piece);
      const float z = frame.depth.at<float>(v, u);
      if (surface < 0 || z > max_depth) continue;
      ++counts[surface];
      const Chart& f = scene_->charts[scene_->surfaces[surface].frame_chart];
      const Eigen::Vector3d p = T_W_C * camera.unproject({double(u), double(v)}, z) - toEigen(f.o);
      Grid& g = grids_[surface];
      if (g.seen.empty()) g.seen.assign(static_cast<std::size_t>(g.cols) * g.rows, 0);
      const int c = static_cast<int>((p.dot(toEigen(f.eu)) - g.u0) / kCell);
      const int r = static_cast<int>((p.dot(toEigen(f.ev)) - g.v0) / kCell);
      if (c >= 0 && r >= 0 && c < g.cols && r < g.rows) g.seen[static_cast<std::size_t>(r) * g.cols + c] = 1;
    }
  for (const auto& [surface, n] : counts)
    if (n >= kSeenShare * samples) seconds_[surface] += seconds;
}

double VisibilityCounter::seenArea(int surface) const {
  const Grid& g = grids_[surface];
  const double cells = static_cast<double>(std::count(g.seen.begin(), g.seen.end(), 1)) * kCell * kCell;
  return cells;
}

std::vector<TruePlane> truthPlanes(const Scene& scene, const VisibilityCounter& seen, double min_area) {
  std::vector<TruePlane> planes;
  for (std::size_t i = 0; i < scene.surfaces.size(); ++i) {
    const Surface& s = scene.surfaces[i];
    if (s.area < min_area) continue;
    const std::vector<PlanePolygon> outline = surfaceOutline(scene, s);
    const Chart& f = scene.charts[s.frame_chart];
    TruePlane p;
    p.id = planes.size() + 1;
    p.plane = Plane::fromPointNormal(toEigen(f.o), toEigen(f.n));
    const double up = std::abs(p.plane.n.z());
    p.kind = up > 0.9999 ? PlaneKind::kHorizontal : up < 0.01 ? PlaneKind::kVertical : PlaneKind::kGeneral;
    p.polygons = outline;
    p.area = outlineArea(outline, p.plane.n);
    p.seen_seconds = seen.seenSeconds(static_cast<int>(i));
    p.seen_area = std::min(p.area, seen.seenArea(static_cast<int>(i)));
    planes.push_back(std::move(p));
  }
  return planes;
}

}  // namespace vip_slam
