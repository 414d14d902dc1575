// SPDX-License-Identifier: BSD-3-Clause
// An attic, 9 x 5.6 m: the roof comes down to a metre on both sides, a chimney, a dormer, low furniture and a half-open
// door. Little stands upright, and much is slanted.
#include <cmath>

#include "scene_parts.h"

namespace vip_slam {

Scene buildAttic() {
  SceneBuilder b("attic");
  b.scene().light_spacing = 0.05f;
  Palette p = makePalette(&b, 41, 10, 0.012);
  Rng rng(12);
  const double L = 9, W = 5.6, eave = 1.05, top = 2.35, in = 1.55;  // the roof meets the ceiling `in` from each side
  const int floor = b.floor(0, 0, L, W, 0, p.wood);
  b.decal(floor, 3.0, 1.6, 5.6, 3.6, -1, rgb(0.46f, 0.32f, 0.34f));
  b.decal(floor, 3.2, 1.8, 5.4, 3.4, -1, rgb(0.55f, 0.42f, 0.38f));
  for (int i = 0; i < 6; ++i) {
    const double u = rng.uniform(0.8, 8.0), v = rng.uniform(0.6, 5.0);
    b.decal(floor, u, v, u + 0.21, v + 0.3, p.posters[i]);
  }
  const int ceiling = b.ceiling(0, in, L, W - in, top, p.ceiling);
  for (int i = 0; i < 3; ++i) b.ceilingLamp(ceiling, 1.5 + 3.0 * i, (W - 2 * in) / 2, 0.5, 0.5, 14.0);
  const Eigen::Vector3d along(L, 0, 0);
  const int roof_s = b.rectangle({0, in, top}, along, {0, -in, eave - top}, p.wall);
  const int roof_n = b.rectangle({0, W, eave}, along, {0, -in, top - eave}, p.wall);
  for (int i = 0; i < 3; ++i) {
    b.decal(roof_s, 1.0 + 2.9 * i, 0.5, 1.9 + 2.9 * i, 1.6, p.blinds);  // skylights
    hangPoster(&b, roof_n, p, i, 0.9 + 2.3 * i, 1.0, 0.8);
  }
  // Gables extend up behind the roof's slopes; the half-open door leads nowhere.
  const int west =
      b.wall({0, 0}, {0, W}, 0, top, p.wall, {{2.4f, 3.25f, 1.95f, Opening::Kind::kClosed, 0.35f, p.door}}, p.carpet);
  b.wall({0, W}, {L, W}, 0, eave, p.wall);
  const int east = b.wall({L, W}, {L, 0}, 0, top, p.wall);
  b.wall({L, 0}, {0, 0}, 0, eave, p.wall);
  b.boxAt(0.36, 3.5, 0, M_PI / 2 - 0.9, {0.04, 0.8, 1.92}, p.wood, p.wood);
  hangPoster(&b, west, p, 4, 1.5, 1.3, 0.8);
  hangPoster(&b, west, p, 5, 4.3, 1.3, 0.7);
  b.decal(east, 2.2, 0.9, 3.4, 1.9, p.blinds);
  hangPoster(&b, east, p, 6, 1.6, 1.4, 0.7);
  hangPoster(&b, east, p, 7, 4.2, 1.4, 0.7);
  // Chimney, a beam under the ceiling, a partition of half the height with a rail on it.
  b.boxAt(6.2, 4.3, 0, 0, {0.6, 0.6, top}, p.cardboard, p.cardboard);
  b.boxAt(4.5, W / 2, top - 0.18, 0, {0.16, W - 2 * in, 0.18}, p.wood, p.wood);
  b.boxAt(2.2, 1.0, 0, 0, {0.1, 1.9, 1.1}, p.white, p.wood);
  // A mattress, a low table with things on it, shelves under the slope, chests.
  const Material cloth{-1, 1, rgb(0.62f, 0.60f, 0.66f)};
  b.boxAt(7.8, 1.2, 0, 0, {2.0, 1.4, 0.28}, cloth, cloth);
  b.boxAt(8.5, 1.2, 0.28, 0, {0.4, 0.7, 0.12}, p.white, p.white);
  b.boxAt(4.3, 2.5, 0.36, 0.2, {1.3, 0.9, 0.05}, p.wood, p.wood);
  for (double sx : {-0.5, 0.5})
    for (double sy : {-0.3, 0.3}) b.boxAt(4.3 + sx, 2.5 + sy, 0, 0.2, {0.06, 0.06, 0.36}, p.dark, p.dark);
  b.boxAt(4.1, 2.4, 0.41, 0.5, {0.3, 0.21, 0.03}, p.dark, p.white);
  b.boxAt(4.6, 2.7, 0.41, -0.3, {0.24, 0.3, 0.06}, p.cardboard, p.cardboard);
  b.cylinder(uprightPose(4.7, 2.3, 0.41), 0.05, 0.12, p.metal, p.dark, 16);
  for (int i = 0; i < 3; ++i) {
    const double x = 3.4 + 1.3 * i;
    b.boxAt(x, 0.25, 0, M_PI / 2, {0.5, 1.25, 0.8}, p.wood, p.wood);
    b.decal(b.boxAt(x, 0.51, 0.05, M_PI / 2, {0.03, 1.2, 0.7}, p.white, p.white), 0.1, 0.1, 1.1, 0.6, p.books[i]);
  }
  boxStack(&b, p, 1.0, 5.1, &rng, 1);
  boxStack(&b, p, 1.7, 5.0, &rng, 2);
  boxStack(&b, p, 4.2, 5.0, &rng, 1);
  boxStack(&b, p, 8.4, 5.0, &rng, 2);
  b.boxAt(2.9, 4.9, 0, 0.25, {1.0, 0.55, 0.5}, p.wood, p.wood);
  chair(&b, p, 5.6, 3.4, 2.4);
  b.sphere({7.2, 4.9, 0.24}, 0.24, {-1, 1, rgb(0.3f, 0.5f, 0.7f)}, 30);
  return b.finish();
}

}  // namespace vip_slam
