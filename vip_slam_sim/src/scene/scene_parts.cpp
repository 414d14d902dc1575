// SPDX-License-Identifier: BSD-3-Clause
#include "scene_parts.h"

#include "scanned_room.h"

#include <cmath>
#include <stdexcept>

namespace vip_slam {

Palette makePalette(SceneBuilder* b, std::uint64_t seed, int posters, double wall_contrast, double contrast) {
  Palette p;
  p.wall = {b->addTexture(plaster(1024, {0.91f, 0.91f, 0.90f}, wall_contrast, seed + 1), true), 256};
  p.carpet = {
      b->addTexture(
          tiles(1024, 8, {0.52f, 0.53f, 0.56f}, 0.028 * contrast, 0.09 * contrast, 0.010 * contrast, seed + 2), true),
      256};
  p.ceiling = {
      b->addTexture(
          tiles(1024, 4, {0.93f, 0.93f, 0.92f}, 0.012 * contrast, 0.08 * contrast, 0.003 * contrast, seed + 3), true),
      1024 / 2.4f};
  p.wood = {b->addTexture(wood(512, {0.72f, 0.60f, 0.46f}, 0.05, seed + 4), true), 400};
  p.white = {-1, 1, rgb(0.86f, 0.86f, 0.85f)};
  p.dark = {-1, 1, rgb(0.24f, 0.24f, 0.26f)};
  p.metal = {-1, 1, rgb(0.62f, 0.63f, 0.65f)};
  p.cardboard = {b->addTexture(cardboard(512, seed + 5), true), 900};
  for (int i = 0; i < posters; ++i) p.posters.push_back(b->addTexture(poster(350, 500, seed * 31 + i), false));
  for (int i = 0; i < 4; ++i) p.photographs.push_back(b->addTexture(photograph(420, 300, seed * 37 + i), false));
  for (int i = 0; i < 3; ++i) p.screens.push_back(b->addTexture(screen(400, 240, seed * 41 + i), false));
  for (int i = 0; i < 3; ++i) p.books.push_back(b->addTexture(bookshelf(512, 768, 5, seed * 43 + i), false));
  p.door = b->addTexture(wood(512, {0.70f, 0.58f, 0.45f}, 0.035 * contrast, seed + 6), true);
  p.blinds = b->addTexture(blinds(512, 512, seed + 7), false);
  p.exit_sign = b->addTexture(sign(256, 96, "EXIT", {0.1f, 0.55f, 0.3f}, {0.95f, 0.95f, 0.95f}), false);
  return p;
}

Eigen::Isometry3d uprightPose(double x, double y, double z, double yaw) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = Eigen::Vector3d(x, y, z);
  return pose;
}

void hangPoster(SceneBuilder* b, int chart, const Palette& p, int which, double u, double v, double h) {
  const double w = 0.7 * h;
  b->decal(chart, u - w / 2, v - h / 2, u + w / 2, v + h / 2, p.posters[which % p.posters.size()]);
}

void skirting(SceneBuilder* b, int chart, double s0, double s1) {
  b->decal(chart, s0, 0, s1, 0.09, -1, rgb(0.55f, 0.54f, 0.52f));
}

void socket(SceneBuilder* b, int chart, double u) {
  for (int k = 0; k < 2; ++k) {
    const double c = u + 0.09 * k;
    b->decal(chart, c - 0.04, 0.26, c + 0.04, 0.34, -1, rgb(0.97f, 0.97f, 0.96f));
    b->decal(chart, c - 0.022, 0.278, c + 0.022, 0.322, -1, rgb(0.55f, 0.55f, 0.55f));
  }
}

void lightSwitch(SceneBuilder* b, int chart, double u) {
  b->decal(chart, u - 0.045, 1.01, u + 0.045, 1.10, -1, rgb(0.80f, 0.80f, 0.78f));
  b->decal(chart, u - 0.03, 1.025, u + 0.03, 1.085, -1, rgb(0.97f, 0.97f, 0.96f));
}

