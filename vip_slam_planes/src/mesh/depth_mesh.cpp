// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/mesh/depth_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "vip_slam_core/depth/grid_spacing.h"
#include "vip_slam_core/geometry/angle.h"

namespace vip_slam {
namespace {

// Sigma of an edge-safe depth relative to a single pixel's: it is the median of a 5x5 window of correlated pixels.
constexpr float kMedianGain = 0.5f;
constexpr float kLevel = 0.9f;        // cosine to the vertical of horizontal normals, which are noisy before averaging
constexpr float kSameSurface = 0.9f;  // cosine between neighbouring normals that are averaged (26 degrees)

}  // namespace

const std::vector<Eigen::Vector2f>& GridRays::operator()(const DepthGrid& grid, const BearingCorrection& bearing) {
  for (std::size_t i : {last_, 1 - last_}) {
    Layout& known = layouts_[i];
    if (grid.stride != known.stride || grid.offset != known.offset || grid.cols != known.cols ||
        grid.rows != known.rows) {
      continue;
    }
    last_ = i;
    return corrected(&known, bearing);
  }
  last_ = 1 - last_;
  Layout& layout = layouts_[last_];
  layout.stride = grid.stride, layout.offset = grid.offset, layout.cols = grid.cols, layout.rows = grid.rows;
  layout.given.clear();
  layout.rays.clear();
  layout.given.reserve(static_cast<std::size_t>(grid.cols) * grid.rows);
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.cols; ++c) {
      Eigen::Vector2d xy;
      if (!camera_->undistort(grid.pixel(c, r), &xy)) xy.setConstant(std::numeric_limits<double>::quiet_NaN());
      layout.given.push_back(xy.cast<float>());
    }
  }
  return corrected(&layout, bearing);
}

const std::vector<Eigen::Vector2f>& GridRays::corrected(Layout* layout, const BearingCorrection& bearing) {
  if (!layout->rays.empty() && layout->bearing == bearing) return layout->rays;
  layout->bearing = bearing;
  layout->rays.clear();
  layout->rays.reserve(layout->given.size());
  for (const Eigen::Vector2f& xy : layout->given) layout->rays.push_back(bearing(xy));
  return layout->rays;
}

DepthMeshBuilder::DepthMeshBuilder(const PlaneMeshOptions& options, std::shared_ptr<const CameraModel> camera,
                                   const DepthNoise& noise)
    : options_(options),
      camera_(camera),
      noise_(noise),
      least_facing_(std::cos(float(options.max_incidence_deg * kDegree))),
      least_level_facing_(std::cos(float(options.max_level_incidence_deg * kDegree))),
      rays_(camera) {}

double DepthMeshBuilder::spacing() const { return spacingOn(camera_->width(), camera_->height(), options_.spacing); }

int DepthMeshBuilder::gridStep(const DepthGrid& grid) const {
  return std::max(1, static_cast<int>(std::lround(spacing() / std::max(1, grid.stride))));
}

void DepthMeshBuilder::collectVertices(const std::vector<Feature>& features, const DepthGrid& grid) {
  mesh_.vertices.clear();
  const float side = float(spacing());
  const int bucket_cols = static_cast<int>(float(camera_->width()) / side) + 1;
  const int bucket_rows = static_cast<int>(float(camera_->height()) / side) + 1;
  taken_.assign(static_cast<std::size_t>(bucket_cols) * bucket_rows, 0);
  const auto bucket = [&](float u, float v) -> char& {
    const int c = std::clamp(static_cast<int>(u / side), 0, bucket_cols - 1);
    const int r = std::clamp(static_cast<int>(v / side), 0, bucket_rows - 1);
    return taken_[static_cast<std::size_t>(r) * bucket_cols + c];
  };
  // One feature per bucket: corners cluster, and triangles of a few pixels have no usable normal.
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Feature& f = features[i];
    if (!(f.depth > 0) || !noise_.inRange(f.depth) || !f.pixel.allFinite()) continue;
    if (f.pixel.x() < 0 || f.pixel.y() < 0) continue;
    char& used = bucket(f.pixel.x(), f.pixel.y());
    if (used) continue;
    used = 1;
    mesh_.vertices.push_back({f.pixel, Eigen::Vector3f(f.xy.x(), f.xy.y(), 1.0f) * f.depth, static_cast<int>(i)});
  }
  if (grid.empty()) return;
  const int step = gridStep(grid);
  used_.assign(grid.z.size(), 0);
  const auto add = [&](int c, int r, bool beside_feature) {
    const std::size_t i = static_cast<std::size_t>(r) * grid.cols + c;
    if (used_[i] || !(grid.z[i] > 0) || !(*grid_rays_)[i].allFinite()) return;
    const Eigen::Vector2f pixel = grid.pixel(c, r).cast<float>(), &ray = (*grid_rays_)[i];
    if (!beside_feature && bucket(pixel.x(), pixel.y())) return;
    used_[i] = 1;
    mesh_.vertices.push_back({pixel, Eigen::Vector3f(ray.x(), ray.y(), 1.0f) * grid.z[i], -1});
  };
  for (int r = 0; r < grid.rows; r += step) {
    for (int c = 0; c < grid.cols; c += step) {
      add(c, r, false);
      if (step < 2 || flatBlock(grid, c, r, step)) continue;
      // Narrow strips of a surface next to an edge would be missed by the coarse nodes.
      for (int y = r; y <= std::min(r + step, grid.rows - 1); ++y) {
        for (int x = c; x <= std::min(c + step, grid.cols - 1); ++x) add(x, y, true);
      }
    }
  }
}

