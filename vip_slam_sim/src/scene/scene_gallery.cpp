// SPDX-License-Identifier: BSD-3-Clause
// A gallery, 18 x 9 m: pillars, free-standing panels, pedestals, a podium one step high, benches.
#include <cmath>

#include "scene_parts.h"

namespace vip_slam {

Scene buildGallery() {
  SceneBuilder b("gallery");
  b.scene().light_spacing = 0.08f;
  Palette p = makePalette(&b, 53, 12, 0.006);
  Rng rng(33);
  const double X = 18, Y = 9, H = 3.4;
  b.floor(0, 0, X, Y, 0, p.carpet);
  for (int i = 0; i < 2; ++i) {
    const int ceiling = b.ceiling(9.0 * i, 0, 9.0 * i + 9.0, Y, H, p.ceiling);
    for (int k = 0; k < 3; ++k)
      for (int j = 0; j < 2; ++j) b.ceilingLamp(ceiling, 1.5 + 3.0 * k, 2.2 + 4.6 * j, 1.2, 0.4, 10.0);
  }
  const int west = b.wall({0, 0}, {0, Y}, 0, H, p.wall, {{4.0f, 5.2f, 2.3f, Opening::Kind::kPassage, 0.3f}}, p.carpet);
  const int north =
      b.wall({0, Y}, {X, Y}, 0, H, p.wall, {{7.0f, 8.0f, 2.1f, Opening::Kind::kClosed, 0.1f, p.door}}, p.carpet);
  const int east = b.wall({X, Y}, {X, 0}, 0, H, p.wall);
  const int south = b.wall({X, 0}, {0, 0}, 0, H, p.wall);
  // Behind the passage a second, dimmer room.
  const double x0 = -4, x1 = -0.3;
  b.floor(x0, 2, x1, 7, 0, p.carpet);
  const int dim = b.ceiling(x0, 2, x1, 7, 2.6, p.ceiling);
  b.ceilingLamp(dim, 1.8, 2.5, 0.6, 0.6, 8);
  const int back = b.wall({x0, 2}, {x0, 7}, 0, 2.6, p.wall);
  b.wall({x0, 7}, {x1, 7}, 0, 2.6, p.wall);
  b.wall({x1, 7}, {x1, 2}, 0, 2.6, p.wall, {{1.8f, 3.0f, 2.3f, Opening::Kind::kCut, 0}});
  b.wall({x1, 2}, {x0, 2}, 0, 2.6, p.wall);
  hangPoster(&b, back, p, 9, 2.5, 1.5, 1.2);
  for (int i = 0; i < 6; ++i) {
    b.decal(north, 1.0 + 2.9 * i, 1.1, 2.0 + 2.9 * i, 1.9, i == 2 ? p.posters[0] : p.photographs[i % 4]);
  }
  for (int i = 0; i < 5; ++i) hangPoster(&b, south, p, i, 2.0 + 3.4 * i, 1.6, 1.1);
  for (int i = 0; i < 2; ++i) {
    hangPoster(&b, east, p, 5 + i, 2.6 + 3.6 * i, 1.6, 1.3);
    hangPoster(&b, west, p, 7 + i, 1.8 + 5.4 * i, 1.6, 1.1);
  }
  for (int chart : {north, south}) socket(&b, chart, 4.0), socket(&b, chart, 12.4);
  // Two rows of pillars: square ones and round ones.
  for (int i = 0; i < 4; ++i) {
    b.boxAt(3.0 + 4.0 * i, 2.6, 0, 0, {0.45, 0.45, H}, p.wall, p.wall);
    if (i % 2)
      b.cylinder(uprightPose(3.0 + 4.0 * i, 6.4, 0), 0.3, H, p.wall, p.wall, 48);
    else
      b.boxAt(3.0 + 4.0 * i, 6.4, 0, M_PI / 4, {0.5, 0.5, H}, p.wall, p.wall);
  }
  // Panels 8 cm thick with pictures on both sides, one of them almost parallel to the wall, 35 cm before it.
  const auto panel = [&](double x, double y, double yaw, double width, int picture) {
    const int first = b.boxAt(x, y, 0, yaw, {0.08, width, 2.1}, p.white, p.white);
    b.decal(first, 0.4, 0.9, 1.4, 1.7, p.photographs[picture % 4]);
    hangPoster(&b, first + 1, p, picture, width / 2, 1.3, 0.9);
  };
  panel(5.0, 4.5, 0.0, 2.4, 0);
  panel(9.0, 4.4, 0.5, 2.2, 1);
  panel(13.0, 4.6, M_PI / 2, 2.6, 2);
  panel(16.2, 8.6, M_PI / 2 + 0.03, 1.8, 3);
  // Pedestals with things on them, a podium, benches, a long table with clutter.
  for (int i = 0; i < 3; ++i) {
    const double x = 6.9 + 4.1 * i, y = i % 2 ? 7.6 : 1.3;
    b.boxAt(x, y, 0, 0.2 * i, {0.5, 0.5, 1.0}, p.white, p.white);
    if (i % 2)
      b.sphere({x, y, 1.22}, 0.22, {-1, 1, rgb(0.7f, 0.5f, 0.3f)}, 28);
    else
      b.cylinder(uprightPose(x, y, 1.0), 0.12, 0.5, p.metal, p.dark, 32);
  }
  b.boxAt(16.4, 4.5, 0, 0, {2.6, 3.0, 0.16}, p.wood, p.wood);
  b.boxAt(16.7, 4.5, 0.16, 0.3, {0.7, 0.7, 0.8}, p.dark, p.dark);
  b.boxAt(7.2, 4.6, 0.42, 0, {0.5, 1.8, 0.06}, p.wood, p.wood);
  for (double dy : {-0.7, 0.7}) b.boxAt(7.2, 4.6 + dy, 0, 0, {0.45, 0.08, 0.42}, p.dark, p.dark);
  b.boxAt(1.3, 1.6, 0.72, 0, {0.9, 2.4, 0.04}, p.white, p.wood);
  for (double sx : {-0.4, 0.4})
    for (double sy : {-1.1, 1.1}) b.boxAt(1.3 + sx, 1.6 + sy, 0, 0, {0.05, 0.05, 0.72}, p.metal, p.metal);
  for (int i = 0; i < 9; ++i) {
    const double x = rng.uniform(1.0, 1.6), y = rng.uniform(0.6, 2.6);
    if (i % 3 == 2) {
      b.cylinder(uprightPose(x, y, 0.76), 0.04, 0.11, p.metal, p.dark, 16);
      continue;
    }
    const Eigen::Vector3d size{rng.uniform(0.12, 0.25), rng.uniform(0.15, 0.3), rng.uniform(0.02, 0.2)};
    b.boxAt(x, y, 0.76, rng.uniform(-1, 1), size, p.cardboard, i % 2 ? p.white : p.cardboard);
  }
  plant(&b, p, 0.6, 8.4, 1.7, &rng);
  plant(&b, p, 17.4, 0.6, 1.6, &rng);
  return b.finish();
}

}  // namespace vip_slam
