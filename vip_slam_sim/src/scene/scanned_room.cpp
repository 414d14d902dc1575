// SPDX-License-Identifier: BSD-3-Clause
#include "scanned_room.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/Eigenvalues>

#include "scan_file.h"
#include "scene_parts.h"
#include "vip_slam_sim/scene/vec_eigen.h"

namespace vip_slam {
namespace {

constexpr double kNear = 0.09;      ///< m, from its label's plane: part of the surface
constexpr double kBeside = 0.06;    ///< m, beyond its label's bounds
constexpr double kParallel = 0.9;   ///< cosine between the normals of triangle and label
constexpr double kOnWall = 0.25;    ///< m, between the planes of a wall and of what hangs on it
constexpr double kLampDrop = 0.08;  ///< m, of lamps below the ceiling

/// A labelled surface that triangles belong to.
struct Part {
  ScanLabel label;
  int chart = -1;
  double area = 0;
};

bool isSurface(const std::string& name) {
  return name == "FLOOR" || name == "CEILING" || name == "WALL_FACE" || name == "TABLE";
}

/// Position in the label's rectangle and distance from its plane.
Eigen::Vector3d inLabel(const ScanLabel& label, const Eigen::Vector3d& p) { return label.pose.inverse() * p; }

bool covers(const ScanLabel& label, const Eigen::Vector3d& p, const Eigen::Vector3d& n) {
  const Eigen::Vector3d q = inLabel(label, p);
  return std::abs(q.z()) < kNear && q.x() > -kBeside && q.x() < label.su + kBeside && q.y() > -kBeside &&
         q.y() < label.sv + kBeside && n.dot(label.pose.linear().col(2)) > kParallel;
}

struct Mesh {
  const ScanFile& scan;
  std::vector<Eigen::Vector3d> middle, normal;  ///< of triangles; the normal's length is the area
  explicit Mesh(const ScanFile& file) : scan(file) {
    for (const auto& t : file.triangles) {
      const Eigen::Vector3d &a = file.vertices[t[0]], &b = file.vertices[t[1]], &c = file.vertices[t[2]];
      middle.push_back((a + b + c) / 3);
      normal.push_back(0.5 * (b - a).cross(c - a));
    }
  }
};

/// Moves and tilts a label's plane to the triangles that it covers (total least squares weighted by area); its bounds
/// and its place along the plane stay. Labels without triangles stay as they are.
double fitToMesh(const Mesh& mesh, ScanLabel* label) {
  double area = 0;
  for (int pass = 0; pass < 2; ++pass) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    area = 0;
    for (std::size_t i = 0; i < mesh.middle.size(); ++i) {
      const double a = mesh.normal[i].norm();
      if (a <= 0 || !covers(*label, mesh.middle[i], mesh.normal[i] / a)) continue;
      area += a;
      mean += a * mesh.middle[i];
      spread += a * mesh.middle[i] * mesh.middle[i].transpose();
    }
    if (area < 0.2 * label->su * label->sv) return area;
    mean /= area;
    spread = spread / area - mean * mean.transpose();
    Eigen::Vector3d n = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
    const Eigen::Vector3d old = label->pose.linear().col(2);
    if (n.dot(old) < 0) n = -n;
    label->pose.linear() = Eigen::Quaterniond::FromTwoVectors(old, n).toRotationMatrix() * label->pose.linear();
    const double off = n.dot(label->pose.translation() - mean);
    label->pose.translation() -= off * n;
  }
  return area;
}

int addLabelChart(SceneBuilder* b, const ScanLabel& label, const Material& material) {
  const Eigen::Matrix3d axes = label.pose.linear();
  return b->chart(label.pose.translation(), axes.col(0) * label.su, axes.col(1) * label.sv, material);
}

/// Windows, doors and pictures lie on the wall beside them.
void hang(SceneBuilder* b, const Palette& p, const std::vector<Part>& parts, const ScanLabel& thing, int which) {
  const Eigen::Vector3d middle = thing.pose * Eigen::Vector3d(thing.su / 2, thing.sv / 2, 0);
  for (const Part& part : parts) {
    const Eigen::Vector3d q = inLabel(part.label, middle);
    if (part.label.name != "WALL_FACE" || std::abs(q.z()) > kOnWall || q.x() < 0 || q.x() > part.label.su) continue;
    if (part.label.pose.linear().col(2).dot(thing.pose.linear().col(2)) < kParallel) continue;
    const bool swapped = std::abs(thing.pose.linear().col(0).dot(part.label.pose.linear().col(0))) < 0.7;
    const double su = swapped ? thing.sv : thing.su, sv = swapped ? thing.su : thing.sv;
    const int texture = thing.name == "WINDOW_FRAME" ? p.blinds
                        : thing.name == "DOOR_FRAME" ? p.door
                                                     : p.photographs[which % p.photographs.size()];
    b->decal(part.chart, q.x() - su / 2, q.y() - sv / 2, q.x() + su / 2, q.y() + sv / 2, texture);
    return;
  }
}

Material materialOf(const std::string& name, const Palette& p) {
  if (name == "FLOOR") return p.carpet;
  if (name == "CEILING") return p.ceiling;
  if (name == "TABLE" || name == "STORAGE") return p.wood;
  if (name == "WALL_FACE") return p.wall;
  if (name == "SCREEN") return p.dark;
  if (name == "COUCH" || name == "PLANT" || name == "BED")
    return {p.carpet.texture, p.carpet.texels_per_metre, rgb(.55f, .75f, .6f)};
  return p.cardboard;
}

/// Charts that colour what has no label of its own, one for each material and main direction.
class BoxCharts {
 public:
  BoxCharts(SceneBuilder* b, const Palette& p) : builder_(b), palette_(p) {}
  int operator()(const std::string& name, const Eigen::Vector3d& n) {
    int axis = 0;
    for (int k = 1; k < 3; ++k)
      if (std::abs(n[k]) > std::abs(n[axis])) axis = k;
    const auto [it, fresh] = charts_.emplace(std::make_pair(name, 2 * axis + (n[axis] < 0)), -1);
    if (fresh) {
      const double side = n[axis] < 0 ? -1 : 1;
      const Eigen::Vector3d z = side * Eigen::Vector3d::Unit(axis), y = Eigen::Vector3d::Unit(axis == 2 ? 1 : 2);
      it->second = builder_->chart(Eigen::Vector3d::Zero(), y.cross(z), y, materialOf(name, palette_));
      builder_->scene().charts[it->second].planar = false;
    }
    return it->second;
  }

