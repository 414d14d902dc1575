// SPDX-License-Identifier: BSD-3-Clause
// Builds scenes from rooms, walls with openings, boxes, cylinders and spheres.
#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "vip_slam_sim/scene/scene.h"

namespace vip_slam {

/// An opening in a wall, from the wall's bottom edge up.
struct Opening {
  enum class Kind {
    kCut,      ///< just a hole
    kPassage,  ///< a doorway with jambs and a threshold of `depth`
    kClosed,   ///< a door leaf set back by `depth`
    kProud,    ///< a door leaf standing out from the wall by `depth`
  };
  float s0, s1, height;
  Kind kind = Kind::kCut;
  float depth = 0.12f;
  int leaf_texture = -1;
  Vec4 leaf_tint = {1, 1, 1, 1};
};

class SceneBuilder {
 public:
  explicit SceneBuilder(std::string name) { scene_.name = std::move(name); }

  int addTexture(const cv::Mat& image, bool repeat);

  /// Rectangle o + [0,|u|] x [0,|v|]; seen from u x v. Returns the chart.
  int rectangle(const Eigen::Vector3d& o, const Eigen::Vector3d& u, const Eigen::Vector3d& v, const Material& material);
  /// A frame alone, with nothing solid in it: for triangles of a mesh.
  int chart(const Eigen::Vector3d& o, const Eigen::Vector3d& u, const Eigen::Vector3d& v, const Material& material) {
    return addChart(o, u, v, material);
  }
  /// Upright wall from a to b (floor plan); the room lies to the right of a->b. Openings are cut and furnished.
  int wall(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double z0, double z1, const Material& material,
           const std::vector<Opening>& openings = {}, const Material& threshold = {});
  int floor(double x0, double y0, double x1, double y1, double z, const Material& material);
  int ceiling(double x0, double y0, double x1, double y1, double z, const Material& material);

  /// Box centred at `pose`, six faces. Returns the first of six charts: +x -x +y -y +z -z.
  int box(const Eigen::Isometry3d& pose, const Eigen::Vector3d& size, const Material& side, const Material& top);
  /// Upright box standing at (x, y, z) with its lower face, turned by yaw.
  int boxAt(double x, double y, double z, double yaw, const Eigen::Vector3d& size, const Material& side,
            const Material& top);
  /// Cylinder about the pose's z axis, from its origin up; smooth-shaded strips and two caps.
  void cylinder(const Eigen::Isometry3d& pose, double radius, double height, const Material& material,
                const Material& cap, int strips = 40);
  void sphere(const Eigen::Vector3d& centre, double radius, const Material& material, int strips = 28);

  void decal(int chart, double u0, double v0, double u1, double v1, int texture, Vec4 tint = rgb(1, 1, 1),
             double emission = 0);
  /// Light from a rectangle of a chart; its visible appearance needs a decal of its own.
  void lamp(int chart, double u, double v, double su, double sv, double power);
  /// A lamp panel in a ceiling chart: a bright decal and the light it gives.
  void ceilingLamp(int chart, double u, double v, double su, double sv, double power);

  /// Coplanar touching pieces become surfaces, decals are sorted by chart. Call once.
  Scene finish();
  Scene& scene() { return scene_; }

 private:
  int addChart(const Eigen::Vector3d& o, const Eigen::Vector3d& u, const Eigen::Vector3d& v, const Material& material);

  Scene scene_;
  std::vector<std::vector<Decal>> decals_;  ///< per chart
};

}  // namespace vip_slam
