// SPDX-License-Identifier: BSD-3-Clause
// An office floor, 44 x 22 m: a ring of corridors round a closed core, rooms to the north and south, and an open hall
// to the east. Long plain walls, faint carpet and ceiling tiles; pictures and fittings are far between, as in real
// ones.
#include <cmath>

#include "scene_parts.h"

namespace vip_slam {
namespace {

using Kind = Opening::Kind;

struct OfficePlan {
  explicit OfficePlan(bool without) : b(without ? "office_bare" : "office"), bare(without) {}

  SceneBuilder b;
  const bool bare;  ///< corridors without pictures, sockets or patterns
  Palette p;
  Rng rng{21};
  int number = 100;

  Opening closed(double s, double depth = 0.12) {
    return {float(s), float(s + 0.95), 2.1f, Kind::kClosed, float(depth), p.door};
  }
  Opening proud(double s, double depth) {
    return {float(s), float(s + 0.95), 2.1f, Kind::kProud, float(depth), p.door};
  }
  static Opening passage(double s, double width, double height, double depth = 0.2) {
    return {float(s), float(s + width), float(height), Kind::kPassage, float(depth)};
  }
  static Opening cut(double s, double width, double height) {
    return {float(s), float(s + width), float(height), Kind::kCut, 0};
  }
  /// Name plate beside a door that starts at s.
  void plate(int chart, double s) {
    const int t = b.addTexture(sign(160, 110, std::to_string(number++), {.92f, .92f, .91f}, {.2f, .22f, .3f}), false);
    b.decal(chart, s + 1.12, 1.45, s + 1.34, 1.60, t);
  }
  void lamps(int ceiling, double su, double sv, int nu, int nv, double power, double lu = 1.2, double lv = 0.3) {
    for (int i = 0; i < nu; ++i)
      for (int j = 0; j < nv; ++j) b.ceilingLamp(ceiling, su * (i + 0.5) / nu, sv * (j + 0.5) / nv, lu, lv, power);
  }

