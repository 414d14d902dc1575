// SPDX-License-Identifier: BSD-3-Clause
#include "plane_factors.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <unordered_map>

#include "homography_hosts.h"
#include "surface_scatter.h"
#include "vip_slam_backend/solver/robust.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/geometry/plane_noise.h"
#include "vip_slam_core/util/significance.h"

namespace vip_slam {
namespace {

// Prior of a track's variance: equivalent to this many squared errors of the expected size.
constexpr double kTrackFreedom = 4.0;

}  // namespace

PlaneFactorBuilder::PlaneFactorBuilder(const Map& map, const ProblemScope& scope, const BuilderSettings& settings,
                                       BuiltProblem* built)
    : map_(map), settings_(settings), built_(built), geometry_(frameGeometry(built->problem)) {
  BaProblem& problem = built->problem;
  if (settings.variant == Variant::kVi) return;
  // Only planes that a free frame sees with depth: without it only homographies would determine a plane's distance.
  for (const KeyframeId id : scope.free)
    for (const auto& observation : map.keyframe(id).planes) planes_[observation.first] = 0;
  for (auto& entry : planes_) {
    const MapPlane& plane = map.planes().at(entry.first);
    entry.second = static_cast<int>(problem.planes.size());
    BaPlane variable;
    variable.plane = plane.estimate.plane;
    variable.kind = plane.estimate.kind;
    variable.prior_weight = 1 / (settings.measurement.plane_prior_deg * kDegree);
    problem.planes.push_back(variable);
    built->planes.push_back(entry.first);
  }
}

// Views by one keyframe of the landmarks with one host on one plane.
struct PlaneFactorBuilder::Observer {
  int frame = 0, pairs = 0;
  Vector9d h;  // vec(H) at the present estimate
  HomographySums sums{};
  std::vector<HomographyPair> uncompressed;
};

std::vector<char> PlaneFactorBuilder::addHomographies(const LandmarkViews& views) {
  std::vector<char> taken(views.size(), 0);
  if (planes_.empty()) return taken;
  std::vector<int> plane(views.size(), -1);
  for (int l = 0; l < views.size(); ++l) {
    const MapLandmark& landmark = views.landmark(l);
    if (landmark.plane == 0) continue;
    const auto found = planes_.find(landmark.plane);
    if (found == planes_.end()) continue;
    if (std::abs(built_->problem.planes[found->second].plane.signedDistance(landmark.p_W)) <= 0.1)
      plane[l] = found->second;
  }
  const std::vector<int> hosts =
      chooseHosts(views, plane, built_->problem.planes, geometry_, settings_.shared_hosts, settings_.middle_hosts);
  const std::vector<backend::OffPlane> off =
      backend::distancesOffPlane(views, plane, hosts, built_->problem.planes, geometry_);
  const double sigma = settings_.measurement.surface_sigma;
  if (settings_.measure_surfaces)
    built_->surface_variances = backend::surfaceVariances(off, plane, planes_.size(), sigma);
  const auto surface = [&](int p) {
    if (settings_.measure_surfaces) return built_->surface_variances[p];
    const double measured = map_.planes().at(built_->planes[p]).surface_variance;
    return measured > 0 ? measured : sigma * sigma;
  };
  // Grouped by plane and host, so that the homographies shared by a group's pairs are computed once.
  struct Member {
    int plane, host, landmark;
    bool operator<(const Member& o) const {
      return std::tie(plane, host, landmark) < std::tie(o.plane, o.host, o.landmark);
    }
  };
  std::vector<Member> members;
  for (int l = 0; l < views.size(); ++l)
    if (hosts[l] >= 0 && backend::liesOnPlane(off[l], surface(plane[l])))
      members.push_back({plane[l], views.begin(l)[hosts[l]].frame, l});
  std::sort(members.begin(), members.end());
  std::vector<int> slot(geometry_.size(), -1);
  std::vector<Observer> observers;
  for (std::size_t m = 0; m < members.size(); ++m) {
    const Member& member = members[m];
    taken[member.landmark] =
        collectPairs(views, member.landmark, hosts[member.landmark], member.plane, &slot, &observers);
    const bool last =
        m + 1 == members.size() || members[m + 1].plane != member.plane || members[m + 1].host != member.host;
    if (last) storeGroup(member.host, member.plane, &observers, &slot);
  }
  return taken;
}

int PlaneFactorBuilder::observerOf(int frame, int host, const Plane& plane, std::vector<int>* slot,
                                   std::vector<Observer>* observers) const {
  int& place = (*slot)[frame];
  if (place < 0) {
    place = static_cast<int>(observers->size());
    Observer observer;
    observer.frame = frame;
    observer.h = homographyVector(geometry_[host], geometry_[frame], plane);
    observers->push_back(observer);
  }
  return place;
}

bool PlaneFactorBuilder::collectPairs(const LandmarkViews& views, int landmark, int host_view, int plane,
                                      std::vector<int>* slot, std::vector<Observer>* observers) {
  const MeasurementOptions& options = settings_.measurement;
  const Plane& parameters = built_->problem.planes[plane].plane;
  const LandmarkView& host = views.begin(landmark)[host_view];
  const bool host_fixed = built_->problem.frames[host.frame].fixed;
  // Outliers are judged with at least the gate's variance.
  const auto square = [](double x) { return x * x; };
  const double gate = 1 / square(built_->gate_weight), host_variance = square(host.sigma);
  const double host_judged = std::max(host_variance, gate);
  const Eigen::Vector2d xy_i = host.xy.cast<double>();
  pairs_.clear();
  refused_.clear();
  int tried = 0;
  if (host.slides) return true;
  for (const LandmarkView* v = views.begin(landmark); v != views.end(landmark); ++v) {
    if (v->frame == host.frame || (host_fixed && built_->problem.frames[v->frame].fixed)) continue;
    if (v->slides) continue;
    ++tried;
    const int place = observerOf(v->frame, host.frame, parameters, slot, observers);
    const Observer& observer = (*observers)[place];
    const Eigen::Vector3d p = transfer(observer.h, xy_i);
    const double rho = p.z();
    // The pair's variance: the observer's plus the host's transferred into the observer, on the way to which it shrinks
    // where that sees the plane edge-on.
    const double gain = hostNoiseGain(observer.h, p);
    const double own = square(v->sigma);
    const double variance = own + gain * host_variance, judged = std::max(own, gate) + gain * host_judged;
    // After compression outliers cannot be down-weighted: gate and weight here, at the present estimate.
    const Eigen::Vector2d xy_j = v->xy.cast<double>();
    const double error = (p.head<2>() - rho * xy_j).squaredNorm() / (rho * rho);
    if (!(rho > 0) || error > options.outlier_chi2 * judged) {
      refused_.push_back(v);
      continue;
    }
    const double squared = error / variance;
    const double weight = redescendingScale(squared, kNoiseSigmas * options.huber) / (std::sqrt(variance) * rho);
    pairs_.push_back({place, {xy_i, xy_j, weight}, v->own_track, squared});
  }
  if (tried == 0 || 2 * static_cast<int>(refused_.size()) > tried) return false;
  if (settings_.variant == Variant::kVip) keepRefused(views.landmark(landmark).id);
  if (options.huber > 0) weighTrack();
  for (const PairOfObserver& p : pairs_) {
    Observer& observer = (*observers)[p.observer];
    ++observer.pairs;
    if (settings_.variant == Variant::kViP)
      observer.uncompressed.push_back(p.pair);
    else
      addHomographyPair(p.pair, &observer.sums);
  }
  return true;
}

void PlaneFactorBuilder::keepRefused(LandmarkId landmark) {
  for (const LandmarkView* v : refused_) {
    RefusedView view;
    view.landmark = landmark;
    view.keyframe = built_->frames[v->frame];
    view.observation.frame = v->frame;
    view.observation.x = v->xy.x();
    view.observation.y = v->xy.y();
    view.observation.weight = 1.0 / v->sigma;
    built_->refused.push_back(view);
  }
}

// The errors of a bad track are common to its pairs: the patch slides, shows a depth edge, or is not on the plane. So
// its variance is unknown with a prior, which makes its errors jointly Student's t.
void PlaneFactorBuilder::weighTrack() {
  double expected = kTrackFreedom, found = kTrackFreedom;
  for (const PairOfObserver& p : pairs_) {
    if (!p.own_track) continue;
    expected += 2;
    found += p.error;
  }
  if (found <= expected) return;
  const double factor = std::sqrt(expected / found);
  for (PairOfObserver& p : pairs_)
    if (p.own_track) p.pair.weight *= factor;
}

void PlaneFactorBuilder::storeGroup(int host, int plane, std::vector<Observer>* observers, std::vector<int>* slot) {
  for (const Observer& o : *observers) (*slot)[o.frame] = -1;
  std::sort(observers->begin(), observers->end(),
            [](const Observer& a, const Observer& b) { return a.frame < b.frame; });
  for (const Observer& o : *observers) {
    // Any number of pairs will do: compressed or not they are two rows each. Nor does the baseline matter, without
    // which they constrain the poses but not the plane.
    if (o.pairs == 0) continue;
    if (settings_.variant == Variant::kViP) {
      for (const HomographyPair& pair : o.uncompressed)
        built_->problem.homography_pairs.push_back({host, o.frame, plane, pair});
    } else {
      built_->problem.homographies.push_back({host, o.frame, plane, o.sums, o.pairs});
    }
  }
  observers->clear();
}

std::vector<PlaneFactorBuilder::DepthBlock> PlaneFactorBuilder::collectDepthBlocks() const {
  const BaProblem& problem = built_->problem;
  std::unordered_map<KeyframeId, int> frames;
  for (std::size_t f = 0; f < built_->frames.size(); ++f) frames[built_->frames[f]] = static_cast<int>(f);
  std::vector<DepthBlock> blocks;
  for (const auto& entry : map_.keyframes()) {
    const auto frame = frames.find(entry.first);
    const bool constant = frame == frames.end() || problem.frames[frame->second].fixed;
    const Eigen::Matrix4d T_W_C = entry.second.T_W_C().matrix();
    for (const auto& observation : entry.second.planes) {
      const auto plane = planes_.find(observation.first);
      if (plane == planes_.end()) continue;
      const Plane& parameters = problem.planes[plane->second].plane;
      const Eigen::Vector4d plane_C = T_W_C.transpose() * parameters.coefficients();
      PlaneGate gate(observation.second, plane_C);
      if (!gate.all() && gate.kept().empty()) continue;
      DepthBlock block{constant ? -1 : frame->second,
                       plane->second,
                       &entry.second,
                       &observation.second,
                       std::move(gate),
                       plane_C,
                       1,
                       1,
                       Eigen::Matrix4d::Identity(),
                       0};
      blocks.push_back(std::move(block));
    }
  }
  return blocks;
}

// Of n keyframes that share their error each one's shared variance counts n times, so that they are worth one.
void PlaneFactorBuilder::findTogether(std::vector<DepthBlock>* blocks) {
  std::map<int, std::vector<DepthBlock*>> of_plane;  // ascending in time within each odometry
  for (DepthBlock& block : *blocks) of_plane[block.plane].push_back(&block);
  for (auto& entry : of_plane) {
    std::vector<DepthBlock*>& list = entry.second;
    for (std::size_t i = 0; i < list.size(); ++i) {
      for (std::size_t j = i + 1; j < list.size(); ++j) {
        const TrackedFrame &a = list[i]->keyframe->data->frame, &b = list[j]->keyframe->data->frame;
        const double correlation = sharedDepth(b.t - a.t);
        if (!(correlation > 0) || a.epoch != b.epoch) break;
        list[i]->together += correlation;
        list[j]->together += correlation;
      }
    }
  }
}

void PlaneFactorBuilder::addDepthBlocks() {
  if (planes_.empty()) return;
  BaProblem& problem = built_->problem;
  std::vector<DepthBlock> blocks = collectDepthBlocks();
  findTogether(&blocks);
  std::vector<PlaneMisfit> misfits;
  misfits.reserve(blocks.size());
  for (DepthBlock& block : blocks) {
    const PlaneObservation& o = *block.observation;
    const SurfaceNoise parts = surfaceNoise(o.G / o.weight_scale, o.points.size(), block.plane_C.head<3>(),
                                            settings_.depth_noise, built_->depth_noise);
    block.white = parts.white;
    const Eigen::Matrix4d G = block.gate.G() / (o.weight_scale * block.white);
    block.T = sharedErrorShrinkage(G, parts.shared * block.together);
    block.misfit = planeMisfit(block.T * G * block.T.transpose(), block.plane_C);
    misfits.push_back({block.plane, block.misfit});
  }
  const std::vector<double> weights = planeWeights(misfits, problem.planes.size());
  // Constant keyframes: their points form one block per plane in world coordinates, of a fixed frame at the origin.
  std::map<int, BaPointToPlane> outside;
  for (const DepthBlock& block : blocks) {
    const PlaneObservation& o = *block.observation;
    const double scale = weights[block.plane] / (block.white * o.weight_scale);
    const Eigen::Matrix4d G = scale * block.T * block.gate.G() * block.T.transpose();
    if (block.frame < 0) {
      const Eigen::Matrix4d T_W_C = block.keyframe->T_W_C().matrix();
      BaPointToPlane& sum = outside[block.plane];
      sum.G += T_W_C * G * T_W_C.transpose();
      ++sum.points;
    } else if (settings_.variant == Variant::kViP) {
      for (int k = 0; k < block.gate.points(); ++k) {
        const PlaneSample& p = o.points[block.gate.all() ? k : block.gate.kept()[k]];
        BaPlaneSample factor;
        factor.frame = block.frame;
        factor.plane = block.plane;
        const Eigen::Vector4d shrunk = block.T * p.p_C.cast<double>().homogeneous();
        factor.p_C = shrunk.hnormalized();
        factor.weight = shrunk(3) * std::sqrt(weights[block.plane] / block.white) / p.sigma;
        problem.plane_samples.push_back(factor);
      }
    } else {
      BaPointToPlane factor;
      factor.frame = block.frame;
      factor.plane = block.plane;
      factor.G = G;
      factor.points = block.gate.points();
      problem.point_to_plane.push_back(factor);
    }
  }
  if (outside.empty()) return;
  BaFrame world;
  world.fixed = true;
  world.motion = false;
  const int world_frame = static_cast<int>(problem.frames.size());
  problem.frames.push_back(world);
  built_->frames.push_back(0);
  for (auto& sum : outside) {
    sum.second.frame = world_frame;
    sum.second.plane = sum.first;
    problem.point_to_plane.push_back(sum.second);
  }
}

}  // namespace vip_slam
