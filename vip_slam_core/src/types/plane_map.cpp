// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

void addPiece(const PlaneObservation& piece, PlaneObservation* observation) {
  const Eigen::Matrix4d sum = observation->G / observation->weight_scale + piece.G / piece.weight_scale;
  observation->points.insert(observation->points.end(), piece.points.begin(), piece.points.end());
  observation->weight_scale = 1 / (1 / observation->weight_scale + 1 / piece.weight_scale - 1);
  observation->G = observation->weight_scale * sum;
}

}  // namespace vip_slam
