// SPDX-License-Identifier: BSD-3-Clause
#include "world.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace vip_slam::gba_benchmark {
namespace {

using Eigen::Vector3d;

// A wall, floor or table top: one rectangle on its own plane.
void addPlane(World* w, const Vector3d& corner, const Vector3d& u, const Vector3d& v, const Vector3d& normal,
              PlaneKind kind) {
  WorldPlane plane;
  plane.plane = Plane::fromPointNormal(corner, normal);
  plane.kind = kind;
  w->rectangles.push_back({static_cast<int>(w->planes.size()), corner, u, v, true});
  w->planes.push_back(plane);
}

World rooms() {
  World w;
  const double X = 14, Y = 10, Z = 3;
  const auto V = PlaneKind::kVertical;
  const auto H = PlaneKind::kHorizontal;
  addPlane(&w, {0, 0, 0}, {0, Y, 0}, {0, 0, Z}, Vector3d::UnitX(), V);
  addPlane(&w, {X, 0, 0}, {0, Y, 0}, {0, 0, Z}, -Vector3d::UnitX(), V);
  addPlane(&w, {0, 0, 0}, {X, 0, 0}, {0, 0, Z}, Vector3d::UnitY(), V);
  addPlane(&w, {0, Y, 0}, {X, 0, 0}, {0, 0, Z}, -Vector3d::UnitY(), V);
  addPlane(&w, {6.9, 0, 0}, {0, 6.3, 0}, {0, 0, Z}, -Vector3d::UnitX(), V);  // partition, both faces
  addPlane(&w, {7.1, 0, 0}, {0, 6.3, 0}, {0, 0, Z}, Vector3d::UnitX(), V);
  addPlane(&w, {1.5, 9.4, 0}, {3.0, 0, 0}, {0, 0, 2.1}, -Vector3d::UnitY(), V);  // cupboards
  addPlane(&w, {9.5, 9.4, 0}, {3.0, 0, 0}, {0, 0, 2.1}, -Vector3d::UnitY(), V);
  addPlane(&w, {0.5, 0.6, 0}, {0, 2.5, 0}, {0, 0, 1.9}, Vector3d::UnitX(), V);
  addPlane(&w, {13.5, 0.6, 0}, {0, 2.5, 0}, {0, 0, 1.9}, -Vector3d::UnitX(), V);
  addPlane(&w, {0, 0, 0}, {X, 0, 0}, {0, Y, 0}, Vector3d::UnitZ(), H);
  addPlane(&w, {0, 0, Z}, {X, 0, 0}, {0, Y, 0}, -Vector3d::UnitZ(), H);
  addPlane(&w, {4.2, 3.6, 0.75}, {1.4, 0, 0}, {0, 1.0, 0}, Vector3d::UnitZ(), H);
  addPlane(&w, {0.9, 5.5, 0.9}, {0.8, 0, 0}, {0, 1.8, 0}, Vector3d::UnitZ(), H);
  addPlane(&w, {7.6, 1.2, 0.72}, {1.5, 0, 0}, {0, 0.9, 0}, Vector3d::UnitZ(), H);
  addPlane(&w, {12.4, 5.2, 0.45}, {0.9, 0, 0}, {0, 1.6, 0}, Vector3d::UnitZ(), H);
  for (const Vector3d& c :
       {Vector3d(4.9, 4.1, 0.95), Vector3d(1.2, 6.2, 1.1), Vector3d(8.3, 1.6, 0.9), Vector3d(12.8, 6, 0.7),
        Vector3d(4.6, 4.6, 0.4), Vector3d(9.4, 4.4, 0.4), Vector3d(2.4, 8.7, 0.5), Vector3d(11, 8.7, 0.5),
        Vector3d(1.4, 2.0, 0.6), Vector3d(12.6, 2.0, 0.6), Vector3d(6.3, 5.2, 1.2), Vector3d(7.7, 5.2, 1.2)})
    w.clutter.push_back({c - Vector3d(0.5, 0.5, 0.35), c + Vector3d(0.5, 0.5, 0.45)});
  // Through both rooms and back, looking outwards on the way there and in the opposite direction on the way back.
  const std::vector<Vector3d> way = {{3.2, 1.8, 1.4},  {2.6, 3.4, 1.5},  {2.8, 5.2, 1.4}, {3.6, 7.0, 1.5},
                                     {5.4, 8.0, 1.4},  {7.0, 8.1, 1.5},  {8.8, 7.9, 1.5}, {10.3, 6.8, 1.4},
                                     {11.0, 5.0, 1.5}, {10.8, 3.2, 1.4}, {10.2, 1.9, 1.5}};
  const std::vector<double> yaw_there = {3.6, 3.8, 1.0, -0.9, 0.6, 0.4, -0.4, -0.9, 0.1, -1.0, -2.2};
  const std::vector<double> yaw_back = {-3.2, -3.9, -3.3, -2.4, -3.0, -2.8, -3.5, -4.0, -4.9, -6.2, -7.4};
  const int n = static_cast<int>(way.size());
  for (int k = 0; k < n; ++k) w.path.emplace_back(way[k].x(), way[k].y(), way[k].z(), yaw_there[k]);
  for (int k = n - 2; k >= 0; --k) w.path.emplace_back(way[k].x(), way[k].y() + 0.2, way[k].z(), yaw_back[n - 1 - k]);
  return w;
}

World corridor(int keyframes) {
  World w;
  const double length = 0.18 * keyframes + 8, width = 2.4, height = 2.6;
  const double piece = 8;  // doors and pillars end a wall: one plane per piece
  for (double x = -2; x < length; x += piece) {
    addPlane(&w, {x, -width / 2, 0}, {piece - 0.3, 0, 0}, {0, 0, height}, Vector3d::UnitY(), PlaneKind::kVertical);
    addPlane(&w, {x, width / 2, 0}, {piece - 0.3, 0, 0}, {0, 0, height}, -Vector3d::UnitY(), PlaneKind::kVertical);
    for (const double side : {-0.8, 0.8})
      w.clutter.push_back({Vector3d(x + 2, side - 0.3, 0.1), Vector3d(x + 6, side + 0.3, 1.0)});
  }
  addPlane(&w, {-2, -width / 2, 0}, {length + 10, 0, 0}, {0, width, 0}, Vector3d::UnitZ(), PlaneKind::kHorizontal);
  addPlane(&w, {-2, -width / 2, height}, {length + 10, 0, 0}, {0, width, 0}, -Vector3d::UnitZ(),
           PlaneKind::kHorizontal);
  for (double x = 0; x < length; x += 1.5)
    w.path.emplace_back(x, 0.2 * std::sin(x), 1.4 + 0.1 * std::cos(1.3 * x), 0.35 * std::sin(0.7 * x));
  return w;
}

// Value and first two derivatives of the spline with respect to its parameter.
void evaluate(const std::vector<Eigen::Vector4d>& c, double s, Eigen::Vector4d* x, Eigen::Vector4d* dx,
              Eigen::Vector4d* ddx) {
  const int last = static_cast<int>(c.size()) - 4;
  const int k = std::clamp(static_cast<int>(std::floor(s)), 0, last);
  const double u = s - k, v = 1 - u;
  const Eigen::Vector4d &a = c[k], &b = c[k + 1], &d = c[k + 2], &e = c[k + 3];
  *x = (v * v * v * a + (3 * u * u * u - 6 * u * u + 4) * b + (-3 * u * u * u + 3 * u * u + 3 * u + 1) * d +
        u * u * u * e) /
       6;
  *dx = (-v * v * a + (3 * u * u - 4 * u) * b + (-3 * u * u + 2 * u + 1) * d + u * u * e) / 2;
  *ddx = v * a + (3 * u - 2) * b + (-3 * u + 1) * d + u * e;
}

}  // namespace