 private:
  SceneBuilder* builder_;
  const Palette& palette_;
  std::map<std::pair<std::string, int>, int> charts_;
};

/// What a triangle without a surface of its own belongs to: the box around it, or the surface that it lies beside (the
/// rounded edges of a scan).
std::string nameAround(const ScanFile& scan, const std::vector<Part>& parts, const Eigen::Vector3d& p) {
  for (const ScanBox& box : scan.boxes) {
    const Eigen::Vector3d q = box.pose.inverse() * p;
    if ((q.cwiseAbs() - 0.5 * box.size).maxCoeff() < kBeside) return box.name;
  }
  double nearest = kOnWall;
  std::string name;
  for (const Part& part : parts) {
    const Eigen::Vector3d q = inLabel(part.label, p);
    if (part.label.name == "TABLE" || std::abs(q.z()) > nearest) continue;
    if (q.x() < -kOnWall || q.y() < -kOnWall || q.x() > part.label.su + kOnWall || q.y() > part.label.sv + kOnWall)
      continue;
    nearest = std::abs(q.z());
    name = part.label.name;
  }
  return name;
}

void addLamps(SceneBuilder* b, const ScanLabel& ceiling) {
  const int columns = std::max(1, static_cast<int>(std::lround(ceiling.su / 2.2)));
  const int rows = std::max(1, static_cast<int>(std::lround(ceiling.sv / 2.2)));
  const Eigen::Vector3d u = 0.6 * ceiling.pose.linear().col(0), v = 0.6 * ceiling.pose.linear().col(1);
  for (int i = 0; i < columns; ++i)
    for (int k = 0; k < rows; ++k) {
      const Eigen::Vector3d middle =
          ceiling.pose * Eigen::Vector3d(ceiling.su * (i + 0.5) / columns, ceiling.sv * (k + 0.5) / rows, kLampDrop);
      const int panel = b->rectangle(middle - 0.5 * (u + v), u, v, {-1, 1, rgb(0.8f, 0.8f, 0.8f)});
      b->scene().charts[panel].planar = false;
      b->ceilingLamp(panel, 0.3, 0.3, 0.52, 0.52, 11.0);
    }
}

}  // namespace