  void room(double x0, double y0, double x1, double y1, double h, const std::vector<Opening>& south,
            const std::vector<Opening>& north, int style);
  void corridors();
  void fittings(int south, int south_in, int west, int north, int north_in);
  void kitchen();
  void hall();
};

void OfficePlan::room(double x0, double y0, double x1, double y1, double h, const std::vector<Opening>& south,
                      const std::vector<Opening>& north, int style) {
  b.floor(x0, y0, x1, y1, 0, p.carpet);
  const int ceiling = b.ceiling(x0, y0, x1, y1, h, p.ceiling);
  lamps(ceiling, x1 - x0, y1 - y0, 2, 2, 8.0);
  const int west = b.wall({x0, y0}, {x0, y1}, 0, h, p.wall);
  const int top = b.wall({x0, y1}, {x1, y1}, 0, h, p.wall, north, p.carpet);
  const int east = b.wall({x1, y1}, {x1, y0}, 0, h, p.wall);
  const int bottom = b.wall({x1, y0}, {x0, y0}, 0, h, p.wall, south, p.carpet);
  skirting(&b, west, 0, y1 - y0);
  skirting(&b, east, 0, y1 - y0);
  const double w = x1 - x0, d = y1 - y0;
  if (north.empty()) b.decal(top, 0.8, 0.9, w - 0.8, 2.2, p.blinds);
  if (south.empty()) b.decal(bottom, 0.8, 0.9, w - 0.8, 2.2, p.blinds);
  hangPoster(&b, west, p, style, d * 0.5, 1.6, 0.8);
  hangPoster(&b, east, p, style + 3, d * 0.35, 1.6, 0.9);
  b.decal(east, d * 0.6, 1.3, d * 0.6 + 0.9, 1.95, p.photographs[style % p.photographs.size()]);
  socket(&b, west, 1.0);
  socket(&b, east, 2.0);
  desk(&b, p, x0 + 1.2, y0 + d * 0.5, M_PI, &rng);
  chair(&b, p, x0 + 2.0, y0 + d * 0.5, M_PI);
  desk(&b, p, x1 - 1.2, y0 + d * 0.3, 0, &rng);
  chair(&b, p, x1 - 2.0, y0 + d * 0.3, 0.2);
  shelf(&b, p, x1 - 0.19, y0 + d * 0.78, M_PI, 1.2, 1.8, style);
  plant(&b, p, x0 + 0.5, north.empty() ? y1 - 0.5 : y0 + 0.5, 1.4, &rng);
}

void OfficePlan::corridors() {
  const double h = 2.8;
  // One floor and ceiling per leg; together they are one plane each.
  b.floor(0, 6, 29.8, 8.2, 0, p.carpet);
  b.floor(0, 8.2, 2.2, 13.8, 0, p.carpet);
  b.floor(0, 13.8, 29.8, 16, 0, p.carpet);
  const int cs = b.ceiling(0, 6, 29.8, 8.2, h, p.ceiling);
  const int cw = b.ceiling(0, 8.2, 2.2, 13.8, h, p.ceiling);
  const int cn = b.ceiling(0, 13.8, 29.8, 16, h, p.ceiling);
  for (int chart : {cs, cn}) {
    if (!bare) {
      lamps(chart, 29.8, 2.2, 9, 1, 10.0);
      continue;
    }
    // One strip of light from end to end: it gives no cue about the position along the corridor.
    b.decal(chart, 1.0, 1.02, 28.8, 1.18, -1, rgb(1, 1, 1), 0.75);
    for (int i = 0; i < 18; ++i) b.lamp(chart, 1.0 + 27.8 * (i + 0.5) / 18, 1.1, 27.8 / 18, 0.16, 7.5);
  }
  lamps(cw, 2.2, 5.6, 1, 2, 10.0, 0.3, 1.2);

  // South corridor, outer wall (seen from the north, so it runs from east to west).
  std::vector<Opening> s = {passage(2.0, 1.0, 2.1), closed(6.5), closed(11.8), passage(17.3, 1.0, 2.1), closed(21.8)};
  const int south = b.wall({29.8, 6}, {0, 6}, 0, h, p.wall, s, p.carpet);
  for (double at : {2.0, 6.5, 11.8, 17.3, 21.8}) plate(south, at);
  // Its inner wall, against the core, with the kitchen niche.
  std::vector<Opening> si = {closed(3.8), cut(10.0, 3.0, 2.3), proud(18.0, 0.12), closed(23.0, 0.18)};
  const int south_in = b.wall({2.2, 8.2}, {29.8, 8.2}, 0, h, p.wall, si, p.carpet);
  plate(south_in, 3.8);
  plate(south_in, 23.0);
  // West leg.
  const int west = b.wall({0, 6}, {0, 16}, 0, h, p.wall);
  const int west_in = b.wall({2.2, 13.8}, {2.2, 8.2}, 0, h, p.wall, {closed(2.4)}, p.carpet);
  // North corridor.
  std::vector<Opening> n = {closed(5.2), passage(11.5, 1.0, 2.1), closed(16.5), proud(20.5, 0.08), closed(26.0)};
  const int north = b.wall({0, 16}, {29.8, 16}, 0, h, p.wall, n, p.carpet);
  for (double at : {5.2, 11.5, 16.5, 26.0}) plate(north, at);
  const int north_in = b.wall({29.8, 13.8}, {2.2, 13.8}, 0, h, p.wall, {closed(8.0), closed(19.5, 0.15)}, p.carpet);
  // Skirting stops at doors.
  const auto skirt = [&](int chart, double length, const std::vector<std::pair<double, double>>& gaps) {
    double from = 0;
    for (const auto& [a, z] : gaps) {
      skirting(&b, chart, from, a);
      from = z;
    }
    skirting(&b, chart, from, length);
  };
  skirt(south, 29.8, {{2, 3}, {6.43, 7.52}, {11.73, 12.82}, {17.3, 18.3}, {21.73, 22.82}});
  skirt(south_in, 27.6, {{3.73, 4.82}, {10, 13}, {18, 18.95}, {22.93, 24.02}});
  skirt(west, 10, {});
  skirt(west_in, 5.6, {{2.33, 3.42}});
  skirt(north, 29.8, {{5.13, 6.22}, {11.5, 12.5}, {16.43, 17.52}, {20.5, 21.45}, {25.93, 27.02}});
  skirt(north_in, 27.6, {{7.93, 9.02}, {19.43, 20.52}});
  if (!bare) fittings(south, south_in, west, north, north_in);
  kitchen();
}

void OfficePlan::fittings(int south, int south_in, int west, int north, int north_in) {
  // The few things on the walls. The south-west and north-west corners stay bare.
  hangPoster(&b, south, p, 0, 4.4, 1.55, 0.8);
  hangPoster(&b, south, p, 1, 15.2, 1.55, 0.8);
  b.decal(south_in, 7.2, 1.2, 8.4, 2.0, p.photographs[0]);
  hangPoster(&b, south_in, p, 2, 15.6, 1.6, 0.9);
  b.decal(south_in, 20.6, 1.15, 21.8, 1.95, p.photographs[1]);
  hangPoster(&b, south_in, p, 3, 26.0, 1.55, 0.8);
  b.decal(north, 8.4, 1.2, 9.6, 2.0, p.photographs[2]);
  hangPoster(&b, north, p, 4, 14.6, 1.55, 0.8);
  hangPoster(&b, north, p, 5, 23.6, 1.6, 0.9);
  hangPoster(&b, north_in, p, 6, 4.4, 1.55, 0.8);
  b.decal(north_in, 13.4, 1.1, 14.9, 2.0, b.addTexture(poster(600, 360, 77), false));
  for (double u : {5.2, 14.0, 24.2}) socket(&b, south, u);
  for (double u : {6.6, 16.6, 25.2}) socket(&b, south_in, u);
  for (double u : {3.4, 14.0, 22.4}) socket(&b, north, u);
  for (double u : {2.8, 12.2, 24.0}) socket(&b, north_in, u);
  socket(&b, west, 5.0);
  for (double u : {3.4, 16.4}) lightSwitch(&b, south, u);
  lightSwitch(&b, north, 11.1);
  for (const auto& [chart, u] : {std::pair<int, double>{south, 9.6}, {north, 19.0}}) {
    b.decal(chart, u, 2.3, u + 0.4, 2.45, p.exit_sign);
    const Chart& c = b.scene().charts[chart];  // fire extinguisher below the sign
    const Vec3 at = c.o + c.eu * float(u + 0.2) + c.n * 0.1f;
    b.cylinder(uprightPose(at.x, at.y, 0.4), 0.07, 0.5, {-1, 1, rgb(0.75f, 0.15f, 0.13f)}, p.dark, 24);
  }
}

void OfficePlan::kitchen() {
  // A niche in the core.
  const double x0 = 12.2, x1 = 15.2, y0 = 8.2, y1 = 11.0;
  b.floor(x0, y0, x1, y1, 0, p.carpet);
  const int nc = b.ceiling(x0, y0, x1, y1, 2.3, p.white);
  b.ceilingLamp(nc, 1.5, 1.4, 1.2, 0.3, 9);
  b.wall({x0, y0}, {x0, y1}, 0, 2.3, p.wall);
  const int back = b.wall({x0, y1}, {x1, y1}, 0, 2.3, p.wall);
  b.wall({x1, y1}, {x1, y0}, 0, 2.3, p.wall);
  b.boxAt((x0 + x1) / 2, y1 - 0.3, 0, -M_PI / 2, {0.6, 3.0, 0.9}, p.white, p.wood);
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 3; ++j) {
      const float g = static_cast<float>(rng.uniform(0.55, 0.75));
      b.decal(back, 0.25 * i + 0.005, 0.92 + 0.2 * j, 0.25 * i + 0.245, 1.115 + 0.2 * j, -1, rgb(g * 0.8f, g, g));
    }
  b.boxAt(x0 + 0.5, y1 - 0.3, 0.9, -M_PI / 2, {0.35, 0.5, 0.3}, p.dark, p.metal);
  b.cylinder(uprightPose(x0 + 1.6, y1 - 0.3, 0.9), 0.09, 0.26, p.metal, p.dark, 24);
  b.boxAt(x1 - 0.35, y0 + 0.9, 0, M_PI, {0.65, 0.65, 1.8}, p.metal, p.metal);
}

void OfficePlan::hall() {
  const double x0 = 30, x1 = 44, y1 = 22, h = 4.0;
  const int floor = b.floor(x0, 0, x1, y1, 0, p.carpet);
  // Floor and ceiling in bays, so that a bay's lamps are a short list.
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 3; ++j) {
      const double a = x0 + 7.0 * i, c = y1 / 3 * j;
      const int ceiling = b.ceiling(a, c, a + 7.0, c + y1 / 3, h, p.ceiling);
      lamps(ceiling, 7.0, y1 / 3, 2, 3, 12.0, 1.2, 0.6);
    }
  b.decal(floor, 4.6, 8.6, 9.4, 13.4, -1, rgb(0.42f, 0.30f, 0.30f));  // a rug before the counter
  b.decal(floor, 4.8, 8.8, 9.2, 13.2, -1, rgb(0.50f, 0.38f, 0.34f));

