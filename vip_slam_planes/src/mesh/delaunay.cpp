// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/mesh/delaunay.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace vip_slam {
namespace {

constexpr int kMargin = 64;  // px between the image and the enclosing box
// Differences below 2^14 lattice steps keep the in-circle determinant below 2^61.
constexpr std::int64_t kLargestCoordinate = 1 << 14;

}  // namespace

std::int64_t Delaunay::orient(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool Delaunay::inCircle(const Face& face, const Point& p) const {
  const Point& a = points_[face.vertex[0]];
  const Point& b = points_[face.vertex[1]];
  const Point& c = points_[face.vertex[2]];
  const std::int64_t ax = a.x - p.x, ay = a.y - p.y, bx = b.x - p.x, by = b.y - p.y, cx = c.x - p.x, cy = c.y - p.y;
  const std::int64_t a2 = ax * ax + ay * ay, b2 = bx * bx + by * by, c2 = cx * cx + cy * cy;
  return a2 * (bx * cy - by * cx) - b2 * (ax * cy - ay * cx) + c2 * (ax * by - ay * bx) > 0;
}

int Delaunay::newFace() {
  if (!free_.empty()) {
    const int f = free_.back();
    free_.pop_back();
    return f;
  }
  faces_.push_back({});
  return static_cast<int>(faces_.size()) - 1;
}

void Delaunay::start(int width, int height) {
  scale_ = 8;
  const int side = std::max(width, height) + 2 * kMargin;
  while (scale_ > 1 && side * scale_ > kLargestCoordinate) scale_ /= 2;
  const std::int64_t x1 = (width + 2 * kMargin) * scale_, y1 = (height + 2 * kMargin) * scale_;
  points_ = {{0, 0}, {x1, 0}, {x1, y1}, {0, y1}};
  faces_.clear();
  free_.clear();
  faces_.push_back({{0, 1, 2}, {-1, 1, -1}, true, 0});
  faces_.push_back({{0, 2, 3}, {-1, -1, 0}, true, 0});
  last_ = 0;
  stamp_ = 0;
}

int Delaunay::locate(const Point& p) const {
  int f = last_;
  // In a Delaunay triangulation the walk terminates; the bound only guards against a broken one.
  for (std::size_t step = 0; step < 4 * faces_.size() + 16; ++step) {
    const Face& face = faces_[f];
    int next = -1;
    for (int k = 0; k < 3; ++k) {
      if (orient(points_[face.vertex[(k + 1) % 3]], points_[face.vertex[(k + 2) % 3]], p) < 0) {
        next = face.neighbour[k];
        break;
      }
    }
    if (next < 0) return f;
    f = next;
  }
  throw std::logic_error("delaunay: point location did not end");
}

void Delaunay::insert(int vertex) {
  const Point p = points_[vertex];
  const int containing = locate(p);
  for (int v : faces_[containing].vertex) {
    if (points_[v].x == p.x && points_[v].y == p.y) return;  // repeated point
  }

  // The cavity: faces whose circumcircle contains p, a connected star-shaped region around p.
  ++stamp_;
  cavity_.clear();
  rim_.clear();
  stack_.assign(1, containing);
  faces_[containing].visited = stamp_;
  while (!stack_.empty()) {
    const int f = stack_.back();
    stack_.pop_back();
    cavity_.push_back(f);
    for (int k = 0; k < 3; ++k) {
      const int g = faces_[f].neighbour[k];
      if (g >= 0 && faces_[g].visited == stamp_) continue;
      if (g >= 0 && inCircle(faces_[g], p)) {
        faces_[g].visited = stamp_;
        stack_.push_back(g);
      } else {
        rim_.push_back({faces_[f].vertex[(k + 1) % 3], faces_[f].vertex[(k + 2) % 3], g});
      }
    }
  }
  for (int f : cavity_) {
    faces_[f].alive = false;
    free_.push_back(f);
  }

  // One new face per side of the rim; face_from_[a] is the face whose rim side starts at a.
  for (const Side& side : rim_) {
    const int f = newFace();
    faces_[f] = {{side.a, side.b, vertex}, {-1, -1, side.outside}, true, 0};
    face_from_[side.a] = f;
    if (side.outside >= 0) {
      Face& out = faces_[side.outside];
      for (int k = 0; k < 3; ++k) {
        if (out.vertex[(k + 1) % 3] == side.b && out.vertex[(k + 2) % 3] == side.a) out.neighbour[k] = f;
      }
    }
  }
  for (const Side& side : rim_) {
    const int f = face_from_[side.a], g = face_from_[side.b];
    faces_[f].neighbour[0] = g;  // across (b, p)
    faces_[g].neighbour[1] = f;  // across (p, its a) = (p, b)
    last_ = f;
  }
}

const std::vector<DelaunayTriangle>& Delaunay::triangulate(const std::vector<Eigen::Vector2f>& points, int width,
                                                           int height) {
  if (width < 1 || height < 1 || width > 16000 || height > 16000) {
    throw std::invalid_argument("delaunay: image is " + std::to_string(width) + "x" + std::to_string(height) +
                                ", expected 1..16000 each");
  }
  start(width, height);
  const int corners = static_cast<int>(points_.size());  // of the enclosing box
  points_.resize(corners + points.size());
  face_from_.assign(points_.size(), -1);
  faces_.reserve(2 * points_.size() + 8);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2f& q = points[i];
    if (!(q.x() >= 0 && q.y() >= 0 && q.x() < float(width) && q.y() < float(height))) continue;
    points_[corners + i] = {std::llround((double(q.x()) + kMargin) * double(scale_)),
                            std::llround((double(q.y()) + kMargin) * double(scale_))};
    insert(corners + static_cast<int>(i));
  }

  // Faces that touch the box's corners are not part of the result.
  std::vector<int>& number = stack_;
  number.assign(faces_.size(), -1);
  result_.clear();
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    const Face& face = faces_[f];
    if (!face.alive || face.vertex[0] < corners || face.vertex[1] < corners || face.vertex[2] < corners) continue;
    number[f] = static_cast<int>(result_.size());
    result_.push_back({{face.vertex[0] - corners, face.vertex[1] - corners, face.vertex[2] - corners}, face.neighbour});
  }
  for (DelaunayTriangle& t : result_) {
    for (int& g : t.neighbour) g = g < 0 ? -1 : number[g];
  }
  return result_;
}

}  // namespace vip_slam