NavState World::stateAt(double t) const {
  Eigen::Vector4d x, dx, ddx;
  evaluate(path, t * speed, &x, &dx, &ddx);
  NavState state;
  state.t = t;
  const Eigen::Quaterniond q = Eigen::AngleAxisd(x(3), Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(0.12 + 0.08 * std::sin(0.8 * t), Vector3d::UnitY()) *
                               Eigen::AngleAxisd(0.06 * std::sin(1.1 * t), Vector3d::UnitX());
  state.T_W_I = SE3(q, x.head<3>());
  state.v_W = dx.head<3>() * speed;
  return state;
}

ImuSample World::imuAt(double t) const {
  Eigen::Vector4d x, dx, ddx;
  evaluate(path, t * speed, &x, &dx, &ddx);
  const double h = 1e-5;
  const NavState before = stateAt(t - h), now = stateAt(t), after = stateAt(t + h);
  ImuSample sample;
  sample.t = t;
  sample.gyro = logSO3(before.T_W_I.rotation().conjugate() * after.T_W_I.rotation()) / (2 * h);
  sample.accel = now.T_W_I.rotation().conjugate() * (ddx.head<3>() * speed * speed + gravityVector());
  return sample;
}

int World::cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double* s) const {
  int hit = -1;
  double best = 1e9;
  for (std::size_t k = 0; k < rectangles.size(); ++k) {
    const Rectangle& r = rectangles[k];
    const Plane& plane = planes[r.plane].plane;
    const double slope = plane.n.dot(direction);
    if (slope > -1e-9) continue;  // seen from behind: open
    const double at = -plane.signedDistance(origin) / slope;
    if (at < 0.05 || at >= best) continue;
    const Eigen::Vector3d x = origin + at * direction - r.corner;
    const double a = x.dot(r.u) / r.u.squaredNorm(), b = x.dot(r.v) / r.v.squaredNorm();
    if (a < 0 || a > 1 || b < 0 || b > 1) continue;
    best = at;
    hit = static_cast<int>(k);
  }
  *s = best;
  return hit;
}

World makeWorld(const std::string& name, int keyframes, double duration) {
  World w;
  if (name == "rooms")
    w = rooms();
  else if (name == "corridor")
    w = corridor(keyframes);
  else
    throw std::invalid_argument("world: '" + name + "', expected rooms or corridor");
  w.speed = (static_cast<double>(w.path.size()) - 3.0 - 1e-3) / duration;
  return w;
}

}  // namespace vip_slam::gba_benchmark
