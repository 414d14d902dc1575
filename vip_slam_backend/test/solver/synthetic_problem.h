// SPDX-License-Identifier: BSD-3-Clause
// A small room for solver tests: a camera with an IMU on a closed curve, free points, points on four walls and the
// floor.
#pragma once

#include <array>
#include <cmath>
#include <map>
#include <random>

#include "factors/depth_ratio.h"
#include "vip_slam_backend/factors/frame_geometry.h"
#include "vip_slam_backend/solver/ba_problem.h"

namespace vip_slam {

struct SyntheticOptions {
  int frames = 8;
  int free_points = 60, plane_points = 60;
  double keyframe_dt = 0.4;
  bool compressed = false, uncompressed = false, plane_point_states = true;
  bool different_cameras = false;  ///< each frame has a camera mounted in its own way
  bool world_frame = false;        ///< a fixed frame at the origin, camera and IMU in one, that sees all planes
  double noise = 1.0;              ///< factor on all measurement noise
  double perturb = 0.02;           ///< perturbation of the initial values: metres and radians
  unsigned seed = 1;
};

inline NavState syntheticState(double t) {
  const auto position = [](double s) {
    return Eigen::Vector3d(1.5 * std::cos(0.5 * s), 1.2 * std::sin(0.5 * s), 1.2 + 0.2 * std::sin(0.9 * s));
  };
  NavState state;
  state.t = t;
  const double h = 1e-4;
  state.v_W = (position(t + h) - position(t - h)) / (2 * h);
  // Body looks outwards: x forward is camera z below; some roll and pitch.
  const Eigen::Quaterniond q = Eigen::AngleAxisd(0.5 * t, Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(0.15 * std::sin(0.7 * t), Eigen::Vector3d::UnitY()) *
                               Eigen::AngleAxisd(0.1 * std::cos(0.6 * t), Eigen::Vector3d::UnitX());
  state.T_W_I = SE3(q, position(t));
  return state;
}

inline ImuSample syntheticImu(double t) {
  const double h = 1e-4;
  const NavState a = syntheticState(t - h), b = syntheticState(t), c = syntheticState(t + h);
  ImuSample s;
  s.t = t;
  s.gyro = logSO3(a.T_W_I.rotation().conjugate() * c.T_W_I.rotation()) / (2 * h);
  const Eigen::Vector3d acceleration = (c.v_W - a.v_W) / (2 * h);
  s.accel = b.T_W_I.rotation().conjugate() * (acceleration + gravityVector());
  return s;
}

inline std::vector<BaFrame> syntheticFrames(const SyntheticOptions& options) {
  std::mt19937 random(options.seed + 2000);
  std::uniform_real_distribution<double> uniform(-0.15, 0.15);
  const auto uniform3 = [&] { return Eigen::Vector3d(uniform(random), uniform(random), uniform(random)); };
  Eigen::Matrix3d R_I_C;  // camera z along body x
  R_I_C << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const SE3 T_I_C(R_I_C, Eigen::Vector3d(0.05, -0.02, 0.01));
  std::vector<BaFrame> frames(options.frames);
  for (int k = 0; k < options.frames; ++k) {
    frames[k].state = syntheticState(k * options.keyframe_dt);
    frames[k].T_I_C = options.different_cameras ? SE3(expQuaternion(uniform3()), uniform3()) * T_I_C : T_I_C;
  }
  return frames;
}

// Points of the planes as the back end gives those of keyframes outside its window.
inline void addWorldFrame(const SyntheticOptions& options, BaProblem* p) {
  std::mt19937 random(options.seed + 3000);
  std::uniform_real_distribution<double> uniform(-3, 3);
  std::normal_distribution<double> normal(0, 0.01 * options.noise);
  BaFrame world;
  world.fixed = true;
  world.motion = false;
  BaPointToPlane block;
  block.frame = static_cast<int>(p->frames.size());
  p->frames.push_back(world);
  for (std::size_t w = 0; w < p->planes.size(); ++w) {
    const Plane& plane = p->planes[w].plane;
    block.plane = static_cast<int>(w);
    block.points = 20;
    block.G.setZero();
    for (int k = 0; k < block.points; ++k) {
      const Eigen::Vector3d x = plane.project({uniform(random), uniform(random), uniform(random)});
      const Eigen::Vector4d weighted = 100 * (x + normal(random) * plane.n).homogeneous();
      block.G += weighted * weighted.transpose();
    }
    p->point_to_plane.push_back(block);
  }
}

inline BaProblem makeSyntheticProblem(const SyntheticOptions& options, BaProblem* truth = nullptr) {
  std::mt19937 random(options.seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto gauss = [&](double sigma) { return sigma * normal(random); };
  const auto gauss3 = [&](double sigma) { return Eigen::Vector3d(gauss(sigma), gauss(sigma), gauss(sigma)); };
  const double focal = 500, sigma_px = 1.0;
  BaProblem p;
  p.frames = syntheticFrames(options);
  ImuNoise noise;
  for (int k = 0; k + 1 < options.frames; ++k) {
    std::vector<ImuSample> samples;
    const int n = static_cast<int>(std::lround(options.keyframe_dt * 200));
    for (int s = 0; s <= n; ++s) {
      samples.push_back(syntheticImu(k * options.keyframe_dt + s * options.keyframe_dt / n));
      samples.back().gyro += options.noise * gauss3(noise.gyro_noise_density * std::sqrt(200.0));
      samples.back().accel += options.noise * gauss3(noise.accel_noise_density * std::sqrt(200.0));
    }
    BaImu f;
    f.i = k, f.j = k + 1;
    f.preintegration =
        std::make_shared<Preintegration>(samples, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), noise);
    p.imu.push_back(f);
  }
  const std::vector<std::pair<Plane, PlaneKind>> walls = {{Plane(Eigen::Vector3d(-1, 0, 0), 4), PlaneKind::kVertical},
                                                          {Plane(Eigen::Vector3d(1, 0, 0), 4), PlaneKind::kVertical},
                                                          {Plane(Eigen::Vector3d(0, -1, 0), 3.5), PlaneKind::kVertical},
                                                          {Plane(Eigen::Vector3d(0, 1, 0), 3.5), PlaneKind::kVertical},
                                                          {Plane(Eigen::Vector3d(0, 0, 1), 0), PlaneKind::kHorizontal}};
  const bool planes = options.compressed || options.uncompressed;
  if (planes)
    for (const auto& wall : walls) {
      BaPlane plane;
      plane.plane = wall.first;
      plane.kind = wall.second;
      plane.prior_weight = 1 / 0.01;
      p.planes.push_back(plane);
    }
  std::vector<FrameGeometry> geometry;
  for (const BaFrame& f : p.frames) geometry.emplace_back(f.state.T_W_I, f.T_I_C);
  std::vector<std::vector<BaHomographyPair>> pairs;
  for (int k = 0; k < options.free_points + options.plane_points; ++k) {
    Eigen::Vector3d x(3.8 * uniform(random), 3.3 * uniform(random), 1.25 + 1.2 * uniform(random));
    const int wall = k < options.free_points ? -1 : k % static_cast<int>(walls.size());
    if (wall >= 0) x = walls[wall].first.project(x);
    std::vector<BaObservation> seen;
    for (int f = 0; f < options.frames; ++f) {
      const Eigen::Vector3d c = geometry[f].R_C_W * (x - geometry[f].t_W_C);
      if (c.z() < 0.4 || std::abs(c.x() / c.z()) > 0.7 || std::abs(c.y() / c.z()) > 0.55) continue;
      BaObservation o;
      o.frame = f;
      o.x = c.x() / c.z() + options.noise * gauss(sigma_px / focal);
      o.y = c.y() / c.z() + options.noise * gauss(sigma_px / focal);
      o.weight = focal / sigma_px;
      if (random() % 4 != 0) {
        const double sigma = 0.002 + 0.003 * c.z();
        o.depth = c.z() + options.noise * gauss(sigma);
        o.depth_weight = 1 / sigma;
      }
      seen.push_back(o);
    }
    if (seen.size() < 3) continue;
    if (wall >= 0 && planes)
      for (std::size_t s = 1; s < seen.size(); ++s) {
        BaHomographyPair pair;
        pair.i = seen[0].frame, pair.j = seen[s].frame, pair.plane = wall;
        pair.pair.xy_i = Eigen::Vector2d(seen[0].x, seen[0].y);
        pair.pair.xy_j = Eigen::Vector2d(seen[s].x, seen[s].y);
        double rho = 1;
        if (!depthRatio(geometry[pair.i], geometry[pair.j], walls[wall].first, pair.pair.xy_i, &rho)) continue;
        pair.pair.weight = focal / (1.4 * sigma_px * rho);
        p.homography_pairs.push_back(pair);
      }
    if (wall >= 0 && planes && !options.plane_point_states) continue;
    BaPoint point;
    point.p_W = x;
    point.first = static_cast<int>(p.observations.size());
    point.count = static_cast<int>(seen.size());
    p.observations.insert(p.observations.end(), seen.begin(), seen.end());
    p.points.push_back(point);
  }
  if (planes)
    for (int f = 0; f < options.frames; ++f)
      for (std::size_t w = 0; w < walls.size(); ++w)
        for (int k = 0; k < 12; ++k) {
          const Eigen::Vector3d ray(0.6 * uniform(random), 0.45 * uniform(random), 1);
          const Eigen::Vector3d n_C = geometry[f].R_C_W * walls[w].first.n;
          const double z = -walls[w].first.signedDistance(geometry[f].t_W_C) / n_C.dot(ray);
          if (!(z > 0.4 && z < 8)) continue;
          BaPlaneSample m;
          m.frame = f, m.plane = static_cast<int>(w);
          m.p_C = (z + options.noise * gauss(0.01)) * ray;
          m.weight = 1 / (0.01 * std::abs(n_C.dot(ray)) + 0.003);
          p.plane_samples.push_back(m);
        }
  if (options.compressed) {
    std::map<std::array<int, 3>, BaHomography> homographies;
    for (const BaHomographyPair& f : p.homography_pairs) {
      BaHomography& h = homographies[{f.i, f.j, f.plane}];
      h.i = f.i, h.j = f.j, h.plane = f.plane;
      addHomographyPair(f.pair, &h.sums);
      ++h.pairs;
    }
    for (const auto& h : homographies) p.homographies.push_back(h.second);
    std::map<std::pair<int, int>, BaPointToPlane> blocks;
    for (const BaPlaneSample& f : p.plane_samples) {
      BaPointToPlane& b = blocks[{f.frame, f.plane}];
      b.frame = f.frame, b.plane = f.plane;
      const Eigen::Vector4d x = f.weight * f.p_C.homogeneous();
      b.G += x * x.transpose();
      ++b.points;
    }
    for (const auto& b : blocks) p.point_to_plane.push_back(b.second);
    p.homography_pairs.clear();
    p.plane_samples.clear();
  }
  std::mt19937 odometry_random(options.seed + 1000);  // separate, so that the rest does not change with it
  std::normal_distribution<double> odometry_normal;
  for (std::size_t k = 1; k < p.frames.size(); ++k) {
    // A full covariance with correlations between all components, like that of a filter.
    BaRelativePose f;
    f.i = static_cast<int>(k) - 1, f.j = static_cast<int>(k);
    f.T_i_j = p.frames[f.i].state.T_W_I.inverse() * p.frames[f.j].state.T_W_I;
    Vector6d error;
    for (int c = 0; c < 6; ++c) error(c) = (c < 3 ? 1e-3 : 5e-3) * odometry_normal(odometry_random);
    f.T_i_j = f.T_i_j.boxplus(options.noise * error);
    f.sqrt_information.setZero();
    for (int r = 0; r < 6; ++r)
      for (int c = r; c < 6; ++c) f.sqrt_information(r, c) = (r == c ? 1.0 : 0.2) / (r < 3 ? 1e-3 : 5e-3);
    p.relative_poses.push_back(f);
  }
  BaGauge gauge;
  gauge.prior.T_W_I = p.frames[0].state.T_W_I;
  p.gauges.push_back(gauge);
  BaMotionPrior prior;
  prior.prior.v_W = p.frames[0].state.v_W;
  p.motion_priors.push_back(prior);
  if (options.world_frame) addWorldFrame(options, &p);
  if (truth) *truth = p;
  for (std::size_t k = 0; k < p.frames.size(); ++k) {
    if (p.frames[k].fixed) continue;
    NavState& s = p.frames[k].state;
    Vector6d d;
    d << gauss3(options.perturb), gauss3(options.perturb);
    if (k > 0) s.T_W_I = s.T_W_I.boxplus(d);
    s.v_W += gauss3(options.perturb);
    s.bias_gyro += gauss3(0.02 * options.perturb);
    s.bias_accel += gauss3(options.perturb);
  }
  for (BaPoint& x : p.points) x.p_W += gauss3(options.perturb);
  for (BaPlane& plane : p.planes) plane.plane = plane.plane.boxplus(gauss3(options.perturb));
  return p;
}

}  // namespace vip_slam
