// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/scene/scene_builder.h"

#include <algorithm>
#include <cmath>

#include "surface_grouping.h"
#include "vip_slam_sim/scene/vec_eigen.h"

namespace vip_slam {
namespace {

const Vec4 kFrameTint = {0.62f, 0.60f, 0.57f, 1};

}  // namespace

int SceneBuilder::addTexture(const cv::Mat& image, bool repeat) {
  scene_.textures.emplace_back(image, repeat);
  return static_cast<int>(scene_.textures.size()) - 1;
}

int SceneBuilder::addChart(const Eigen::Vector3d& o, const Eigen::Vector3d& u, const Eigen::Vector3d& v,
                           const Material& material) {
  Chart c;
  c.o = toVec(o);
  c.su = static_cast<float>(u.norm());
  c.sv = static_cast<float>(v.norm());
  c.eu = toVec(u.normalized());
  c.ev = toVec(v.normalized());
  c.n = c.n0 = c.n1 = toVec(u.cross(v).normalized());
  c.material = material;
  scene_.charts.push_back(c);
  decals_.emplace_back();
  return static_cast<int>(scene_.charts.size()) - 1;
}

int SceneBuilder::rectangle(const Eigen::Vector3d& o, const Eigen::Vector3d& u, const Eigen::Vector3d& v,
                            const Material& material) {
  const int chart = addChart(o, u, v, material);
  scene_.pieces.push_back({chart, 0, 0, scene_.charts[chart].su, scene_.charts[chart].sv});
  return chart;
}

int SceneBuilder::floor(double x0, double y0, double x1, double y1, double z, const Material& material) {
  const int chart = rectangle({x0, y0, z}, {x1 - x0, 0, 0}, {0, y1 - y0, 0}, material);
  scene_.charts[chart].tu = static_cast<float>(x0);  // the texture continues from one floor to the next
  scene_.charts[chart].tv = static_cast<float>(y0);
  return chart;
}

int SceneBuilder::ceiling(double x0, double y0, double x1, double y1, double z, const Material& material) {
  const int chart = rectangle({x0, y1, z}, {x1 - x0, 0, 0}, {0, y0 - y1, 0}, material);
  scene_.charts[chart].tu = static_cast<float>(x0);
  scene_.charts[chart].tv = static_cast<float>(-y1);
  return chart;
}

int SceneBuilder::wall(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double z0, double z1,
                       const Material& material, const std::vector<Opening>& openings, const Material& threshold) {
  const Eigen::Vector2d dir = (b - a).normalized();
  const Eigen::Vector3d eu(dir.x(), dir.y(), 0), n(dir.y(), -dir.x(), 0), ez(0, 0, 1), o(a.x(), a.y(), z0);
  const double length = (b - a).norm(), height = z1 - z0;
  const int chart = addChart(o, eu * length, ez * height, material);
  scene_.charts[chart].tu = static_cast<float>(a.dot(dir));

  // Upright strips between the openings' edges; above an opening only the lintel is left.
  std::vector<float> cuts = {0, static_cast<float>(length)};
  for (const Opening& op : openings)
    if (op.kind != Opening::Kind::kProud) cuts.insert(cuts.end(), {op.s0, op.s1});
  std::sort(cuts.begin(), cuts.end());
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    if (cuts[i + 1] - cuts[i] < 1e-4f) continue;
    const float mid = 0.5f * (cuts[i] + cuts[i + 1]);
    float bottom = 0;
    for (const Opening& op : openings)
      if (op.kind != Opening::Kind::kProud && op.s0 < mid && mid < op.s1) bottom = std::max(bottom, op.height);
    if (bottom < height - 1e-4)
      scene_.pieces.push_back({chart, cuts[i], bottom, cuts[i + 1], static_cast<float>(height)});
  }