  const int west = b.wall({x0, 0}, {x0, y1}, 0, h, p.wall, {passage(6.0, 2.2, 2.8), passage(13.8, 2.2, 2.8)}, p.carpet);
  const int north = b.wall({x0, y1}, {x1, y1}, 0, h, p.wall, {closed(5.0)}, p.carpet);
  const int east = b.wall({x1, y1}, {x1, 0}, 0, h, p.wall);
  const int south = b.wall({x1, 0}, {x0, 0}, 0, h, p.wall, {closed(9.0, 0.2), closed(10.1, 0.2)}, p.carpet);
  skirting(&b, west, 0, 6.0);
  skirting(&b, west, 8.2, 13.8);
  skirting(&b, west, 16.0, 22.0);
  skirting(&b, north, 0, 4.93);
  skirting(&b, north, 6.02, 14);
  skirting(&b, east, 0, 22);
  skirting(&b, south, 0, 8.93);
  skirting(&b, south, 11.12, 14);
  for (int i = 0; i < 5; ++i) b.decal(east, 1.6 + 4.1 * i, 0.9, 4.0 + 4.1 * i, 3.0, p.blinds);
  b.decal(west, 9.6, 1.2, 12.4, 2.6,
          b.addTexture(sign(1024, 512, "NORTH WING", {.30f, .40f, .52f}, {.9f, .9f, .92f}), false));
  hangPoster(&b, west, p, 7, 3.0, 1.7, 1.2);
  hangPoster(&b, west, p, 8, 18.6, 1.7, 1.2);
  hangPoster(&b, north, p, 9, 2.4, 1.7, 1.0);
  b.decal(north, 8.6, 1.2, 10.4, 2.4, p.photographs[3]);
  hangPoster(&b, south, p, 10, 3.2, 1.7, 1.0);
  plate(north, 5.0);
  for (double u : {1.0, 17.2}) socket(&b, west, u);
  for (double u : {3.6, 12.0}) socket(&b, north, u);
  b.decal(west, 6.9, 3.0, 7.3, 3.15, p.exit_sign);
  b.decal(west, 14.7, 3.0, 15.1, 3.15, p.exit_sign);

