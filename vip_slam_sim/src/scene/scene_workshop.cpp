// SPDX-License-Identifier: BSD-3-Clause
// A workshop, 7 x 6 m: open racks with boards at many heights, boxes, a bench with clutter, an open door into a store.
#include <cmath>

#include "scene_parts.h"

namespace vip_slam {

Scene buildWorkshop() {
  SceneBuilder b("workshop");
  b.scene().light_spacing = 0.05f;
  Palette p = makePalette(&b, 67, 8, 0.012);
  Rng rng(5);
  const double X = 7, Y = 6, H = 2.6;
  b.floor(0, 0, X, Y, 0, p.carpet);
  const int ceiling = b.ceiling(0, 0, X, Y, H, p.ceiling);
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j) b.ceilingLamp(ceiling, 1.8 + 3.4 * i, 1.6 + 2.8 * j, 1.2, 0.3, 9.0);
  b.boxAt(X / 2, 3.0, H - 0.35, 0, {X, 0.35, 0.3}, p.metal, p.metal);  // a duct under the ceiling
  b.wall({0, 0}, {0, Y}, 0, H, p.wall);
  const int north =
      b.wall({0, Y}, {X, Y}, 0, H, p.wall, {{4.6f, 5.6f, 2.1f, Opening::Kind::kPassage, 0.15f}}, p.carpet);
  const int east = b.wall({X, Y}, {X, 0}, 0, H, p.wall);
  const int south = b.wall({X, 0}, {0, 0}, 0, H, p.wall);
  // Store behind the opening, its door half open into the workshop.
  const double y0 = Y + 0.15, y1 = Y + 2.4;
  b.floor(3.6, y0, 6.6, y1, 0, p.carpet);
  const int low = b.ceiling(3.6, y0, 6.6, y1, 2.3, p.white);
  b.ceilingLamp(low, 1.5, 1.1, 0.4, 0.4, 8);
  b.wall({3.6, y0}, {3.6, y1}, 0, 2.3, p.wall);
  const int store = b.wall({3.6, y1}, {6.6, y1}, 0, 2.3, p.wall);
  b.wall({6.6, y1}, {6.6, y0}, 0, 2.3, p.wall);
  b.wall({6.6, y0}, {3.6, y0}, 0, 2.3, p.wall, {{1.0f, 2.0f, 2.1f, Opening::Kind::kCut, 0}});
  hangPoster(&b, store, p, 0, 1.5, 1.4, 1.0);
  b.boxAt(4.62 - 0.48 * std::sin(0.6), Y - 0.05 - 0.48 * std::cos(0.6), 0, -0.6, {0.04, 0.96, 2.05}, p.wood, p.wood);
  // Racks: uprights and five boards each, half of them full of boxes.
  const auto rack = [&](double x, double y, double yaw, double width) {
    const Eigen::Isometry3d at = uprightPose(x, y, 0, yaw);
    for (int k = 0; k < 5; ++k) {
      const double z = 0.12 + 0.45 * k;
      b.boxAt(x, y, z, yaw, {0.55, width, 0.03}, p.white, p.wood);
      for (int i = 0; i < 4; ++i) {
        if (rng.uniform(0, 1) < 0.45) continue;
        const Eigen::Vector3d q = at * Eigen::Vector3d(rng.uniform(-0.08, 0.05), width * (i - 1.5) / 4, 0);
        const Eigen::Vector3d size{0.3, rng.uniform(0.2, 0.38), rng.uniform(0.12, 0.34)};
        b.boxAt(q.x(), q.y(), z + 0.03, yaw + rng.uniform(-0.15, 0.15), size, i % 2 ? p.cardboard : p.dark,
                p.cardboard);
      }
    }
    for (double sx : {-0.25, 0.25})
      for (double sy : {-0.5, 0.5}) {
        const Eigen::Vector3d q = at * Eigen::Vector3d(sx, sy * (width - 0.04), 0);
        b.boxAt(q.x(), q.y(), 0, yaw, {0.04, 0.04, 2.1}, p.metal, p.metal);
      }
  };
  rack(0.32, 1.6, 0, 2.0);
  rack(0.32, 4.1, 0, 2.0);
  rack(2.6, 5.68, -M_PI / 2, 1.8);
  // A bench along the south wall, its top cluttered; a pegboard above it; a table in the open.
  b.boxAt(4.3, 0.4, 0.86, M_PI / 2, {0.7, 3.2, 0.05}, p.wood, p.wood);
  for (double x : {2.8, 4.3, 5.8}) b.boxAt(x, 0.4, 0, 0, {0.08, 0.6, 0.86}, p.metal, p.metal);
  for (int i = 0; i < 12; ++i) {
    const double x = rng.uniform(2.9, 5.7), y = rng.uniform(0.2, 0.6);
    const Eigen::Vector3d size{rng.uniform(0.06, 0.3), rng.uniform(0.08, 0.3), rng.uniform(0.02, 0.22)};
    b.boxAt(x, y, 0.91, rng.uniform(-1.5, 1.5), size, i % 3 ? p.dark : p.cardboard, i % 2 ? p.metal : p.cardboard);
  }
  b.boxAt(4.3, 0.03, 1.2, M_PI / 2, {0.03, 2.4, 1.0}, p.wood, p.wood);
  b.boxAt(3.9, 3.1, 0.74, 0.35, {0.9, 1.5, 0.04}, p.white, p.white);
  for (double s : {-0.5, 0.5}) {
    b.boxAt(3.9 - s * std::sin(0.35), 3.1 + s * std::cos(0.35), 0, 0.35, {0.6, 0.05, 0.74}, p.metal, p.metal);
  }
  b.boxAt(4.0, 3.3, 0.78, 0.1, {0.34, 0.25, 0.02}, p.dark, p.dark);
  b.cylinder(uprightPose(3.7, 2.8, 0.78), 0.06, 0.2, p.metal, p.dark, 20);
  hangPoster(&b, east, p, 1, 1.6, 1.6, 1.0);
  b.decal(east, 3.0, 1.0, 4.6, 2.0, p.blinds);
  hangPoster(&b, north, p, 2, 6.3, 1.6, 0.8);
  hangPoster(&b, south, p, 3, 6.2, 1.5, 0.8);
  // Cabinet with a door open at 100 degrees, crates, a stool, pallets 14 cm high.
  b.boxAt(6.65, 3.0, 0, M_PI, {0.6, 1.0, 1.9}, p.white, p.white);
  b.boxAt(6.08, 2.46, 0, 0.17, {0.5, 0.03, 1.88}, p.white, p.white);
  b.boxAt(5.9, 4.9, 0, 0, {1.2, 0.9, 0.14}, p.wood, p.wood);
  boxStack(&b, p, 6.1, 5.0, &rng, 1);
  boxStack(&b, p, 1.6, 0.6, &rng, 3);
  boxStack(&b, p, 2.2, 0.5, &rng, 1);
  b.cylinder(uprightPose(5.2, 1.5, 0), 0.18, 0.5, p.metal, p.wood, 32);
  return b.finish();
}

}  // namespace vip_slam
