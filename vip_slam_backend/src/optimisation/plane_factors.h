// SPDX-License-Identifier: BSD-3-Clause
// Planes of a problem: homographies from landmarks on planes, point-to-plane blocks from depth, priors.
#pragma once

#include <map>
#include <vector>

#include "landmark_views.h"
#include "plane_gate.h"
#include "vip_slam_backend/factors/frame_geometry.h"
#include "vip_slam_backend/optimisation/problem_builder.h"

namespace vip_slam {

class PlaneFactorBuilder {
 public:
  /// Adds the planes that a free frame sees to the problem.
  PlaneFactorBuilder(const Map& map, const ProblemScope& scope, const BuilderSettings& settings, BuiltProblem* built);
  /// Turns landmarks on planes into host-observer pairs, compressed unless the variant says otherwise. Returns per
  /// landmark whether it was used; one that is on no plane or fails the gate stays a free point.
  std::vector<char> addHomographies(const LandmarkViews& views);
  /// Adds blocks of the keyframes' depth points, weighted by their agreement with the planes.
  void addDepthBlocks();

 private:
  struct Observer;
  int observerOf(int frame, int host, const Plane& plane, std::vector<int>* slot,
                 std::vector<Observer>* observers) const;
  bool collectPairs(const LandmarkViews& views, int landmark, int host_view, int plane, std::vector<int>* slot,
                    std::vector<Observer>* observers);
  // Depth points of one keyframe on one plane, after gating.
  struct DepthBlock {
    int frame, plane;  // frame -1: the keyframe is constant
    const MapKeyframe* keyframe;
    const PlaneObservation* observation;
    PlaneGate gate;
    Eigen::Vector4d plane_C;
    double together;    // keyframes whose depth errs alike, this one included
    double white;       // variance of the samples' own errors, relative to what they were made with
    Eigen::Matrix4d T;  // shrinkage of the points by what they share
    double misfit;
  };
  std::vector<DepthBlock> collectDepthBlocks() const;
  /// Finds out how many keyframes share each block's error.
  static void findTogether(std::vector<DepthBlock>* blocks);
  void storeGroup(int host, int plane, std::vector<Observer>* observers, std::vector<int>* slot);

  const Map& map_;
  const BuilderSettings& settings_;
  struct PairOfObserver {
    int observer;
    HomographyPair pair;
    bool own_track;  // the view is of the host's track
    double error;    // squared, in sigmas
  };
  /// Records the gated views, to be judged again once the problem is solved.
  void keepRefused(LandmarkId landmark);
  /// Reduces the weight of all pairs of a track whose errors are larger than expected.
  void weighTrack();
  std::vector<PairOfObserver> pairs_;         // of the present landmark
  std::vector<const LandmarkView*> refused_;  // likewise
  BuiltProblem* built_;
  std::vector<FrameGeometry> geometry_;
  std::map<PlaneId, int> planes_;
};

}  // namespace vip_slam