bool isScanFile(const std::string& name) { return name.size() > 5 && name.compare(name.size() - 5, 5, ".json") == 0; }

Scene buildScannedRoom(const std::string& path) {
  const ScanFile scan = readScanFile(path);
  const Mesh mesh(scan);
  SceneBuilder b(path);
  Palette p = makePalette(&b, 71, 8, 0.02);
  std::vector<Part> parts;
  for (const ScanLabel& label : scan.labels) {
    if (!isSurface(label.name)) continue;
    Part part{label};
    part.area = fitToMesh(mesh, &part.label);
    part.chart = addLabelChart(&b, part.label, materialOf(label.name, p));
    parts.push_back(part);
  }
  int which = 0;
  for (const ScanLabel& label : scan.labels) {
    if (!isSurface(label.name)) hang(&b, p, parts, label, which++);
  }
  for (const Part& part : parts) {  // posters on every wide wall, papers on the floor
    if (part.label.name == "CEILING") addLamps(&b, part.label);
    if (part.label.name == "FLOOR")
      for (int i = 0; i < 8; ++i) {
        Rng rng(i + 1);
        const double u = rng.uniform(0.1, 0.9) * part.label.su, v = rng.uniform(0.1, 0.9) * part.label.sv;
        b.decal(part.chart, u, v, u + 0.21, v + 0.3, p.posters[i % p.posters.size()]);
      }
    if (part.label.name == "WALL_FACE" && std::min(part.label.su, part.label.sv) > 1.5)
      for (int i = 0; i < 3; ++i)
        hangPoster(&b, part.chart, p, which++, part.label.su * (0.2 + 0.3 * i), part.label.sv * 0.55, 0.6);
  }

  BoxCharts others(&b, p);
  Scene& scene = b.scene();
  for (std::size_t i = 0; i < scan.triangles.size(); ++i) {
    const double area = mesh.normal[i].norm();
    if (area <= 0) continue;
    const Eigen::Vector3d n = mesh.normal[i] / area;
    int chart = -1;
    for (const Part& part : parts)
      if (covers(part.label, mesh.middle[i], n)) chart = part.chart;
    if (chart < 0) chart = others(nameAround(scan, parts, mesh.middle[i]), n);
    MeshTriangle triangle;
    triangle.chart = chart;
    triangle.n = toVec(n);
    for (int k = 0; k < 3; ++k) triangle.vertex[k] = scan.triangles[i][k];
    scene.triangles.push_back(triangle);
  }
  std::vector<Eigen::Vector3d> normals(scan.vertices.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < scan.triangles.size(); ++i)
    for (int v : scan.triangles[i]) normals[v] += mesh.normal[i];
  for (std::size_t i = 0; i < scan.vertices.size(); ++i) {
    const Eigen::Vector3d n = normals[i].norm() > 0 ? normals[i].normalized() : Eigen::Vector3d::UnitZ();
    scene.vertices.push_back({toVec(scan.vertices[i]), toVec(n), splat(0)});
  }

  Scene done = b.finish();
  for (const Part& part : parts) {
    Surface surface;
    surface.frame_chart = part.chart;
    surface.area = part.label.su * part.label.sv;
    done.charts[part.chart].surface = static_cast<int>(done.surfaces.size());
    done.surfaces.push_back(surface);
  }
  return done;
}

}  // namespace vip_slam
