// SPDX-License-Identifier: BSD-3-Clause
// Furniture and fittings shared by the scenes.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "vip_slam_sim/rng.h"
#include "vip_slam_sim/scene/procedural.h"
#include "vip_slam_sim/scene/scene_builder.h"

namespace vip_slam {

/// The materials and pictures available to a scene.
struct Palette {
  Material wall, carpet, ceiling, wood, white, dark, metal, cardboard;
  std::vector<int> posters, photographs, screens, books, signs;
  int door = -1, blinds = -1, exit_sign = -1;
};
/// `contrast` scales the texture contrast of carpet, ceiling and doors (walls: `wall_contrast`).
Palette makePalette(SceneBuilder* builder, std::uint64_t seed, int posters, double wall_contrast,
                    double contrast = 1.0);

/// A poster of height `h` (sides 7:10) with its middle at (u, v).
void hangPoster(SceneBuilder* b, int chart, const Palette& p, int which, double u, double v, double h);
/// Dark strip along the foot of a wall between s0 and s1.
void skirting(SceneBuilder* b, int chart, double s0, double s1);
/// Socket pair 30 cm above the floor; a light switch at 1.05 m.
void socket(SceneBuilder* b, int chart, double u);
void lightSwitch(SceneBuilder* b, int chart, double u);
/// Desk with its middle at (x, y), `yaw` = the side where one sits looking along +yaw.
void desk(SceneBuilder* b, const Palette& p, double x, double y, double yaw, Rng* rng, bool monitor = true);
void chair(SceneBuilder* b, const Palette& p, double x, double y, double yaw);
/// Shelf against a wall: front looks along yaw.
void shelf(SceneBuilder* b, const Palette& p, double x, double y, double yaw, double width, double height, int books);
void plant(SceneBuilder* b, const Palette& p, double x, double y, double height, Rng* rng);
void boxStack(SceneBuilder* b, const Palette& p, double x, double y, Rng* rng, int count);

Eigen::Isometry3d uprightPose(double x, double y, double z, double yaw = 0);

// The scenes.
Scene buildRoom();
Scene buildOffice(bool bare);
Scene buildStairs();
Scene buildAliasCorridor();
Scene buildAttic();
Scene buildGallery();
Scene buildWorkshop();
Scene buildFoyer();

}  // namespace vip_slam