bool DepthMeshBuilder::flatBlock(const DepthGrid& grid, int c, int r, int step) const {
  if (c + step >= grid.cols || r + step >= grid.rows) return false;
  const float corner[4] = {grid.at(c, r), grid.at(c + step, r), grid.at(c, r + step), grid.at(c + step, r + step)};
  for (float z : corner) {
    if (!(z > 0)) return false;
  }
  // Inverse depth of a plane is linear in the image.
  for (int y = 0; y <= step; ++y) {
    for (int x = 0; x <= step; ++x) {
      const float z = grid.at(c + x, r + y), a = float(x) / float(step), b = float(y) / float(step);
      if (!(z > 0)) return false;
      const float inverse = (1 - b) * ((1 - a) / corner[0] + a / corner[1]) + b * ((1 - a) / corner[2] + a / corner[3]);
      const float tolerance = float(options_.gap_sigmas * noise_.sigma(z)) * kMedianGain + 0.005f;
      if (std::abs(z - 1.0f / inverse) > tolerance) return false;
    }
  }
  return true;
}

bool DepthMeshBuilder::crossesDepthEdge(const MeshTriangle& triangle, const DepthGrid& grid) const {
  // Grid nodes around the middle of each side must lie on the triangle's plane.
  int missing = 0;
  const float d = -triangle.n_C.dot(triangle.centre_C);
  for (int k = 0; k < 3; ++k) {
    const MeshVertex& a = mesh_.vertices[triangle.vertex[(k + 1) % 3]];
    const MeshVertex& b = mesh_.vertices[triangle.vertex[(k + 2) % 3]];
    const Eigen::Vector2f middle = 0.5f * (a.pixel + b.pixel);
    // Between neighbouring nodes there is no third one to test.
    const bool neighbours =
        a.feature < 0 && b.feature < 0 && (a.pixel - b.pixel).cwiseAbs().maxCoeff() < 1.5f * float(grid.stride);
    if (neighbours && brokenBetween(a, b, grid)) return true;
    const int c = static_cast<int>(std::lround((middle.x() - float(grid.offset)) / float(grid.stride)));
    const int r = static_cast<int>(std::lround((middle.y() - float(grid.offset)) / float(grid.stride)));
    if (c < 0 || r < 0 || c >= grid.cols || r >= grid.rows) continue;
    const float z = grid.at(c, r);
    if (!(z > 0)) {
      ++missing;
      continue;
    }
    const Eigen::Vector2f& xy = (*grid_rays_)[static_cast<std::size_t>(r) * grid.cols + c];
    const Eigen::Vector3f ray(xy.x(), xy.y(), 1.0f);
    const float off = std::abs(triangle.n_C.dot(ray) * z + d);
    const float sigma = float(noise_.sigma(z)) * kMedianGain * std::abs(triangle.n_C.dot(ray));
    if (off > float(options_.gap_sigmas) * sigma + 0.005f) return true;
  }
  return missing >= 2;  // the edge-safe depth look-up refuses pixels next to an edge
}

bool DepthMeshBuilder::brokenBetween(const MeshVertex& a, const MeshVertex& b, const DepthGrid& grid) const {
  // On a surface inverse depth is linear in the image. There is a step or a crease in between when neither end
  // continues linearly to the other one, and one of them lies on a surface with the two nodes behind it. (A strip of
  // two nodes between other surfaces may be a surface itself.)
  const auto node = [&](const Eigen::Vector2f& pixel) {
    const int c = static_cast<int>(std::lround((pixel.x() - float(grid.offset)) / float(grid.stride)));
    const int r = static_cast<int>(std::lround((pixel.y() - float(grid.offset)) / float(grid.stride)));
    return c < 0 || r < 0 || c >= grid.cols || r >= grid.rows ? 0.0f : grid.at(c, r);
  };
  const float za = a.p_C.z(), zb = b.p_C.z(), z = 0.5f * (za + zb);
  const float sigma = float(noise_.sigma(z)) * kMedianGain, of_difference = std::hypot(sigma, 2 * sigma, sigma);
  const float tolerance = float(options_.gap_sigmas) * of_difference + 0.005f;
  const auto straight = [&](float first, float middle, float last) {
    return first > 0 && middle > 0 && std::abs(1.0f / first - 2.0f / middle + 1.0f / last) * z * z < tolerance;
  };
  const Eigen::Vector2f step = b.pixel - a.pixel;
  const float before = node(a.pixel - step), after = node(b.pixel + step);
  if (straight(before, za, zb) || straight(after, zb, za)) return false;
  return straight(node(a.pixel - 2.0f * step), before, za) || straight(node(b.pixel + 2.0f * step), after, zb);
}

