// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/types/planes_yaml.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <yaml-cpp/yaml.h>

#include "util/text.h"
#include "vip_slam_core/util/atomic_file.h"

namespace vip_slam {
namespace {

const char* kindName(PlaneKind kind) {
  switch (kind) {
    case PlaneKind::kHorizontal:
      return "horizontal";
    case PlaneKind::kVertical:
      return "vertical";
    case PlaneKind::kGeneral:
      return "general";
  }
  return "general";
}

PlaneKind kindFromName(const std::string& name) {
  if (name == "horizontal") return PlaneKind::kHorizontal;
  if (name == "vertical") return PlaneKind::kVertical;
  if (name == "general") return PlaneKind::kGeneral;
  throw std::runtime_error("kind: '" + name + "' is not horizontal, vertical or general");
}

YAML::Node need(const YAML::Node& node, const char* key) {
  if (!node[key]) throw std::runtime_error(std::string(key) + ": missing, expected a value");
  return node[key];
}

void refuseUnknown(const YAML::Node& node, const std::vector<std::string>& known) {
  if (!node.IsMap()) throw std::runtime_error("is no map, expected keys and values");
  for (const auto& entry : node) {
    const std::string key = entry.first.Scalar();
    if (std::find(known.begin(), known.end(), key) == known.end()) throw std::runtime_error(key + ": unknown key");
  }
}

template <class T>
T valueOf(const YAML::Node& node, const char* key) {
  const YAML::Node value = need(node, key);
  try {
    return value.as<T>();
  } catch (const YAML::Exception&) {
    throw std::runtime_error(std::string(key) + ": is '" + (value.IsScalar() ? value.Scalar() : "a list") +
                             "', expected a number");
  }
}

Eigen::Vector3d vectorFrom(const YAML::Node& node, const char* key) {
  if (!node.IsSequence() || node.size() != 3) throw std::runtime_error(std::string(key) + ": expected [x, y, z]");
  Eigen::Vector3d v;
  for (int k = 0; k < 3; ++k) {
    if (!node[k].IsScalar() || !parseDouble(node[k].Scalar(), &v[k]) || !std::isfinite(v[k])) {
      throw std::runtime_error(std::string(key) + ": expected three finite numbers");
    }
  }
  return v;
}

Ring ringFrom(const YAML::Node& node, const char* key) {
  Ring ring;
  if (!node.IsSequence()) throw std::runtime_error(std::string(key) + ": expected a list of points");
  for (const YAML::Node& point : node) ring.push_back(vectorFrom(point, key));
  return ring;
}

std::string text(const Eigen::Vector3d& v) {
  return "[" + formatDouble(v.x()) + ", " + formatDouble(v.y()) + ", " + formatDouble(v.z()) + "]";
}

std::string text(const Ring& ring) {
  std::string out = "[";
  for (std::size_t k = 0; k < ring.size(); ++k) out += (k ? ", " : "") + text(ring[k]);
  return out + "]";
}

TruePlane planeFrom(const YAML::Node& node) {
  refuseUnknown(node,
                {"id", "kind", "normal", "distance", "area", "keyframes", "seen_seconds", "seen_area", "polygons"});
  TruePlane plane;
  plane.id = valueOf<PlaneId>(node, "id");
  plane.kind = kindFromName(need(node, "kind").as<std::string>());
  const Eigen::Vector3d n = vectorFrom(need(node, "normal"), "normal");
  const double d = valueOf<double>(node, "distance");
  if (n.norm() < 1e-6) throw std::runtime_error("normal: zero length");
  plane.plane = Plane(n, d);
  plane.area = valueOf<double>(node, "area");
  if (node["keyframes"]) plane.keyframes = valueOf<std::uint32_t>(node, "keyframes");
  if (node["seen_seconds"]) plane.seen_seconds = valueOf<double>(node, "seen_seconds");
  if (node["seen_area"]) plane.seen_area = valueOf<double>(node, "seen_area");
  for (const YAML::Node& piece : need(node, "polygons")) {
    refuseUnknown(piece, {"outer", "holes"});
    PlanePolygon polygon;
    polygon.outer = ringFrom(need(piece, "outer"), "outer");
    if (piece["holes"])
      for (const YAML::Node& hole : piece["holes"]) polygon.holes.push_back(ringFrom(hole, "holes"));
    plane.polygons.push_back(std::move(polygon));
  }
  return plane;
}

void write(const PlaneEstimate& plane, std::ostream& out) {
  out << "  - id: " << plane.id << "\n    kind: " << kindName(plane.kind) << "\n    normal: " << text(plane.plane.n)
      << "\n    distance: " << formatDouble(plane.plane.d) << "\n    area: " << formatDouble(plane.area)
      << "\n    keyframes: " << plane.keyframes;
  out << "\n    polygons:" << (plane.polygons.empty() ? " []" : "") << "\n";
  for (const PlanePolygon& polygon : plane.polygons) {
    out << "      - outer: " << text(polygon.outer) << "\n        holes:" << (polygon.holes.empty() ? " []" : "")
        << "\n";
    for (const Ring& hole : polygon.holes) out << "          - " << text(hole) << "\n";
  }
}

void write(const TruePlane& plane, std::ostream& out) {
  write(static_cast<const PlaneEstimate&>(plane), out);
  if (plane.seen_seconds >= 0) out << "    seen_seconds: " << formatDouble(plane.seen_seconds) << "\n";
  if (plane.seen_area >= 0) out << "    seen_area: " << formatDouble(plane.seen_area) << "\n";
}

template <class P>
void writeFile(const std::string& path, const std::vector<P>& planes) {
  AtomicFile file(path);
  std::ofstream& out = file.stream();
  out << "planes:" << (planes.empty() ? " []" : "") << "\n";
  for (const P& plane : planes) write(plane, out);
  file.commit();
}

}  // namespace

std::vector<TruePlane> readTruePlanesYaml(const std::string& path) {
  YAML::Node root;
  try {
    root = YAML::LoadFile(path);
  } catch (const YAML::BadFile&) {
    throw std::runtime_error(path + ": cannot be read");
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(path + ": line " + std::to_string(error.mark.line + 1) + ": " + error.msg);
  }
  if (!root.IsMap() || !root["planes"]) throw std::runtime_error(path + ": planes: missing, expected a list");
  // summary.yaml has a number there, which would be read as an empty list.
  if (!root["planes"].IsSequence()) throw std::runtime_error(path + ": planes: expected a list");
  std::vector<TruePlane> planes;
  for (const YAML::Node& node : root["planes"]) {
    try {
      planes.push_back(planeFrom(node));
    } catch (const std::exception& error) {
      throw std::runtime_error(path + ": plane " + std::to_string(planes.size() + 1) + ": " + error.what());
    }
  }
  return planes;
}

std::vector<PlaneEstimate> readPlanesYaml(const std::string& path) {
  const std::vector<TruePlane> planes = readTruePlanesYaml(path);
  return {planes.begin(), planes.end()};
}

void writePlanesYaml(const std::string& path, const std::vector<PlaneEstimate>& planes) { writeFile(path, planes); }

void writeTruePlanesYaml(const std::string& path, const std::vector<TruePlane>& planes) { writeFile(path, planes); }

}  // namespace vip_slam
