// SPDX-License-Identifier: BSD-3-Clause
// A scene: planar charts (a frame, a texture, a light map, decals) cut into rectangular pieces. World z is up, metres.
// Curved objects are strips of narrow charts that are not `planar`: they are rendered but are no true planes.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vip_slam_sim/scene/texture.h"
#include "vip_slam_sim/scene/vec.h"

namespace vip_slam {

/// Surface appearance of a chart. Texture -1: plain colour. Tint and textures are square roots of reflectance.
struct Material {
  int texture = -1;
  float texels_per_metre = 256;
  Vec4 tint = {1, 1, 1, 1};
};

/// A picture or colour patch lying in the plane of a chart: posters, door frames, sockets, lamps.
struct Decal {
  float u0, v0, u1, v1;  ///< metres in the chart, u right, v up as seen
  int texture = -1;      ///< stretched over the rectangle
  Vec4 tint = {1, 1, 1, 1};
  float emission = 0;  ///< radiance added
};

/// A planar shading frame: point = o + u eu + v ev, seen from the side of n = eu x ev.
struct Chart {
  Vec3 o, eu, ev, n;
  float su = 0, sv = 0;  ///< extent, metres
  Vec3 n0, n1;           ///< shading normals at u = 0 and u = su (equal to n unless part of a curved strip)
  Material material;
  float tu = 0, tv = 0;                            ///< texture offset, metres
  int light_offset = 0, light_w = 0, light_h = 0;  ///< light map nodes, from edge to edge
  int decal_begin = 0, decal_count = 0;
  bool planar = true;
  int surface = -1;  ///< index into Scene::surfaces, -1: not planar
};

/// A rectangle of a chart that is solid (walls have holes).
struct Piece {
  int chart;
  float u0, v0, u1, v1;
};

/// A lamp: a rectangle that shines along n.
struct Lamp {
  Vec3 centre, half_u, half_v, n;
  float power;  ///< radiance, before exposure
};

/// Corner of a mesh. Its light is baked with the light maps.
struct MeshVertex {
  Vec3 p, n;
  Vec4 light;
};

/// A triangle of a scanned mesh: it lies anywhere near its chart, which colours it by parallel projection.
struct MeshTriangle {
  int chart;
  int vertex[3];
  Vec3 n;
};

/// Coplanar pieces that touch: one physical plane.
struct Surface {
  int frame_chart;          ///< its o, eu, ev are the surface's 2D frame
  std::vector<int> pieces;  ///< empty: the whole rectangle of that chart, seen as triangles of a mesh
  double area = 0;
};

struct Scene {
  std::string name;
  std::vector<Texture> textures;
  std::vector<Chart> charts;
  std::vector<Piece> pieces;
  std::vector<MeshVertex> vertices;
  std::vector<MeshTriangle> triangles;
  std::vector<Decal> decals;
  std::vector<Lamp> lamps;
  std::vector<Surface> surfaces;
  std::vector<Vec4> light;      ///< light map nodes of all charts
  float light_spacing = 0.08f;  ///< metres between nodes
  Vec4 ambient = {0.45f, 0.45f, 0.46f, 0};

  // By what a ray hits: an index into pieces, then into triangles.
  const MeshTriangle* triangleOf(int piece) const {
    const int i = piece - static_cast<int>(pieces.size());
    return i < 0 ? nullptr : &triangles[i];
  }
  int chartOf(int piece) const {
    const MeshTriangle* t = triangleOf(piece);
    return t ? t->chart : pieces[piece].chart;
  }
  const Vec3& normalOf(int piece) const {
    const MeshTriangle* t = triangleOf(piece);
    return t ? t->n : charts[pieces[piece].chart].n;
  }
  int surfaceOf(int piece) const { return charts[chartOf(piece)].surface; }
};

/// Names of the scenes that come with the simulator.
std::vector<std::string> sceneNames();
/// Builds a scene without lighting it: one of these or, when the name ends in .json, a scanned room (scanned_room.h).
/// Throws std::invalid_argument naming the known scenes, std::runtime_error naming the file.
Scene buildScene(const std::string& name);

}  // namespace vip_slam
