// SPDX-License-Identifier: BSD-3-Clause
// A corridor of identical bays: the same door, the same poster, the same lamp, eight times. A loop closer that trusts
// appearance alone fails here. Only the ends differ.
#include <cmath>

#include "scene_parts.h"

namespace vip_slam {

Scene buildAliasCorridor() {
  SceneBuilder b("alias_corridor");
  b.scene().light_spacing = 0.08f;
  Palette p = makePalette(&b, 29, 3, 0.006);
  const int bays = 8;
  const double bay = 4.0, length = bays * bay, w = 2.2, h = 2.8;  // textures repeat every bay, too
  b.floor(0, 0, length, w, 0, p.carpet);
  const int ceiling = b.ceiling(0, 0, length, w, h, p.ceiling);
  std::vector<Opening> doors;
  for (int i = 0; i < bays; ++i) {
    const auto s = static_cast<float>(i * bay + 1.5);
    doors.push_back({s, s + 0.95f, 2.1f, Opening::Kind::kClosed, 0.12f, p.door});
  }
  const int north = b.wall({0, w}, {length, w}, 0, h, p.wall, doors, p.carpet);
  const int south = b.wall({length, 0}, {0, 0}, 0, h, p.wall, doors, p.carpet);
  for (int i = 0; i < bays; ++i) {
    b.ceilingLamp(ceiling, (i + 0.5) * bay, w / 2, 1.2, 0.3, 9.0);
    for (int chart : {north, south}) {
      hangPoster(&b, chart, p, 0, i * bay + 3.3, 1.55, 0.8);
      socket(&b, chart, i * bay + 0.6);
    }
  }
  const int west = b.wall({0, 0}, {0, w}, 0, h, p.wall);
  const int east = b.wall({length, w}, {length, 0}, 0, h, p.wall);
  hangPoster(&b, west, p, 1, w / 2, 1.6, 1.1);
  hangPoster(&b, east, p, 2, w / 2, 1.6, 1.1);
  return b.finish();
}

}  // namespace vip_slam