  for (const Opening& op : openings) {
    const double w = op.s1 - op.s0, h = op.height, d = op.depth;
    const Eigen::Vector3d corner = o + eu * op.s0;
    if (op.kind == Opening::Kind::kPassage || op.kind == Opening::Kind::kClosed) {
      const bool open = op.kind == Opening::Kind::kPassage;
      rectangle(corner, -n * d, ez * h, open ? material : Material{-1, 1, kFrameTint});
      rectangle(corner + eu * w - n * d, n * d, ez * h, open ? material : Material{-1, 1, kFrameTint});
      if (h < height - 1e-4)
        rectangle(corner + ez * h - n * d, eu * w, n * d, open ? material : Material{-1, 1, kFrameTint});
      rectangle(corner, eu * w, -n * d, threshold);
    }
    if (op.kind == Opening::Kind::kClosed || op.kind == Opening::Kind::kProud) {
      const double frame = 0.07;
      const Material leaf{op.leaf_texture, 400, op.leaf_tint};
      int front;
      if (op.kind == Opening::Kind::kClosed) {
        front = rectangle(corner - n * d, eu * w, ez * h, leaf);
      } else {
        Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
        pose.linear().col(0) = n;
        pose.linear().col(1) = eu;
        pose.linear().col(2) = ez;
        pose.translation() = corner + eu * (w / 2) + n * (d / 2) + ez * (h / 2);
        front = box(pose, {d, w, h}, leaf, leaf);
      }
      // handle and its plate, on the side away from the hinges
      decal(front, w - 0.14, 0.98, w - 0.10, 1.18, -1, rgb(0.45f, 0.45f, 0.46f));
      decal(front, w - 0.22, 1.07, w - 0.10, 1.095, -1, rgb(0.28f, 0.28f, 0.30f));
      if (op.kind == Opening::Kind::kClosed) {
        decal(chart, op.s0 - frame, 0, op.s0, h + frame, -1, kFrameTint);
        decal(chart, op.s1, 0, op.s1 + frame, h + frame, -1, kFrameTint);
        decal(chart, op.s0, h, op.s1, h + frame, -1, kFrameTint);
      }
    }
  }
  return chart;
}

int SceneBuilder::box(const Eigen::Isometry3d& pose, const Eigen::Vector3d& size, const Material& side,
                      const Material& top) {
  const Eigen::Vector3d h = size / 2;
  const auto at = [&](double x, double y, double z) { return Eigen::Vector3d(pose * Eigen::Vector3d(x, y, z)); };
  const Eigen::Vector3d ex = pose.linear().col(0) * size.x(), ey = pose.linear().col(1) * size.y(),
                        ez = pose.linear().col(2) * size.z();
  const int first = rectangle(at(h.x(), -h.y(), -h.z()), ey, ez, side);
  rectangle(at(-h.x(), h.y(), -h.z()), -ey, ez, side);
  rectangle(at(h.x(), h.y(), -h.z()), -ex, ez, side);
  rectangle(at(-h.x(), -h.y(), -h.z()), ex, ez, side);
  rectangle(at(-h.x(), -h.y(), h.z()), ex, ey, top);
  rectangle(at(-h.x(), h.y(), -h.z()), ex, -ey, side);
  return first;
}

int SceneBuilder::boxAt(double x, double y, double z, double yaw, const Eigen::Vector3d& size, const Material& side,
                        const Material& top) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = Eigen::Vector3d(x, y, z + size.z() / 2);
  return box(pose, size, side, top);
}

void SceneBuilder::cylinder(const Eigen::Isometry3d& pose, double radius, double height, const Material& material,
                            const Material& cap, int strips) {
  const auto rim = [&](int k, double z) {
    const double a = 2 * M_PI * k / strips;
    return Eigen::Vector3d(pose * Eigen::Vector3d(radius * std::cos(a), radius * std::sin(a), z));
  };
  const auto radial = [&](int k) {
    const double a = 2 * M_PI * k / strips;
    return Eigen::Vector3d(pose.linear() * Eigen::Vector3d(std::cos(a), std::sin(a), 0));
  };
  const Eigen::Vector3d up = pose.linear().col(2);
  double travelled = 0;
  for (int k = 0; k < strips; ++k) {
    const Eigen::Vector3d edge = rim(k + 1, 0) - rim(k, 0);
    const int chart = rectangle(rim(k, 0), edge, up * height, material);
    Chart& c = scene_.charts[chart];
    c.planar = false;
    c.n0 = toVec(radial(k));
    c.n1 = toVec(radial(k + 1));
    c.tu = static_cast<float>(travelled);
    travelled += edge.norm();
  }
  // Caps as parallel slats whose ends follow the rim.
  const int slats = std::max(32, strips);
  for (int end = 0; end < 2; ++end) {
    for (int k = 0; k < slats; ++k) {
      const double y0 = radius * (2.0 * k / slats - 1), y1 = radius * (2.0 * (k + 1) / slats - 1);
      const double half = std::sqrt(std::max(0.0, radius * radius - std::pow(0.5 * (y0 + y1), 2)));
      const Eigen::Vector3d ex = pose.linear().col(0), ey = pose.linear().col(1);
      int chart;
      if (end == 1)
        chart = rectangle(pose * Eigen::Vector3d(-half, y0, height), ex * (2 * half), ey * (y1 - y0), cap);
      else
        chart = rectangle(pose * Eigen::Vector3d(-half, y1, 0), ex * (2 * half), ey * (y0 - y1), cap);
      if (radius < 0.25) scene_.charts[chart].planar = false;
    }
  }
}

