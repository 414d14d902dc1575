// SPDX-License-Identifier: BSD-3-Clause
#include "curve_equations.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "vip_slam_core/depth/depth_curve.h"
#include "vip_slam_core/util/significance.h"

namespace vip_slam {
namespace {

constexpr int kKeyframes = 200;
constexpr double kFarthest = 12.0;  // m

/// Normal equations of a plane's points: of the entries, of the plane's normal (two angles) and distance, and mixed.
struct PlaneSystem {
  explicit PlaneSystem(Eigen::Index entries)
      : own(Eigen::MatrixXd::Zero(entries, entries)),
        cross(Eigen::MatrixXd::Zero(entries, 3)),
        g_own(Eigen::VectorXd::Zero(entries)) {}
  double misfit() const { return squares / std::max(1.0, points); }
  Eigen::MatrixXd own, cross;
  Eigen::VectorXd g_own;
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  double squares = 0, points = 0;  ///< of residuals in sigmas
};

/// Median of the planes' misfits, weighted by their points.
double usualMisfit(const std::map<PlaneId, PlaneSystem>& systems) {
  std::vector<std::pair<double, double>> list;
  double all = 0, sum = 0;
  for (const auto& [id, system] : systems) {
    list.emplace_back(system.misfit(), system.points);
    all += system.points;
  }
  std::sort(list.begin(), list.end());
  for (const auto& [misfit, points] : list) {
    sum += points;
    if (2 * sum >= all) return misfit;
  }
  return 1.0;
}

/// Linearisation point of a curve's entries: `value`, m, is added to the readings at present.
struct Question {
  const Eigen::VectorXd& value;
  const DepthNoise& noise;
};

Eigen::Index entryOf(double z) { return static_cast<Eigen::Index>(z / DepthCurve::kStep); }

double between(const Eigen::VectorXd& value, double z) {
  const Eigen::Index i = entryOf(z);
  const double share = z / DepthCurve::kStep - static_cast<double>(i);
  return (1 - share) * value(i) + share * value(i + 1);
}

/// Adds one point to the system of its plane. `u`, `v`: unit vectors along the plane.
void add(const PlaneSample& point, const SE3& T_W_C, const Plane& plane, const Eigen::Vector3d& u,
         const Eigen::Vector3d& v, const Question& question, PlaneSystem* system) {
  const double reading = point.p_C.z();
  if (!(reading > 0) || entryOf(reading) + 1 >= question.value.size()) return;
  const Eigen::Vector3d ray = T_W_C.R() * point.p_C.cast<double>() / reading;
  const double along = plane.n.dot(ray);
  const Eigen::Vector3d corrected = ray * (reading + between(question.value, reading)) + T_W_C.t();
  const double off = (plane.n.dot(corrected) + plane.d) / along;
  // Use the depth expected from the plane instead of the noisy reading: a reading that noise makes too short would get
  // a smaller sigma and count for another entry.
  const double z = reading - off;
  if (!(z > 0) || z > question.noise.unbiasedRange()) return;
  const Eigen::Index i = entryOf(z);
  if (i + 1 >= question.value.size()) return;
  const double share = z / DepthCurve::kStep - static_cast<double>(i), shares[2] = {1 - share, share};
  const Eigen::Vector3d p_W = ray * (reading + between(question.value, z)) + T_W_C.t();
  const double residual = plane.n.dot(p_W) + plane.d;
  const double sigma = point.sigma * question.noise.sigma(z) / question.noise.sigma(reading);
  const double ratio = residual / (kNoiseSigmas * sigma);
  const double weight = 1.0 / (sigma * sigma * (1 + ratio * ratio) * (1 + ratio * ratio));
  const Eigen::Vector3d J(u.dot(p_W), v.dot(p_W), 1.0);
  for (int a = 0; a < 2; ++a) {
    for (int b = 0; b < 2; ++b) system->own(i + a, i + b) += weight * along * along * shares[a] * shares[b];
    system->g_own(i + a) += weight * along * shares[a] * residual;
    system->cross.row(i + a) += weight * along * shares[a] * J.transpose();
  }
  system->H += weight * J * J.transpose();
  system->g += weight * residual * J;
  if (std::abs(ratio) > 1) return;
  system->squares += residual * residual / (sigma * sigma);
  ++system->points;
}

}  // namespace

std::vector<const MapKeyframe*> newestKeyframesOnPlanes(const Map& map) {
  std::vector<const MapKeyframe*> list;
  for (auto it = map.keyframes().rbegin(); it != map.keyframes().rend() && int(list.size()) < kKeyframes; ++it) {
    if (!it->second.stored && !it->second.planes.empty()) list.push_back(&it->second);
  }
  return list;
}

PlaneSet allPlanes(const Map& map) {
  PlaneSet planes;
  for (const auto& [id, plane] : map.planes()) planes.emplace(id, &plane.estimate.plane);
  return planes;
}

std::pair<PlaneSet, PlaneSet> halves(const std::vector<const MapKeyframe*>& keyframes, const PlaneSet& planes) {
  std::map<PlaneId, std::size_t> points;
  for (const MapKeyframe* kf : keyframes)
    for (const auto& [id, observation] : kf->planes) points[id] += observation.points.size();
  std::vector<std::pair<std::size_t, PlaneId>> order;
  for (const auto& [id, plane] : planes) order.emplace_back(points[id], id);
  std::sort(order.rbegin(), order.rend());
  std::pair<PlaneSet, PlaneSet> both;
  std::size_t first = 0, second = 0;
  for (const auto& [n, id] : order) {
    (first <= second ? both.first : both.second).emplace(id, planes.at(id));
    (first <= second ? first : second) += n;
  }
  return both;
}

int curveEntries(const DepthNoise& noise) {
  return 2 + static_cast<int>(std::ceil(std::min(noise.max_range, kFarthest) / DepthCurve::kStep));
}

CurveEquations curveEquations(const std::vector<const MapKeyframe*>& keyframes, const PlaneSet& planes,
                              const Eigen::VectorXd& value, const DepthNoise& noise) {
  const Eigen::Index entries = value.size();
  std::map<PlaneId, PlaneSystem> systems;
  for (const MapKeyframe* kf : keyframes) {
    const SE3 T_W_C = kf->T_W_C();
    for (const auto& [id, observation] : kf->planes) {
      const auto plane = planes.find(id);
      if (plane == planes.end()) continue;
      PlaneSystem& system = systems.try_emplace(id, entries).first->second;
      const Plane& surface = *plane->second;
      const Eigen::Vector3d u = surface.n.unitOrthogonal(), v = surface.n.cross(u);
      for (const PlaneSample& point : observation.points) add(point, T_W_C, surface, u, v, {value, noise}, &system);
    }
  }
  CurveEquations equations{Eigen::MatrixXd::Zero(entries, entries), Eigen::VectorXd::Zero(entries), 1};
  const double usual = usualMisfit(systems);
  double squares = 0, points = 0;
  for (auto& [id, system] : systems) {
    // A plane with larger residuals than usual may be several surfaces.
    const double trust = system.misfit() > usual ? usual / system.misfit() : 1.0;
    squares += trust * system.squares;
    points += trust * system.points;
    const Eigen::LDLT<Eigen::Matrix3d> ldlt(system.H);
    equations.H += trust * (system.own - system.cross * ldlt.solve(system.cross.transpose()));
    equations.g += trust * (system.g_own - system.cross * ldlt.solve(system.g));
  }
  equations.scatter = std::max(1e-12, squares / std::max(1.0, points));
  return equations;
}

}  // namespace vip_slam
