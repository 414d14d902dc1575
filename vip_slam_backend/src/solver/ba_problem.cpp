// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/solver/ba_problem.h"

#include "vip_slam_backend/factors/plane_prior.h"
#include "vip_slam_backend/factors/point_to_plane.h"
#include "vip_slam_backend/factors/relative_pose.h"
#include "vip_slam_backend/factors/reprojection.h"
#include "vip_slam_backend/solver/robust.h"

namespace vip_slam {

std::size_t BaProblem::residualBlocks() const {
  std::size_t n = observations.size() + imu.size() + homographies.size() + homography_pairs.size() +
                  point_to_plane.size() + plane_samples.size() + relative_poses.size() + gauges.size() +
                  motion_priors.size();
  for (const BaPlane& p : planes) n += p.prior_weight > 0 && p.kind != PlaneKind::kGeneral;
  return n;
}

std::size_t BaProblem::parameters() const {
  std::size_t n = 3 * (points.size() + planes.size());
  for (const BaFrame& f : frames)
    if (!f.fixed) n += f.motion ? 15 : 6;
  return n;
}

std::string validateProblem(const BaProblem& problem) {
  const int frames = static_cast<int>(problem.frames.size()), planes = static_cast<int>(problem.planes.size());
  const auto frameOk = [&](int f) { return f >= 0 && f < frames; };
  const auto planeOk = [&](int p) { return p >= 0 && p < planes; };
  for (int k = 0; k < frames; ++k) {
    const NavState& s = problem.frames[k].state;
    if (!s.T_W_I.isFinite() || !s.v_W.allFinite() || !s.bias_gyro.allFinite() || !s.bias_accel.allFinite())
      return "frame " + std::to_string(k) + ": state is not finite";
    if (!problem.frames[k].T_I_C.isFinite()) return "frame " + std::to_string(k) + ": extrinsics are not finite";
  }
  int next = 0;
  for (std::size_t k = 0; k < problem.points.size(); ++k) {
    const BaPoint& p = problem.points[k];
    const std::string name = "point " + std::to_string(k);
    if (!p.p_W.allFinite()) return name + ": position is not finite";
    if (p.first != next || p.count < 1) return name + ": its observations do not follow those of the point before";
    next += p.count;
    if (next > static_cast<int>(problem.observations.size())) return name + ": too few observations";
    for (int o = p.first; o < next; ++o) {
      const BaObservation& b = problem.observations[o];
      if (!frameOk(b.frame)) return name + ": observed by frame " + std::to_string(b.frame) + ", which does not exist";
      if (!std::isfinite(b.x) || !std::isfinite(b.y) || !(b.weight > 0) || !std::isfinite(b.depth) ||
          !(b.depth_weight >= 0))
        return name + ": an observation is not finite or has no weight";
    }
  }
  if (next != static_cast<int>(problem.observations.size())) return "observations that belong to no point";
  for (std::size_t k = 0; k < problem.planes.size(); ++k) {
    const BaPlane& p = problem.planes[k];
    if (!(std::abs(p.plane.n.norm() - 1) < 1e-3) || !std::isfinite(p.plane.d) || !std::isfinite(p.prior_weight))
      return "plane " + std::to_string(k) + ": not finite, or its normal is no unit vector";
  }
  for (const BaImu& f : problem.imu)
    if (!frameOk(f.i) || !frameOk(f.j) || f.i == f.j || !f.preintegration) return "an IMU factor without its frames";
  for (const BaHomography& f : problem.homographies)
    if (!frameOk(f.i) || !frameOk(f.j) || f.i == f.j || !planeOk(f.plane) || !isFinite(f.sums))
      return "a compressed homography without its frames or plane, or not finite";
  for (const BaHomographyPair& f : problem.homography_pairs)
    if (!frameOk(f.i) || !frameOk(f.j) || f.i == f.j || !planeOk(f.plane) || !homographyRows(f.pair).allFinite())
      return "a homography pair without its frames or plane, or not finite";
  for (const BaPointToPlane& f : problem.point_to_plane)
    if (!frameOk(f.frame) || !planeOk(f.plane) || !f.G.allFinite())
      return "a compressed point-to-plane factor without its frame or plane, or not finite";
  for (const BaPlaneSample& f : problem.plane_samples)
    if (!frameOk(f.frame) || !planeOk(f.plane) || !f.p_C.allFinite() || !std::isfinite(f.weight))
      return "a depth point on a plane without its frame or plane, or not finite";
  for (const BaRelativePose& f : problem.relative_poses)
    if (!frameOk(f.i) || !frameOk(f.j) || f.i == f.j || !f.T_i_j.isFinite() || !f.sqrt_information.allFinite())
      return "a relative pose without its frames, or not finite";
  for (const BaGauge& f : problem.gauges)
    if (!frameOk(f.frame) || !f.prior.T_W_I.isFinite()) return "a gauge prior without its frame, or not finite";
  for (const BaMotionPrior& f : problem.motion_priors)
    if (!frameOk(f.frame) || !motionPriorResidual(f.prior, problem.frames[f.frame].state).allFinite())
      return "a motion prior without its frame, or not finite";
  return "";
}

std::vector<FrameGeometry> frameGeometry(const BaProblem& problem) {
  std::vector<FrameGeometry> geometry;
  geometry.reserve(problem.frames.size());
  for (const BaFrame& f : problem.frames) geometry.emplace_back(f.state.T_W_I, f.T_I_C);
  return geometry;
}

double evaluateCost(const BaProblem& problem) {
  const std::vector<FrameGeometry> geometry = frameGeometry(problem);
  double cost = 0;
  for (const BaPoint& p : problem.points)
    for (int o = p.first; o < p.first + p.count; ++o) {
      const BaObservation& b = problem.observations[o];
      Eigen::Vector2d r;
      if (!reprojectionResidual(geometry[b.frame], p.p_W, Eigen::Vector2d(b.x, b.y), b.weight, &r)) continue;
      cost += huberCost(r.squaredNorm(), problem.huber);
      if (b.depth_weight > 0) {
        const double d = depthResidual(geometry[b.frame], p.p_W, b.depth, b.depth_weight);
        cost += huberCost(d * d, problem.depth_huber);
      }
    }
  for (const BaPlane& p : problem.planes) cost += planePriorResidual(p.kind, p.plane, p.prior_weight).squaredNorm();
  for (const BaImu& f : problem.imu)
    cost +=
        f.preintegration->residual(problem.frames[f.i].state, problem.frames[f.j].state, problem.gravity).squaredNorm();
  for (const BaHomography& f : problem.homographies) {
    const Vector9d h = homographyVector(geometry[f.i], geometry[f.j], problem.planes[f.plane].plane);
    cost += h.dot(homographyMatrix(f.sums) * h);
  }
  for (const BaHomographyPair& f : problem.homography_pairs)
    cost += (homographyRows(f.pair) * homographyVector(geometry[f.i], geometry[f.j], problem.planes[f.plane].plane))
                .squaredNorm();
  for (const BaPointToPlane& f : problem.point_to_plane) {
    const Eigen::Vector4d u = planeInCamera(geometry[f.frame], problem.planes[f.plane].plane);
    cost += u.dot(f.G * u);
  }
  for (const BaPlaneSample& f : problem.plane_samples) {
    const double r =
        f.weight * planeInCamera(geometry[f.frame], problem.planes[f.plane].plane).dot(f.p_C.homogeneous());
    cost += r * r;
  }
  for (const BaRelativePose& f : problem.relative_poses)
    cost += (f.sqrt_information *
             relativePoseResidual(problem.frames[f.i].state.T_W_I, problem.frames[f.j].state.T_W_I, f.T_i_j))
                .squaredNorm();
  for (const BaGauge& f : problem.gauges)
    cost += gaugeResidual(f.prior, problem.frames[f.frame].state.T_W_I).squaredNorm();
  for (const BaMotionPrior& f : problem.motion_priors)
    cost += motionPriorResidual(f.prior, problem.frames[f.frame].state).squaredNorm();
  return 0.5 * cost;
}

}  // namespace vip_slam