void SceneBuilder::sphere(const Eigen::Vector3d& centre, double radius, const Material& material, int strips) {
  // Bands of rectangles, slightly too wide at their narrow end: this avoids gaps, and the overlap is hidden inside.
  const int bands = strips / 2;
  for (int b = 0; b < bands; ++b) {
    const double p0 = M_PI * b / bands - M_PI / 2, p1 = M_PI * (b + 1) / bands - M_PI / 2;
    const double ring = std::max(std::cos(p0), std::cos(p1));
    for (int k = 0; k < strips; ++k) {
      const double a = 2 * M_PI * (k + 0.5) / strips;
      const Eigen::Vector3d out(std::cos(a), std::sin(a), 0), along(-std::sin(a), std::cos(a), 0);
      const double width = 2 * radius * ring * std::tan(M_PI / strips);
      const Eigen::Vector3d lo = centre + radius * (std::cos(p0) * out + std::sin(p0) * Eigen::Vector3d::UnitZ());
      const Eigen::Vector3d hi = centre + radius * (std::cos(p1) * out + std::sin(p1) * Eigen::Vector3d::UnitZ());
      const int chart = rectangle(lo - along * (width / 2), along * width, hi - lo, material);
      Chart& c = scene_.charts[chart];
      c.planar = false;
      const double pm = 0.5 * (p0 + p1);
      for (int side = 0; side < 2; ++side) {
        const double as = 2 * M_PI * (k + side) / strips;
        const Eigen::Vector3d n(std::cos(as) * std::cos(pm), std::sin(as) * std::cos(pm), std::sin(pm));
        (side ? c.n1 : c.n0) = toVec(n);
      }
    }
  }
}

void SceneBuilder::decal(int chart, double u0, double v0, double u1, double v1, int texture, Vec4 tint,
                         double emission) {
  decals_[chart].push_back({static_cast<float>(u0), static_cast<float>(v0), static_cast<float>(u1),
                            static_cast<float>(v1), texture, tint, static_cast<float>(emission)});
}

void SceneBuilder::ceilingLamp(int chart, double u, double v, double su, double sv, double power) {
  decal(chart, u - su / 2 - 0.02, v - sv / 2 - 0.02, u + su / 2 + 0.02, v + sv / 2 + 0.02, -1,
        rgb(0.75f, 0.75f, 0.75f));
  decal(chart, u - su / 2, v - sv / 2, u + su / 2, v + sv / 2, -1, rgb(1, 1, 1), 0.75);
  lamp(chart, u, v, su, sv, power);
}

void SceneBuilder::lamp(int chart, double u, double v, double su, double sv, double power) {
  const Chart& c = scene_.charts[chart];
  Lamp shining;
  shining.centre = c.o + c.eu * static_cast<float>(u) + c.ev * static_cast<float>(v);
  shining.half_u = c.eu * static_cast<float>(su / 2);
  shining.half_v = c.ev * static_cast<float>(sv / 2);
  shining.n = c.n;
  shining.power = static_cast<float>(power);
  scene_.lamps.push_back(shining);
}

Scene SceneBuilder::finish() {
  for (std::size_t i = 0; i < scene_.charts.size(); ++i) {
    Chart& c = scene_.charts[i];
    c.decal_begin = static_cast<int>(scene_.decals.size());
    c.decal_count = static_cast<int>(decals_[i].size());
    scene_.decals.insert(scene_.decals.end(), decals_[i].begin(), decals_[i].end());
  }
  groupSurfaces(&scene_);
  return std::move(scene_);
}

}  // namespace vip_slam
