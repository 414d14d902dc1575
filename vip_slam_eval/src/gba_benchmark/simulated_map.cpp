// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/gba_benchmark/simulated_map.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include "vip_slam_planes/detection/plane_fit.h"
#include "world.h"

namespace vip_slam {
namespace {

using gba_benchmark::World;

constexpr int kWidth = 640, kHeight = 480;
constexpr double kFocal = 460;

struct SimulatedPoint {
  Eigen::Vector3d x;
  int plane = -1;  // -1: free
  bool tracked = false;
  std::vector<int> frames;  // that see it
  Eigen::Vector3d first_ray = Eigen::Vector3d::Zero();
};

// How the tracker performs on the two kinds of points. A mark on a flat surface looks alike over a wide range of views;
// a corner of clutter is a silhouette that changes with the view and is soon hidden.
struct TrackerModel {
  double keep;        // probability that a track survives one keyframe
  double find;        // probability that a visible, lost point is found again within kForgotten keyframes
  double view_angle;  // radians from the first view
  double range;       // metres
};
constexpr TrackerModel kPlaneTracker{0.98, 0.15, 1.1, 7.0};
constexpr TrackerModel kFreeTracker{0.88, 0.05, 0.45, 4.5};
constexpr int kForgotten = 10;  // keyframes; a point lost for longer would become a new landmark

class Simulator {
 public:
  explicit Simulator(const SimulatedMapOptions& o)
      : options_(o),
        random_(o.seed),
        world_(gba_benchmark::makeWorld(o.world, o.keyframes, o.keyframe_interval * (o.keyframes - 1))) {
    Eigen::Matrix3d R_I_C;
    R_I_C << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    T_I_C_ = SE3(R_I_C, Eigen::Vector3d(0.06, -0.02, 0.01));
  }

  SimulatedMap run() {
    SimulatedMap out;
    out.focal = kFocal;
    out.pixel_sigma = options_.pixel_sigma;
    for (int k = 0; k < options_.keyframes; ++k) truth_.push_back(world_.stateAt(k * options_.keyframe_interval));
    scatterPoints();
    track();
    select();
    drift();
    insertKeyframes(&out);
    insertLandmarks(&out);
    insertPlanes(&out);
    for (int k = 0; k < options_.keyframes; ++k) out.truth[k + 1] = truth_[k];
    return out;
  }

 private:
  double gauss(double sigma) { return sigma * normal_(random_); }
  Eigen::Vector3d gauss3(double sigma) { return {gauss(sigma), gauss(sigma), gauss(sigma)}; }
  double uniform() { return uniform_(random_); }
  double depthSigma(double z) const { return options_.depth_a + options_.depth_b * z * z; }

  void scatterPoints() {
    double area = 0;
    for (const auto& r : world_.rectangles) area += r.u.norm() * r.v.norm();
    for (const auto& r : world_.rectangles) {
      // Two to three times the number kept, because many are never seen often enough.
      const int count = static_cast<int>(3.0 * options_.plane_points * r.u.norm() * r.v.norm() / area) + 20;
      for (int k = 0; k < count; ++k) {
        SimulatedPoint p;
        p.x = r.corner + uniform() * r.u + uniform() * r.v;
        p.plane = r.plane;
        points_.push_back(p);
      }
    }
    const int count = std::max(60, static_cast<int>(3.0 * options_.free_points / world_.clutter.size())) + 1;
    for (const auto& box : world_.clutter)
      for (int k = 0; k < count; ++k) {
        SimulatedPoint p;
        for (int a = 0; a < 3; ++a) p.x(a) = box.low(a) + uniform() * (box.high(a) - box.low(a));
        points_.push_back(p);
      }
  }

  bool visible(const SimulatedPoint& p, const SE3& T_W_C, const TrackerModel& model) {
    const Eigen::Vector3d c = T_W_C.inverse() * p.x;
    if (c.z() < 0.4 || c.z() > model.range) return false;
    if (std::abs(c.x() / c.z()) > 0.5 * kWidth / kFocal || std::abs(c.y() / c.z()) > 0.5 * kHeight / kFocal)
      return false;
    const Eigen::Vector3d ray = (p.x - T_W_C.t()).normalized();
    if (p.plane >= 0 && -ray.dot(world_.planes[p.plane].plane.n) < 0.2) return false;
    if (!p.frames.empty() && ray.dot(p.first_ray) < std::cos(model.view_angle)) return false;
    double s = 0;
    const double distance = (p.x - T_W_C.t()).norm();
    return world_.cast(T_W_C.t(), ray, &s) < 0 || s > distance - 0.01;
  }