bool DepthMeshBuilder::skipsNodes(const DelaunayTriangle& flat, const DepthGrid& grid) const {
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector2f side = pixels_[flat.vertex[k]] - pixels_[flat.vertex[(k + 1) % 3]];
    if (side.cwiseAbs().maxCoeff() > 1.5f * float(grid.stride)) return true;
  }
  return false;
}

bool DepthMeshBuilder::lift(const DelaunayTriangle& flat, const DepthGrid& grid, int step,
                            MeshTriangle* triangle) const {
  const Eigen::Vector3f& a = mesh_.vertices[flat.vertex[0]].p_C;
  const Eigen::Vector3f& b = mesh_.vertices[flat.vertex[1]].p_C;
  const Eigen::Vector3f& c = mesh_.vertices[flat.vertex[2]].p_C;
  const float ab = (b - a).norm(), bc = (c - b).norm(), ca = (a - c).norm();
  const float longest = std::max({ab, bc, ca});
  const Eigen::Vector3f cross = (b - a).cross(c - a);
  const float twice = cross.norm();
  if (!(longest > 1e-4f) || longest > float(options_.max_edge)) return false;
  const float altitude = twice / longest;
  if (altitude < float(options_.min_altitude_ratio) * longest) return false;
  triangle->vertex = flat.vertex;
  triangle->neighbour = flat.neighbour;
  triangle->centre_C = (a + b + c) / 3.0f;
  triangle->n_C = cross / twice;
  if (triangle->n_C.dot(triangle->centre_C) > 0) triangle->n_C = -triangle->n_C;
  triangle->area = 0.5f * twice;
  const float z = triangle->centre_C.z();
  const float facing = -triangle->n_C.dot(triangle->centre_C);
  const bool level = std::abs(triangle->n_C.dot(up_C_)) > kLevel;
  if (facing < (level ? least_level_facing_ : least_facing_) * triangle->centre_C.norm()) return false;
  triangle->sigma = float(noise_.sigma(z)) * kMedianGain * facing / z;
  triangle->sigma_angle = triangle->sigma / altitude;
  if (grid.empty()) return true;
  // In a grid as coarse as the mesh there are no nodes in between to test, except across a hole in the depth.
  return (step < 2 && !skipsNodes(flat, grid)) || !crossesDepthEdge(*triangle, grid);
}

void DepthMeshBuilder::smoothNormals() {
  std::vector<MeshTriangle>& triangles = mesh_.triangles;
  for (int round = 0; round < 2; ++round) {
    smoothed_.resize(triangles.size());
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      const MeshTriangle& t = triangles[i];
      Eigen::Vector3f sum = t.n_C * t.area;
      for (int g : t.neighbour) {
        if (g >= 0 && triangles[g].n_C.dot(t.n_C) > kSameSurface) sum += triangles[g].n_C * triangles[g].area;
      }
      smoothed_[i] = sum.normalized();
    }
    for (std::size_t i = 0; i < triangles.size(); ++i) triangles[i].n_C = smoothed_[i];
  }
}

const DepthMesh& DepthMeshBuilder::build(const std::vector<Feature>& features, const DepthGrid& grid,
                                         const Eigen::Vector3d& up_C, const BearingCorrection& bearing) {
  up_C_ = up_C.cast<float>();
  if (!grid.empty()) grid_rays_ = &rays_(grid, bearing);
  collectVertices(features, grid);
  pixels_.clear();
  for (const MeshVertex& v : mesh_.vertices) pixels_.push_back(v.pixel);
  const std::vector<DelaunayTriangle>& flat = delaunay_.triangulate(pixels_, camera_->width(), camera_->height());
  const int step = grid.empty() ? 0 : gridStep(grid);
  mesh_.triangles.clear();
  number_.assign(flat.size(), -1);
  for (std::size_t i = 0; i < flat.size(); ++i) {
    MeshTriangle triangle;
    if (!lift(flat[i], grid, step, &triangle)) continue;
    number_[i] = static_cast<int>(mesh_.triangles.size());
    mesh_.triangles.push_back(triangle);
  }
  for (MeshTriangle& t : mesh_.triangles) {
    for (int& g : t.neighbour) g = g < 0 ? -1 : number_[g];
  }
  smoothNormals();
  return mesh_;
}

}  // namespace vip_slam
