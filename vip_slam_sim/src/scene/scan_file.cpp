// SPDX-License-Identifier: BSD-3-Clause
#include "scan_file.h"

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include <yaml-cpp/yaml.h>

namespace vip_slam {
namespace {

std::vector<unsigned char> fromBase64(const std::string& text, const std::string& where) {
  std::vector<unsigned char> out;
  out.reserve(text.size() / 4 * 3);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    const int value = c >= 'A' && c <= 'Z'   ? c - 'A'
                      : c >= 'a' && c <= 'z' ? c - 'a' + 26
                      : c >= '0' && c <= '9' ? c - '0' + 52
                      : c == '+'             ? 62
                      : c == '/'             ? 63
                                             : -1;
    if (value < 0) throw std::runtime_error(where + ": a character that base 64 does not have");
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    count += 6;
    if (count >= 8) out.push_back(static_cast<unsigned char>(bits >> (count -= 8) & 0xFF));
  }
  return out;
}

template <class Number>
std::vector<Number> numbers(const YAML::Node& node, const std::string& where) {
  const std::vector<unsigned char> bytes = fromBase64(node.as<std::string>(), where);
  if (bytes.size() % (3 * sizeof(Number)) != 0)
    throw std::runtime_error(where + ": " + std::to_string(bytes.size()) + " bytes, expected triples of four each");
  std::vector<Number> out(bytes.size() / sizeof(Number));
  if (!out.empty()) std::memcpy(out.data(), bytes.data(), bytes.size());
  return out;
}

double number(const YAML::Node& node, const char* key, const std::string& where) {
  if (!node[key]) throw std::runtime_error(where + ": no " + key);
  return node[key].as<double>();
}

/// The file has y up: x, y, z there are x, z, -y here.
Eigen::Isometry3d poseOf(const YAML::Node& entity, const std::string& where) {
  const YAML::Node place = entity["locatable_META"];
  if (!place || !place["position"] || !place["orientation"]) throw std::runtime_error(where + ": no pose");
  const YAML::Node p = place["position"], q = place["orientation"];
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() =
      Eigen::Quaterniond(number(q, "w", where), number(q, "x", where), number(q, "y", where), number(q, "z", where))
          .normalized()
          .toRotationMatrix();
  pose.translation() = Eigen::Vector3d(number(p, "x", where), number(p, "y", where), number(p, "z", where));
  Eigen::Isometry3d upright = Eigen::Isometry3d::Identity();
  upright.linear() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return upright * pose;
}

/// Spans x and z of its pose, y points out of the room.
ScanLabel labelOf(const YAML::Node& entity, const std::string& name, const std::string& where) {
  const YAML::Node bounds = entity["bounded2D_META"];
  ScanLabel label;
  label.name = name;
  label.su = number(bounds["extent"], "width", where);
  label.sv = number(bounds["extent"], "height", where);
  Eigen::Isometry3d turned = poseOf(entity, where);
  Eigen::Matrix3d axes;
  axes.col(0) = turned.linear().col(0);
  axes.col(1) = turned.linear().col(2);
  axes.col(2) = -turned.linear().col(1);
  label.pose = turned;
  label.pose.linear() = axes;
  label.pose.translation() +=
      axes.col(0) * number(bounds["offset"], "x", where) + axes.col(1) * number(bounds["offset"], "y", where);
  return label;
}

ScanBox boxOf(const YAML::Node& entity, const std::string& name, const std::string& where) {
  const YAML::Node bounds = entity["bounded3D_META"], offset = bounds["offset"], extent = bounds["extent"];
  ScanBox box;
  box.name = name;
  box.size = {number(extent, "width", where), number(extent, "height", where), number(extent, "depth", where)};
  box.pose = poseOf(entity, where);
  const Eigen::Vector3d low(number(offset, "x", where), number(offset, "y", where), number(offset, "z", where));
  box.pose.translation() += box.pose.linear() * Eigen::Vector3d(low + 0.5 * box.size);
  return box;
}

void readMesh(const YAML::Node& entity, const std::string& where, ScanFile* out) {
  const YAML::Node mesh = entity["triangleMesh_META"];
  if (!mesh["vertices"] || !mesh["indices"]) throw std::runtime_error(where + ": a mesh without vertices or indices");
  const Eigen::Isometry3d pose = poseOf(entity, where);
  const int first = static_cast<int>(out->vertices.size());
  const auto xyz = numbers<float>(mesh["vertices"], where + ": vertices");
  for (std::size_t i = 0; i < xyz.size(); i += 3)
    out->vertices.push_back(pose * Eigen::Vector3d(xyz[i], xyz[i + 1], xyz[i + 2]));
  const auto index = numbers<std::uint32_t>(mesh["indices"], where + ": indices");
  for (std::size_t i = 0; i < index.size(); i += 3) {
    std::array<int, 3> triangle;
    for (int k = 0; k < 3; ++k) {
      if (index[i + k] >= xyz.size() / 3)
        throw std::runtime_error(where + ": a triangle of a vertex that is not there");
      triangle[k] = first + static_cast<int>(index[i + k]);
    }
    out->triangles.push_back(triangle);
  }
}

}  // namespace

ScanFile readScanFile(const std::string& path) {
  if (!std::filesystem::exists(path))
    throw std::runtime_error(path + ": no such file" +
                             (path.front() == '$' ? ", and the environment does not have that variable" : ""));
  ScanFile out;
  try {
    const YAML::Node entities = YAML::LoadFile(path)["spatialEntities"];  // JSON is YAML
    if (!entities || !entities.IsSequence()) throw std::runtime_error(path + ": spatialEntities: expected a list");
    for (const YAML::Node& entity : entities) {
      const std::string name = entity["semanticLabel_META"] ? entity["semanticLabel_META"].as<std::string>() : "";
      const std::string where = path + ": " + (name.empty() ? "entity" : name);
      if (entity["bounded2D_META"])
        out.labels.push_back(labelOf(entity, name, where));
      else if (entity["bounded3D_META"])
        out.boxes.push_back(boxOf(entity, name, where));
      else if (entity["triangleMesh_META"])
        readMesh(entity, where, &out);
    }
  } catch (const YAML::Exception& e) {
    throw std::runtime_error(path + ": " + e.what());
  }
  if (out.triangles.empty()) throw std::runtime_error(path + ": no triangle mesh");
  if (out.labels.empty()) throw std::runtime_error(path + ": no labelled planes");
  return out;
}

}  // namespace vip_slam
