// SPDX-License-Identifier: BSD-3-Clause
// A motion-capture room, 9 x 7 x 4 m: mats on the floor, posters, furniture along the walls, the middle free to fly.
#include "scene_parts.h"

namespace vip_slam {

Scene buildRoom() {
  SceneBuilder b("room");
  b.scene().light_spacing = 0.05f;
  Palette p = makePalette(&b, 11, 16, 0.012);
  Rng rng(5);
  const double X = 4.5, Y = 3.5, H = 4.0;

  const int floor = b.floor(-X, -Y, X, Y, 0, p.carpet);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 3; ++j) {  // exercise mats
      const double u = 2.0 + i * 1.3, v = 1.6 + j * 1.3;
      const float s = static_cast<float>(0.9 + 0.1 * ((i + j) % 2));
      b.decal(floor, u, v, u + 1.26, v + 1.26, -1, rgb(0.30f * s, 0.42f * s, 0.58f * s));
    }
  for (int i = 0; i < 9; ++i) {  // tape marks and scattered papers
    const double u = rng.uniform(1.2, 7.6), v = rng.uniform(1.0, 5.8);
    b.decal(floor, u, v, u + 0.35, v + 0.05, -1, rgb(0.9f, 0.8f, 0.2f));
    const double u2 = rng.uniform(1.2, 7.6), v2 = rng.uniform(1.0, 5.8);
    b.decal(floor, u2, v2, u2 + 0.21, v2 + 0.3, p.posters[i % p.posters.size()]);
  }
  const int ceiling = b.ceiling(-X, -Y, X, Y, H, p.ceiling);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 2; ++j) b.ceilingLamp(ceiling, 1.5 + 3.0 * i, 1.75 + 3.5 * j, 1.2, 0.6, 9.0);
  for (int i = 0; i < 4; ++i) {  // air outlets
    const double u = 0.7 + 2.4 * i;
    for (int k = 0; k < 5; ++k)
      b.decal(ceiling, u, 3.2 + 0.1 * k, u + 0.55, 3.24 + 0.1 * k, -1, rgb(0.45f, 0.45f, 0.47f));
  }

  Opening door{5.4f, 6.35f, 2.1f, Opening::Kind::kClosed, 0.12f, p.door};
  const int west = b.wall({-X, -Y}, {-X, Y}, 0, H, p.wall, {door}, p.carpet);
  const int north = b.wall({-X, Y}, {X, Y}, 0, H, p.wall);
  const int east = b.wall({X, Y}, {X, -Y}, 0, H, p.wall);
  const int south = b.wall({X, -Y}, {-X, -Y}, 0, H, p.wall);
  skirting(&b, west, 0, 5.33);
  skirting(&b, west, 6.42, 2 * Y);
  skirting(&b, north, 0, 2 * X);
  skirting(&b, east, 0, 2 * Y);
  skirting(&b, south, 0, 2 * X);
  // posters, pictures, a whiteboard and windows
  hangPoster(&b, west, p, 0, 0.8, 1.7, 1.0);
  hangPoster(&b, west, p, 1, 1.9, 1.6, 1.2);
  hangPoster(&b, west, p, 2, 4.7, 1.8, 0.8);
  hangPoster(&b, west, p, 12, 3.3, 2.9, 0.9);
  hangPoster(&b, north, p, 3, 0.9, 1.9, 1.1);
  b.decal(north, 2.0, 1.0, 4.4, 2.2, -1, rgb(0.6f, 0.6f, 0.62f));
  b.decal(north, 2.04, 1.04, 4.36, 2.16,
          b.addTexture(sign(640, 310, "plan: f = m a", {.93f, .93f, .94f}, {.2f, .25f, .5f}), false));
  hangPoster(&b, north, p, 4, 5.3, 1.8, 1.2);
  hangPoster(&b, north, p, 5, 7.9, 2.2, 1.0);
  hangPoster(&b, north, p, 13, 6.6, 3.0, 0.9);
  b.decal(east, 0.8, 1.0, 2.6, 2.6, p.blinds);
  b.decal(east, 4.4, 1.0, 6.2, 2.6, p.blinds);
  hangPoster(&b, east, p, 6, 3.5, 1.9, 1.2);
  hangPoster(&b, south, p, 7, 1.0, 1.7, 1.1);
  hangPoster(&b, south, p, 8, 2.3, 2.1, 0.9);
  b.decal(south, 3.2, 1.4, 4.4, 2.25, p.photographs[0]);
  hangPoster(&b, south, p, 9, 5.4, 1.8, 1.2);
  hangPoster(&b, south, p, 14, 6.6, 2.9, 0.9);
  b.decal(south, 7.3, 1.3, 8.3, 2.0, p.photographs[1]);
  for (double u : {0.5, 4.5})
    socket(&b, west, u), socket(&b, north, u + 1), socket(&b, east, u + 0.5), socket(&b, south, u);
  lightSwitch(&b, west, 5.1);

  // furniture along the walls
  shelf(&b, p, X - 0.19, 0.0, M_PI, 1.2, 1.9, 0);
  shelf(&b, p, 1.6, Y - 0.19, -M_PI / 2, 1.4, 1.7, 1);
  desk(&b, p, -3.9, -1.9, M_PI, &rng);
  chair(&b, p, -3.1, -1.9, M_PI);
  desk(&b, p, 2.6, -2.9, -M_PI / 2, &rng);
  chair(&b, p, 2.7, -2.2, -M_PI / 2 + 0.4);
  boxStack(&b, p, -3.9, 2.9, &rng, 3);
  boxStack(&b, p, 3.8, 2.9, &rng, 2);
  boxStack(&b, p, 3.9, -2.4, &rng, 1);
  b.cylinder(uprightPose(-4.0, 0.3, 0), 0.22, 0.65, {-1, 1, rgb(0.30f, 0.45f, 0.38f)}, p.dark, 40);
  b.cylinder(uprightPose(-1.2, -3.1, 0), 0.28, 0.9, p.cardboard, p.white, 40);
  b.cylinder(uprightPose(0.2, 3.15, 0), 0.2, 1.4, p.metal, p.metal, 40);
  b.sphere({-2.0, -2.95, 0.33}, 0.33, {-1, 1, rgb(0.72f, 0.30f, 0.25f)}, 36);
  plant(&b, p, 4.0, -3.0 + 1.6, 1.5, &rng);
  // a board leaning on the south wall: a general plane
  Eigen::Isometry3d lean = uprightPose(0.6, -Y + 0.33, 0.62, 0);
  lean.linear() = Eigen::AngleAxisd(0.45, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const int board = b.box(lean, {1.3, 0.04, 1.3}, p.wood, p.wood);
  b.decal(board + 2, 0.15, 0.15, 1.15, 1.15,
          b.addTexture(checkers(256, 8, {.85f, .85f, .85f}, {.15f, .15f, .17f}), false));
  // a low ramp wedge of boxes and a turned crate in the open
  boxStack(&b, p, -1.9, 2.6, &rng, 1);
  b.boxAt(2.7, 1.2, 0, 0.6, {0.6, 0.6, 0.45}, p.cardboard, p.cardboard);
  b.boxAt(-2.4, 0.6, 0, -0.35, {0.5, 0.8, 0.3}, p.wood, p.wood);
  return b.finish();
}

}  // namespace vip_slam
