// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/surface_noise.h"

#include <map>
#include <utility>

#include <Eigen/Cholesky>

#include "vip_slam_core/util/statistics.h"
#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam::frontend {

namespace {

/// In sigmas of a reading, limited so that skirting boards and door frames contribute little.
double standardised(const SurfacePatch& patch) {
  return std::clamp(patch.deviation / patch.reading, -kReadingSigmas, kReadingSigmas);
}

}  // namespace

void SurfaceNoise::Variance::add(double mean, int count) {
  weight += count;
  value += count / weight * (mean - value);
}

void SurfaceNoise::addImage(const std::vector<SurfacePatch>& patches) {
  std::map<int, int> sizes;
  std::map<std::pair<int, int>, const SurfacePatch*> raster;
  for (const SurfacePatch& patch : patches) {
    ++sizes[patch.surface];
    raster[{patch.cell.x(), patch.cell.y()}] = &patch;
  }
  double products = 0;
  int pairs = 0;
  for (const SurfacePatch& patch : patches) {
    // On smaller surfaces the plane's fit takes up most of what neighbours share.
    if (sizes[patch.surface] < kEnough) continue;
    for (const auto& [x, y] : {std::pair(1, 0), std::pair(0, 1)}) {
      const auto it = raster.find({patch.cell.x() + x, patch.cell.y() + y});
      if (it == raster.end() || it->second->surface != patch.surface) continue;
      products += standardised(patch) * standardised(*it->second);
      ++pairs;
    }
  }
  if (pairs >= kEnough) shared_.add(products / pairs, pairs);
}

void SurfaceNoise::addDifferences(const std::vector<SurfaceDifference>& differences) {
  std::map<int, std::vector<const SurfaceDifference*>> surfaces;
  for (const SurfaceDifference& d : differences) surfaces[d.surface].push_back(&d);
  for (const auto& [surface, members] : surfaces) {
    const int n = static_cast<int>(members.size());
    if (n < kEnough) continue;
    // Offset and tilt of a plane that does not pass through the origin: one linear function of the place.
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (const SurfaceDifference* d : members) {
      const Eigen::Vector3d p = d->p / d->reading;
      A += p * p.transpose();
      b += p * d->distance / d->reading;
    }
    const Eigen::LDLT<Eigen::Matrix3d> ldlt(A);
    if (!(ldlt.vectorD().minCoeff() > 1e-9 * ldlt.vectorD().maxCoeff())) continue;
    const Eigen::Vector3d moved = ldlt.solve(b);
    std::vector<double> squares;
    for (const SurfaceDifference* d : members) {
      squares.push_back(std::pow((d->distance - moved.dot(d->p)) / d->reading, 2));
    }
    white_.add(upperMedian(std::move(squares)) / chiSquareQuantile(0.5, 1) * n / (n - 3), n);
  }
}

}  // namespace vip_slam::frontend
