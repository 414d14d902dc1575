// SPDX-License-Identifier: BSD-3-Clause
// Sparse, unbounded voting spaces for planes: height for horizontal triangles, angle x distance for vertical ones.
// Votes are areas. Opposite normals have separate bins: floor and ceiling, or the two faces of a thin wall. With
// normals towards the camera the angle covers the full circle and wraps at +-180 degrees, without the sign flip of d
// that a half circle needs. Distances are measured from a local origin, because theta-d bins shear with the lever arm.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

namespace vip_slam {

class PlaneHistogram {
 public:
  /// Bin sizes in metres (heights of horizontal planes, distances of vertical ones) and degrees; the angle bin is
  /// rounded so that a full circle holds a whole number of them.
  PlaneHistogram(double height_bin, double distance_bin, double angle_bin_deg);

  void clear();
  /// Adds a vote for the plane through p with unit normal n to one of the two spaces; `index` is returned with the
  /// peak. Indices start at zero and have no large gaps.
  void addHorizontal(const Eigen::Vector3d& n, const Eigen::Vector3d& p_local, double area, int index);
  void addVertical(const Eigen::Vector3d& n, const Eigen::Vector3d& p_local, double area, int index);

  struct Peak {
    double area = 0;
    std::vector<int> members;  ///< indices in the bin and its neighbours, ascending
  };
  /// The neighbourhood (bin and direct neighbours) with the largest area; area 0 when empty. Deterministic.
  Peak peak();
  void remove(int index);

 private:
  struct Bin {
    int space, angle, distance;  ///< space 0: up, 1: down, 2: vertical
    double area = 0;
    double neighbourhood = 0;       ///< area of this bin and its direct neighbours, kept up to date
    std::vector<int> members;       ///< in order of their addition
    std::vector<std::size_t> near;  ///< this bin and its direct neighbours, those that exist
  };
  struct Vote {
    std::size_t bin = kNoBin;
    double area = 0;
  };
  static constexpr std::size_t kNoBin = ~std::size_t(0);
  static std::uint64_t key(int space, int angle, int distance);
  void add(int space, int angle, int distance, double area, int index);
  std::size_t binAt(int space, int angle, int distance);

  double height_bin_, distance_bin_, angle_bin_;
  int angles_;
  std::vector<Bin> bins_;  ///< in order of their first vote, so that ties are resolved deterministically
  std::unordered_map<std::uint64_t, std::size_t> index_;
  std::vector<Vote> votes_;  ///< by index
};

}  // namespace vip_slam
