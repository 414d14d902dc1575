// SPDX-License-Identifier: BSD-3-Clause
// A stairwell, 12 x 8 m under a pitched roof: a flight of steps and a ramp lead to a gallery. Slanted planes abound.
#include <cmath>

#include "scene_parts.h"

namespace vip_slam {

Scene buildStairs() {
  SceneBuilder b("stairs");
  b.scene().light_spacing = 0.06f;
  Palette p = makePalette(&b, 17, 8, 0.010);
  Rng rng(8);
  const double L = 12, W = 8, eave = 3.2, ridge = 5.2;
  const int floor = b.floor(0, 0, L, W, 0, p.carpet);
  b.decal(floor, 1.0, 3.0, 2.2, 5.0, -1, rgb(0.35f, 0.36f, 0.40f));

  // Roof: two slopes meeting over y = W/2, the normals point down and inwards.
  const Eigen::Vector3d along(L, 0, 0);
  const int roof_s = b.rectangle({0, W / 2, ridge}, along, {0, -W / 2, eave - ridge}, p.ceiling);
  const int roof_n = b.rectangle({0, W, eave}, along, {0, -W / 2, ridge - eave}, p.ceiling);
  for (int i = 0; i < 4; ++i) {
    b.ceilingLamp(roof_s, 1.5 + 3.0 * i, 2.6, 1.2, 0.4, 8.0);
    b.ceilingLamp(roof_n, 1.5 + 3.0 * i, 1.9, 1.2, 0.4, 8.0);
  }
  const int west =
      b.wall({0, 0}, {0, W}, 0, ridge, p.wall, {{3.5f, 4.45f, 2.1f, Opening::Kind::kClosed, 0.12f, p.door}}, p.carpet);
  const int north = b.wall({0, W}, {L, W}, 0, eave, p.wall);
  const int east = b.wall({L, W}, {L, 0}, 0, ridge, p.wall);
  const int south = b.wall({L, 0}, {0, 0}, 0, eave, p.wall);
  hangPoster(&b, west, p, 0, 2.2, 1.6, 0.9);
  b.decal(west, 5.4, 1.2, 6.6, 2.0, p.photographs[0]);
  hangPoster(&b, north, p, 1, 1.5, 1.6, 0.9);
  b.decal(north, 5.0, 2.0, 6.4, 2.9, p.blinds);
  hangPoster(&b, north, p, 2, 9.8, 2.3, 0.9);
  hangPoster(&b, east, p, 3, 1.8, 2.6, 1.0);
  b.decal(east, 3.4, 2.2, 4.8, 3.2, p.photographs[1]);
  hangPoster(&b, east, p, 4, 6.2, 2.6, 1.0);
  hangPoster(&b, south, p, 5, 2.0, 2.2, 0.9);
  hangPoster(&b, south, p, 6, 7.0, 1.5, 0.9);
  b.decal(south, 9.4, 1.2, 10.8, 2.1, p.photographs[2]);
  for (int chart : {north, south}) skirting(&b, chart, 0, L);
  skirting(&b, east, 0, W);

  // Gallery at the east end, 1.4 m up.
  const double gx = 9.0, gz = 1.4;
  b.boxAt((gx + L) / 2, W / 2, 0, 0, {L - gx, W, gz}, p.wall, p.carpet);
  // Steps on the north half: 8 rises of 17.5 cm.
  const int rises = 8;
  const double rise = gz / rises, tread = 0.29;
  for (int k = 0; k < rises - 1; ++k) {
    const double x = gx - tread * (rises - 1 - k), h = rise * (k + 1);
    const int first = b.boxAt((x + gx) / 2, 6.2, 0, 0, {gx - x, 2.0, h}, p.wall, p.carpet);
    b.decal(first + 4, 0.01, 0, 0.05, 2.0, -1, rgb(0.75f, 0.72f, 0.3f));  // nosing
  }
  // Ramp on the south half: 1.4 m over 6 m.
  const double ramp = 6.0;
  const Eigen::Vector3d r0(gx - ramp, 0.8, 0), up(ramp, 0, gz);
  const int slope = b.rectangle(r0, up, {0, 2.0, 0}, p.carpet);
  for (int i = 0; i < 6; ++i) b.decal(slope, 0.6 + i, 0.1, 0.68 + i, 1.9, -1, rgb(0.68f, 0.66f, 0.35f));
  // Its flanks are right triangles, approximated by narrow panels, each low enough not to protrude through the slope.
  const int slices = 40;
  for (int side = 0; side < 2; ++side)
    for (int k = 0; k < slices; ++k) {
      const double a = ramp * k / slices, c = ramp * (k + 1) / slices, h = gz * a / ramp;
      if (h < 1e-3) continue;
      const double y = side ? 2.8 : 0.8;
      if (side)
        b.rectangle({gx - ramp + c, y, 0}, {a - c, 0, 0}, {0, 0, h}, p.wall);
      else
        b.rectangle({gx - ramp + a, y, 0}, {c - a, 0, 0}, {0, 0, h}, p.wall);
    }
  // Railings, a bench, boxes.
  for (double y : {3.2, 4.0, 4.8}) b.cylinder(uprightPose(gx + 0.06, y, gz), 0.025, 1.0, p.metal, p.metal, 12);
  b.boxAt(gx + 0.06, 4.0, gz + 1.0, 0, {0.06, 1.8, 0.05}, p.wood, p.wood);
  b.boxAt(1.2, 0.4, 0, M_PI / 2, {0.4, 1.6, 0.45}, p.wood, p.wood);
  boxStack(&b, p, 0.7, 7.2, &rng, 2);
  boxStack(&b, p, 4.2, 7.4, &rng, 1);
  plant(&b, p, 0.6, 1.4, 1.5, &rng);
  shelf(&b, p, 11.81, 6.8, M_PI, 1.2, 1.2, 0);
  return b.finish();
}

}  // namespace vip_slam