void desk(SceneBuilder* b, const Palette& p, double x, double y, double yaw, Rng* rng, bool monitor) {
  const Eigen::Isometry3d at = uprightPose(x, y, 0, yaw);
  const auto place = [&](double dx, double dy, double z, const Eigen::Vector3d& size, const Material& m,
                         const Material& top) {
    const Eigen::Vector3d q = at * Eigen::Vector3d(dx, dy, 0);
    return b->boxAt(q.x(), q.y(), z, yaw, size, m, top);
  };
  place(0, 0, 0.70, {0.8, 1.6, 0.04}, p.white, p.wood);
  for (double sx : {-0.36, 0.36})
    for (double sy : {-0.75, 0.75}) place(sx, sy, 0, {0.05, 0.05, 0.70}, p.metal, p.metal);
  place(0.10, -0.52, 0.02, {0.55, 0.40, 0.56}, p.white, p.white);
  if (monitor) {
    const int front = place(0.22, 0.1, 0.86, {0.04, 0.56, 0.34}, p.dark, p.dark);
    b->decal(front + 1, 0, 0, 0.56, 0.34, p.screens[rng->integer(static_cast<int>(p.screens.size()))]);
    place(0.22, 0.1, 0.74, {0.16, 0.2, 0.015}, p.dark, p.dark);
    place(0.24, 0.1, 0.75, {0.03, 0.06, 0.14}, p.dark, p.dark);
    place(-0.12, 0.1, 0.74, {0.14, 0.42, 0.02}, p.dark, p.dark);
  }
  const Eigen::Vector3d cup = at * Eigen::Vector3d(-0.05, 0.6, 0);
  b->cylinder(uprightPose(cup.x(), cup.y(), 0.74), 0.04, 0.1, {-1, 1, rgb(0.75f, 0.25f, 0.2f)}, p.dark, 16);
}

void chair(SceneBuilder* b, const Palette& p, double x, double y, double yaw) {
  const Eigen::Isometry3d at = uprightPose(x, y, 0, yaw);
  const Material cloth{-1, 1, rgb(0.30f, 0.34f, 0.46f)};
  b->boxAt(x, y, 0.43, yaw, {0.46, 0.46, 0.07}, cloth, cloth);
  const Eigen::Vector3d back = at * Eigen::Vector3d(-0.22, 0, 0);
  b->boxAt(back.x(), back.y(), 0.55, yaw, {0.05, 0.44, 0.45}, cloth, cloth);
  b->cylinder(uprightPose(x, y, 0.06), 0.03, 0.37, p.metal, p.metal, 12);
  b->cylinder(uprightPose(x, y, 0.0), 0.24, 0.06, p.dark, p.dark, 20);
}

void shelf(SceneBuilder* b, const Palette& p, double x, double y, double yaw, double width, double height, int books) {
  const int front = b->boxAt(x, y, 0, yaw, {0.36, width, height}, p.wood, p.wood);
  b->decal(front, 0.03, 0.06, width - 0.03, height - 0.03, p.books[books % p.books.size()]);
}

void plant(SceneBuilder* b, const Palette& p, double x, double y, double height, Rng* rng) {
  b->cylinder(uprightPose(x, y, 0), 0.17, 0.34, {-1, 1, rgb(0.62f, 0.42f, 0.32f)}, p.dark, 24);
  b->cylinder(uprightPose(x, y, 0.34), 0.025, height - 0.7, {-1, 1, rgb(0.42f, 0.36f, 0.26f)}, p.dark, 8);
  for (int k = 0; k < 4; ++k) {
    const float g = static_cast<float>(rng->uniform(0.40, 0.55));
    b->sphere({x + rng->uniform(-0.12, 0.12), y + rng->uniform(-0.12, 0.12), height - 0.25 - 0.13 * k},
              rng->uniform(0.16, 0.24), {-1, 1, rgb(0.28f, g, 0.26f)}, 20);
  }
}

void boxStack(SceneBuilder* b, const Palette& p, double x, double y, Rng* rng, int count) {
  double z = 0;
  for (int k = 0; k < count; ++k) {
    const Eigen::Vector3d size(rng->uniform(0.35, 0.55), rng->uniform(0.4, 0.6), rng->uniform(0.3, 0.5));
    b->boxAt(x + rng->uniform(-.04, .04), y + rng->uniform(-.04, .04), z, rng->uniform(-0.3, 0.3), size, p.cardboard,
             p.cardboard);
    z += size.z();
  }
}

std::vector<std::string> sceneNames() {
  return {"office", "office_bare", "room", "stairs", "alias_corridor", "attic", "gallery", "workshop", "foyer"};
}

Scene buildScene(const std::string& name) {
  if (name == "office") return buildOffice(false);
  if (name == "office_bare") return buildOffice(true);
  if (name == "room") return buildRoom();
  if (name == "stairs") return buildStairs();
  if (name == "alias_corridor") return buildAliasCorridor();
  if (name == "attic") return buildAttic();
  if (name == "gallery") return buildGallery();
  if (name == "workshop") return buildWorkshop();
  if (name == "foyer") return buildFoyer();
  if (isScanFile(name)) return buildScannedRoom(name);
  std::string known;
  for (const std::string& n : sceneNames()) known += (known.empty() ? "" : ", ") + n;
  throw std::invalid_argument("scene '" + name + "' is not known, expected a scanned room (.json) or one of: " + known);
}

}  // namespace vip_slam
