// SPDX-License-Identifier: BSD-3-Clause
// A foyer, 17 x 9.6 m, in which little is at right angles: walls that bend by 8 to 60 degrees, a ramp for wheelchairs
// (4 degrees) to a landing, a step of 10 cm, boards that lean, counters and columns at odd angles, a sloping soffit.
#include <array>
#include <cmath>

#include "scene_parts.h"
#include "vip_slam_core/geometry/angle.h"

namespace vip_slam {

Scene buildFoyer() {
  SceneBuilder b("foyer");
  b.scene().light_spacing = 0.08f;
  Palette p = makePalette(&b, 67, 12, 0.008);
  Rng rng(91);
  const double H = 3.1;
  b.floor(0, 0, 17, 9.6, 0, p.carpet);
  for (int i = 0; i < 2; ++i) {
    const int ceiling = b.ceiling(8.5 * i, 0, 8.5 * i + 8.5, 9.6, H, p.ceiling);
    for (int k = 0; k < 3; ++k)
      for (int j = 0; j < 2; ++j) b.ceilingLamp(ceiling, 1.6 + 2.6 * k, 2.4 + 4.4 * j, 1.2, 0.4, 10.0);
  }
  // Clockwise; the north side bends by 8, 10 and 12 degrees, all of them near what still counts as one direction.
  const std::array<Eigen::Vector2d, 11> corner = {{{0, 0},
                                                   {0, 5},
                                                   {1.5, 7.6},
                                                   {4.3, 9.1},
                                                   {7.3, 9.5},
                                                   {10.3, 9.5},
                                                   {13.25, 9.0},
                                                   {16, 7.9},
                                                   {17, 5},
                                                   {16.4, 1.8},
                                                   {13.5, 0}}};
  std::array<int, 11> wall{};
  for (std::size_t i = 0; i < corner.size(); ++i) {
    const Eigen::Vector2d from = corner[i], to = corner[(i + 1) % corner.size()];
    std::vector<Opening> openings;
    if (i == 0) openings.push_back({1.9f, 2.9f, 2.1f, Opening::Kind::kClosed, 0.1f, p.door});
    if (i == 5) openings.push_back({1.0f, 2.0f, 2.1f, Opening::Kind::kClosed, 0.12f, p.door});
    wall[i] = b.wall(from, to, 0, H, p.wall, openings, p.carpet);
    const double length = (to - from).norm();
    if (i % 2 == 0)
      hangPoster(&b, wall[i], p, static_cast<int>(i), 0.25 * length, 1.6, 0.9);
    else
      b.decal(wall[i], 0.62 * length, 1.2, 0.62 * length + 0.9, 1.8, p.photographs[i % p.photographs.size()]);
  }
  for (int i = 1; i < 4; ++i) hangPoster(&b, wall[10], p, 6 + i, 3.3 * i, 1.9, 0.9);
  socket(&b, wall[4], 1.2);
  socket(&b, wall[10], 12.2);
  lightSwitch(&b, wall[0], 3.3);

  // Along the south wall a ramp up to the landing, 0.30 m over 4.2 m, and steps down from it; a kerb stands at its
  // edge.
  const double rise = 0.3, foot = 3.4, head = 7.6, end = 10.4, width = 1.7;
  const int slope = b.rectangle({foot, 0, 0}, {head - foot, 0, rise}, {0, width, 0}, p.carpet);
  for (int i = 0; i < 4; ++i) b.decal(slope, 0.5 + i, 0.05, 0.56 + i, width - 0.05, -1, rgb(0.68f, 0.66f, 0.35f));
  b.boxAt((head + end) / 2, width / 2, 0, 0, {end - head, width, rise}, p.wall, p.carpet);
  b.boxAt(end + 0.15, width / 2, 0, 0, {0.3, width, rise / 2}, p.wall, p.carpet);
  b.boxAt((foot + end) / 2, width + 0.04, 0, 0, {end - foot, 0.08, rise + 0.12}, p.white, p.wood);
  for (int i = 0; i < 5; ++i)
    b.cylinder(uprightPose(foot + 0.3 + 1.6 * i, width + 0.04, rise + 0.12), 0.02, 0.55, p.metal, p.metal, 10);

  // A soffit that slopes by 6 degrees under the ceiling in the east, a platform one low step up beneath it.
  b.rectangle({12.2, 7.0, 2.55}, {0, -4.6, 0}, {0, 0, 0.12}, p.white);
  b.rectangle({12.2, 7.0, 2.55}, {3.6, 0, 0.38}, {0, -4.6, 0}, p.ceiling);
  b.boxAt(13.8, 4.6, 0, 0.26, {2.6, 2.4, 0.10}, p.wood, p.wood);

  // Boards that lean: on the bent wall by 8 degrees, and on a stand of their own by 15.
  const auto lean = [&](double x, double y, double yaw, double tilt, double w, double h, int picture) {
    Eigen::Isometry3d pose = uprightPose(x, y, 0, yaw);
    pose.linear() = pose.linear() * Eigen::AngleAxisd(-tilt, Eigen::Vector3d::UnitY()).toRotationMatrix();
    pose.translation() += pose.linear() * Eigen::Vector3d(0, 0, h / 2) + Eigen::Vector3d(0, 0, 0.02);
    const int first = b.box(pose, {0.03, w, h}, p.white, p.white);
    hangPoster(&b, first, p, picture, w / 2, h / 2, 0.8);
  };
  lean(8.6, 9.05, -M_PI / 2, 8 * kDegree, 1.6, 1.7, 10);
  lean(5.6, 5.9, 0.4, 15 * kDegree, 1.3, 1.6, 11);

  // A counter with a bend, hexagonal columns of three boxes each, benches, a board 12 cm before the west wall.
  b.boxAt(9.6, 5.4, 0, 0.35, {0.6, 2.2, 1.05}, p.wood, p.white);
  b.boxAt(9.05, 7.35, 0, 0.18 + M_PI / 4, {0.6, 2.0, 1.05}, p.wood, p.white);
  for (const auto& [x, y] : {std::pair{4.5, 6.7}, std::pair{12.0, 2.9}, std::pair{6.9, 3.3}})
    for (int k = 0; k < 3; ++k) b.boxAt(x, y, 0, k * M_PI / 3, {0.26, 0.45, H}, p.wall, p.wall);
  b.boxAt(0.06, 1.0, 0.3, 0, {0.12, 1.2, 2.2}, p.white, p.white);
  b.boxAt(3.0, 4.1, 0.40, 1.1, {0.5, 1.8, 0.06}, p.wood, p.wood);
  for (double d : {-0.7, 0.7})
    b.boxAt(3.0 - d * std::sin(1.1), 4.1 + d * std::cos(1.1), 0, 1.1, {0.45, 0.08, 0.40}, p.dark, p.dark);
  chair(&b, p, 14.9, 7.3, 3.9);
  chair(&b, p, 1.1, 4.6, -0.6);
  desk(&b, p, 1.7, 6.3, 2.1, &rng);
  shelf(&b, p, 15.75, 3.0, M_PI * 0.95, 1.2, 1.5, 1);
  boxStack(&b, p, 11.2, 7.9, &rng, 2);
  boxStack(&b, p, 14.6, 1.5, &rng, 1);
  plant(&b, p, 0.6, 4.3, 1.6, &rng);
  plant(&b, p, 12.7, 0.7, 1.5, &rng);
  b.sphere({6.2, 7.9, 0.35}, 0.35, {-1, 1, rgb(0.7f, 0.5f, 0.3f)}, 28);
  return b.finish();
}

}  // namespace vip_slam
