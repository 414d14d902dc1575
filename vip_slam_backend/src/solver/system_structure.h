// SPDX-License-Identifier: BSD-3-Clause
// The unknowns of a problem, the pairs of them that share a factor, and the offsets of their blocks: everything about
// the reduced system that is constant over iterations, and over calls with the same structure.
#pragma once

#include <cstdint>
#include <vector>

#include "vip_slam_backend/solver/ba_problem.h"
#include "vip_slam_backend/solver/sparse_cholesky.h"

namespace vip_slam {

/// Offset of a block between two nodes; -1: one of them is constant.
struct BlockPlace {
  std::int64_t offset = -1;
  bool transposed = false;  ///< the block is stored with rows and columns exchanged
};

class SystemStructure {
 public:
  /// Does nothing when the structure is that of the previous call. True when it was analysed again.
  bool update(const BaProblem& problem);

  SparseCholesky cholesky;
  std::vector<int> pose_node, motion_node, plane_node;  ///< -1: constant
  /// The problem's points in the order of processing: by their oldest frame, so that neighbours touch the same blocks.
  std::vector<int> point_at;
  /// Observations of the points in that order, per point by the elimination order of their frames (fixed frames first).
  std::vector<int> sorted, first;
  /// Points [part_begin[k], part_begin[k + 1]) have about equally many observations in each part: parts that can be
  /// linearised in parallel, each with its own sums over the frames, independent of the number of threads.
  static constexpr int kPointParts = 2;
  int part_begin[kPointParts + 1] = {};
  /// Pieces of what any number of threads may share; ranges of the elimination order in which the elimination of points
  /// costs the same: per point its first observation
  /// (in `sorted`) in each range, and finally the end of its observations.
  static constexpr int kRanges = 4;
  std::vector<int> range_begin[kRanges + 1];
  std::vector<std::uint32_t> pair_offset;  ///< [earlier * frames + later] pose blocks
  /// Blocks of the other factors: IMU (pose_i, motion_i, pose_j, motion_j), homographies (pose_i, pose_j, plane).
  struct ImuPlaces {
    BlockPlace place[4][4];  ///< [row node][column node], row > column
  };
  struct TriplePlaces {
    BlockPlace ji, pi, pj;  ///< (j, i), (plane, i), (plane, j)
  };
  std::vector<ImuPlaces> imu;
  std::vector<TriplePlaces> homographies, homography_pairs;
  std::vector<BlockPlace> point_to_plane, plane_samples, relative_poses;

 private:
  std::uint64_t signature(const BaProblem& problem) const;
  void orderPoints(const BaProblem& problem);
  void splitElimination(const std::vector<int>& position);
  std::uint64_t signature_ = 0;
  bool valid_ = false;
};

}  // namespace vip_slam
