#include "vip_slam_core/geometry/plane_noise.h"

#include <algorithm>
#include <utility>

#include <Eigen/Eigenvalues>

namespace vip_slam {
namespace {

constexpr std::size_t kLeastObservations = 30;
constexpr double kMedian = 2.366;  // of a chi square with three degrees of freedom
// A sigma shrinks to a fifth at most: planes and poses are fitted to the same points, so that a map of few planes
// agrees with itself too well. It does not grow: with a camera that bends its depth that would take away what holds
// the map.
constexpr double kMost = 25.0;
// A plane is believed as if four observations had shown that it is one.
constexpr double kPlaneFreedom = 12.0;
// Observations that tell of a plane whether it is one, and by how much they must be worse than the map's.
constexpr std::size_t kLeastOfPlane = 4;
constexpr double kDisagrees = 10.0;
// A wall is no ideal plane: one that bows by a centimetre over its length is one, however exact the map.
constexpr double kSurfaceSigma = 0.006;  // m

/// The median misfit, in units of what the noise model expects; below 1 / kMost points agree with themselves too well.
double typicalMisfit(std::vector<double> misfits) {
  const auto middle = misfits.begin() + misfits.size() / 2;
  std::nth_element(misfits.begin(), middle, misfits.end());
  return std::max(*middle / kMedian, 1.0 / kMost);
}

double typicalMisfit(const std::vector<PlaneMisfit>& misfits) {
  std::vector<double> all;
  all.reserve(misfits.size());
  for (const PlaneMisfit& m : misfits) all.push_back(m.misfit);
  return typicalMisfit(std::move(all));
}

}  // namespace

double planeMisfit(const Eigen::Matrix4d& G, const Eigen::Vector4d& plane_C) {
  const double weight = G(3, 3);
  if (!(weight > 0)) return 0;
  const Eigen::Vector3d centre = G.topRightCorner<3, 1>() / weight;
  const Eigen::Matrix3d scatter = G.topLeftCorner<3, 3>() - weight * centre * centre.transpose();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(scatter, Eigen::EigenvaluesOnly);
  const Eigen::Vector3d n = plane_C.head<3>();
  const double distance = n.dot(centre) + plane_C(3), tilt = n.dot(scatter * n) - eigen.eigenvalues()(0);
  return weight * distance * distance + std::max(0.0, tilt);
}

double planeInformationScale(const std::vector<PlaneMisfit>& misfits) {
  return misfits.size() < kLeastObservations ? 1.0 : std::max(1.0, 1.0 / typicalMisfit(misfits));
}

std::vector<double> planeWeights(const std::vector<PlaneMisfit>& misfits, std::size_t planes) {
  std::vector<double> weights(planes, 1.0);
  if (misfits.size() < kLeastObservations) return weights;
  const double unit = typicalMisfit(misfits);
  std::vector<double> expected(planes, kPlaneFreedom), found(planes, kPlaneFreedom);
  for (const PlaneMisfit& m : misfits) {
    expected[m.plane] += 3.0;
    found[m.plane] += m.misfit / unit;
  }
  for (std::size_t p = 0; p < planes; ++p) weights[p] = std::min(1.0, expected[p] / found[p]);
  return weights;
}

std::vector<char> planesAgree(const std::vector<PlaneMisfit>& misfits, std::size_t planes) {
  std::vector<char> agree(planes, 1);
  if (misfits.size() < kLeastObservations) return agree;
  const double unit = typicalMisfit(misfits);
  std::vector<std::vector<double>> own(planes), squares(planes);
  for (const PlaneMisfit& m : misfits) {
    own[m.plane].push_back(m.misfit);
    squares[m.plane].push_back(m.square);
  }
  const double most = std::max(1.0, kDisagrees * unit);
  for (std::size_t p = 0; p < planes; ++p) {
    if (own[p].size() < kLeastOfPlane || typicalMisfit(std::move(own[p])) < most) continue;
    const auto middle = squares[p].begin() + squares[p].size() / 2;
    std::nth_element(squares[p].begin(), middle, squares[p].end());
    agree[p] = *middle < kSurfaceSigma * kSurfaceSigma;
  }
  return agree;
}

}  // namespace vip_slam