  void track() {
    for (int k = 0; k < options_.keyframes; ++k) {
      const SE3 T_W_C = truth_[k].T_W_I * T_I_C_;
      for (SimulatedPoint& p : points_) {
        const TrackerModel& model = p.plane >= 0 ? kPlaneTracker : kFreeTracker;
        if (!visible(p, T_W_C, model)) {
          p.tracked = false;
          continue;
        }
        if (!p.frames.empty() && k - p.frames.back() > kForgotten) continue;
        p.tracked = p.tracked ? uniform() < model.keep : uniform() < (p.frames.empty() ? 0.5 : model.find);
        if (!p.tracked) continue;
        if (p.frames.empty()) p.first_ray = (p.x - T_W_C.t()).normalized();
        p.frames.push_back(k);
      }
    }
  }

  // Keeps exactly the wanted numbers of points seen by at least three keyframes.
  void select() {
    std::shuffle(points_.begin(), points_.end(), random_);
    std::vector<SimulatedPoint> kept;
    int planes = 0, free = 0;
    for (const SimulatedPoint& p : points_) {
      if (p.frames.size() < 3) continue;
      int& count = p.plane >= 0 ? planes : free;
      if (count == (p.plane >= 0 ? options_.plane_points : options_.free_points)) continue;
      ++count;
      kept.push_back(p);
    }
    if (planes < options_.plane_points || free < options_.free_points)
      throw std::invalid_argument("simulated map: the world gives " + std::to_string(planes) + " plane and " +
                                  std::to_string(free) + " free points, fewer than wanted");
    points_ = std::move(kept);
  }

  // The initial poses: the truth plus a random walk in position and yaw, as from odometry. The error of roll and pitch,
  // which gravity makes observable, varies without growing.
  void drift() {
    SE3 error;
    Eigen::Vector2d tilt = Eigen::Vector2d::Zero();
    for (const NavState& truth : truth_) {
      NavState s = truth;
      s.T_W_I = error * truth.T_W_I;
      s.v_W = error.rotation() * truth.v_W + gauss3(0.02);
      start_.push_back(s);
      const Eigen::Vector2d before = tilt;
      tilt = 0.95 * tilt + Eigen::Vector2d(gauss(1e-4), gauss(1e-4));
      const Eigen::Vector3d turn(tilt.x() - before.x(), tilt.y() - before.y(), gauss(3e-4));
      const SE3 about(expQuaternion(turn), truth.T_W_I.t() - expSO3(turn) * truth.T_W_I.t() + gauss3(0.002));
      error = error * about;
    }
  }

  void insertKeyframes(SimulatedMap* out) {
    const Eigen::Vector3d bias_gyro = gauss3(0.003), bias_accel = gauss3(0.03);
    const double rate = 200;
    std::vector<std::shared_ptr<Keyframe>> keyframes;
    for (int k = 0; k < options_.keyframes; ++k) {
      auto kf = std::make_shared<Keyframe>();
      kf->id = k + 1;
      kf->previous = k;
      kf->frame.t = k * options_.keyframe_interval;
      kf->frame.state = start_[k];
      kf->frame.T_I_C = T_I_C_;
      if (k > 0) {
        const int n = static_cast<int>(std::lround(options_.keyframe_interval * rate));
        for (int s = 0; s <= n; ++s) {
          ImuSample m = world_.imuAt((k - 1 + static_cast<double>(s) / n) * options_.keyframe_interval);
          m.gyro += bias_gyro + gauss3(out->noise.gyro_noise_density * std::sqrt(rate));
          m.accel += bias_accel + gauss3(out->noise.accel_noise_density * std::sqrt(rate));
          kf->imu.push_back(m);
        }
      }
      keyframes.push_back(kf);
    }
    feature_.resize(points_.size());
    for (std::size_t p = 0; p < points_.size(); ++p)
      for (const int k : points_[p].frames) {
        const Eigen::Vector3d c = (truth_[k].T_W_I * T_I_C_).inverse() * points_[p].x;
        Feature f;
        f.id = static_cast<LandmarkId>(p);
        const double u = c.x() / c.z() + gauss(options_.pixel_sigma / kFocal);
        const double v = c.y() / c.z() + gauss(options_.pixel_sigma / kFocal);
        f.xy = Eigen::Vector2d(u, v).cast<float>();
        f.pixel = Eigen::Vector2d(kFocal * u + kWidth / 2, kFocal * v + kHeight / 2).cast<float>();
        f.depth_sigma = static_cast<float>(depthSigma(c.z()));
        f.depth = static_cast<float>(c.z() + gauss(f.depth_sigma));
        feature_[p].push_back(static_cast<std::uint32_t>(keyframes[k]->frame.features.size()));
        keyframes[k]->frame.features.push_back(f);
      }
    for (int k = 0; k < options_.keyframes; ++k) out->map.addKeyframe(keyframes[k], start_[k], out->noise);
  }

