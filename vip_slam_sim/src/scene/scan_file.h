// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>
#include <vector>

#include <Eigen/Geometry>

namespace vip_slam {

/// A labelled rectangle [0, su] x [0, sv] about its pose: x and y span it, z points into the room. World z up.
struct ScanLabel {
  std::string name;
  Eigen::Isometry3d pose;
  double su = 0, sv = 0;
};

/// A labelled box: its frame is centred, `size` along its axes.
struct ScanBox {
  std::string name;
  Eigen::Isometry3d pose;
  Eigen::Vector3d size;
};

struct ScanFile {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;
  std::vector<ScanLabel> labels;
  std::vector<ScanBox> boxes;
};

/// Throws std::runtime_error "file: what, expected what".
ScanFile readScanFile(const std::string& path);

}  // namespace vip_slam