  // Columns: two square, two round.
  for (const auto& [x, y] : {std::pair<double, double>{34.5, 5.5}, {34.5, 16.5}})
    b.boxAt(x, y, 0, 0, {0.5, 0.5, h}, p.wall, p.wall);
  for (const auto& [x, y] : {std::pair<double, double>{39.5, 5.5}, {39.5, 16.5}})
    b.cylinder(uprightPose(x, y, 0), 0.28, h, p.wall, p.wall, 48);
  // Counter, benches, desk islands.
  b.boxAt(36.9, 11, 0, 0, {0.7, 3.6, 1.1}, p.wood, p.white);
  b.boxAt(36.9, 10.2, 1.1, M_PI, {0.04, 0.5, 0.3}, p.dark, p.dark);
  Rng furniture(9);
  for (int i = 0; i < 3; ++i) {
    desk(&b, p, 41.8, 3.0 + 2.2 * i, 0, &furniture);
    chair(&b, p, 41.0, 3.0 + 2.2 * i, 0.3 * i - 0.2);
    desk(&b, p, 41.8, 14.5 + 2.2 * i, 0, &furniture);
    chair(&b, p, 41.0, 14.6 + 2.2 * i, 0.2 - 0.3 * i);
  }
  const Material sofa{-1, 1, rgb(0.45f, 0.30f, 0.28f)};
  b.boxAt(32.0, 20.9, 0, -M_PI / 2, {0.8, 1.9, 0.42}, sofa, sofa);
  b.boxAt(32.0, 21.5, 0.42, -M_PI / 2, {0.2, 1.9, 0.45}, sofa, sofa);
  b.cylinder(uprightPose(32.0, 19.4, 0), 0.4, 0.45, p.wood, p.wood, 40);
  shelf(&b, p, 37.0, 21.81, -M_PI / 2, 1.6, 2.0, 2);
  shelf(&b, p, 31.2, 0.19, M_PI / 2, 1.6, 2.0, 1);
  plant(&b, p, 30.6, 9.0, 1.7, &furniture);
  plant(&b, p, 30.6, 13.0, 1.7, &furniture);
  plant(&b, p, 43.4, 11.0, 1.9, &furniture);
  boxStack(&b, p, 35.5, 0.6, &furniture, 3);
  boxStack(&b, p, 36.3, 0.6, &furniture, 2);
}

}  // namespace

Scene buildOffice(bool bare) {
  OfficePlan o(bare);
  o.b.scene().light_spacing = 0.12f;
  o.p = makePalette(&o.b, 3, 12, bare ? 0.002 : 0.008, bare ? 0.15 : 1.0);
  o.corridors();
  o.hall();
  // Rooms one can enter: door positions match the corridor walls' passages.
  o.room(25.0, 0, 29.8, 5.8, 2.8, {}, {OfficePlan::cut(1.8, 1.0, 2.1)}, 1);
  o.room(9.6, 0, 14.8, 5.8, 2.8, {}, {OfficePlan::cut(1.9, 1.0, 2.1)}, 2);
  o.room(9.4, 16.2, 14.6, 22, 2.8, {OfficePlan::cut(2.1, 1.0, 2.1)}, {}, 4);
  return o.b.finish();
}

}  // namespace vip_slam