  void insertLandmarks(SimulatedMap* out) {
    for (std::size_t p = 0; p < points_.size(); ++p) {
      const SimulatedPoint& point = points_[p];
      const KeyframeId host = point.frames.front() + 1;
      // As local bundle adjustments would have left it: correct relative to its host, with 1 cm of noise.
      const Eigen::Vector3d x = start_[host - 1].T_W_I * (truth_[host - 1].T_W_I.inverse() * point.x) + gauss3(0.01);
      const LandmarkId id = static_cast<LandmarkId>(p);
      out->map.addLandmark(id, x, {host, feature_[p].front()});
      for (std::size_t o = 1; o < point.frames.size(); ++o)
        out->map.addObservation(id, {static_cast<KeyframeId>(point.frames[o] + 1), feature_[p][o]});
      (point.plane >= 0 ? out->plane_observations : out->free_observations) += point.frames.size();
    }
  }

  void insertPlanes(SimulatedMap* out) {
    std::map<int, SE3> first_seen;  // initial from true world frame, at the keyframe that first sees the plane
    std::vector<PlaneObservation> observations;
    for (int k = 0; k < options_.keyframes; ++k) {
      const SE3 T_W_C = truth_[k].T_W_I * T_I_C_;
      std::map<int, PlaneObservation> seen;
      for (int s = 0; s < 8 * options_.depth_samples; ++s) {
        const Eigen::Vector3d ray((uniform() - 0.5) * kWidth / kFocal, (uniform() - 0.5) * kHeight / kFocal, 1);
        double z = 0;
        const Eigen::Vector3d direction = T_W_C.rotation() * ray;
        const int hit = world_.cast(T_W_C.t(), direction, &z);
        if (hit < 0 || z > 6) continue;
        const int plane = world_.rectangles[hit].plane;
        PlaneObservation& o = seen[plane];
        if (static_cast<int>(o.points.size()) == options_.depth_samples) continue;
        const double slope = std::abs(direction.dot(world_.planes[plane].plane.n));
        if (slope < 0.15 * ray.norm()) continue;
        // A sample is the mean of a small patch, so less noisy than the single pixel under a corner.
        const double sigma_z = 0.5 * depthSigma(z);
        PlaneSample point;
        point.p_C = ((z + gauss(sigma_z)) * ray).cast<float>();
        point.sigma = static_cast<float>(std::hypot(sigma_z * slope, options_.depth_sample_floor));
        o.points.push_back(point);
      }
      for (auto& entry : seen) {
        PlaneObservation& o = entry.second;
        if (o.points.size() < 10) continue;
        o.keyframe = k + 1;
        o.plane = entry.first + 1;
        for (const PlaneSample& p : o.points) {
          const Eigen::Vector4d x = p.p_C.cast<double>().homogeneous();
          o.G += x * x.transpose() / (static_cast<double>(p.sigma) * p.sigma);
        }
        first_seen.emplace(entry.first, start_[k].T_W_I * truth_[k].T_W_I.inverse());
        observations.push_back(std::move(o));
      }
    }
    std::map<int, PlaneMoments> surfaces;
    for (std::size_t p = 0; p < points_.size(); ++p)
      if (points_[p].plane >= 0) surfaces[points_[p].plane].add(out->map.landmark(static_cast<LandmarkId>(p)).p_W, 1.0);
    for (const auto& entry : first_seen) {
      PlaneEstimate e;
      e.id = entry.first + 1;
      e.kind = world_.planes[entry.first].kind;
      // As the plane module would estimate it: fitted to the (drifted) points on its surface.
      const Plane drifted = transformPlane(entry.second, world_.planes[entry.first].plane);
      if (!fitPlane(surfaces[entry.first], PlaneKind::kGeneral, drifted.n, &e.plane)) e.plane = drifted;
      out->map.setPlane(e);
      // Flat to a tenth of a millimetre, as local adjustments would have found.
      out->map.setSurfaceVariance(e.id, 1e-8);
    }
    for (const PlaneObservation& o : observations) out->map.setPlaneObservation(o);
    for (std::size_t p = 0; p < points_.size(); ++p)
      if (points_[p].plane >= 0 && out->map.hasPlane(points_[p].plane + 1))
        out->map.associate(static_cast<LandmarkId>(p), points_[p].plane + 1);
  }

  SimulatedMapOptions options_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_{0, 1};
  World world_;
  SE3 T_I_C_;
  std::vector<NavState> truth_, start_;
  std::vector<SimulatedPoint> points_;
  std::vector<std::vector<std::uint32_t>> feature_;
};

}  // namespace

SimulatedMap simulateMap(const SimulatedMapOptions& options) { return Simulator(options).run(); }

}  // namespace vip_slam
