// SPDX-License-Identifier: BSD-3-Clause
// Association of landmarks with planes (paper section "Point and Plane Association"): candidate set and decisions. The
// data of landmarks follow the merges and positions in the back end's MapUpdates.
#pragma once

#include <functional>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "vip_slam_core/types/keyframe.h"
#include "vip_slam_core/types/landmark_aliases.h"
#include "vip_slam_core/types/map_update.h"
#include "vip_slam_core/types/plane_map.h"
#include "vip_slam_planes/association/surface_labels.h"
#include "vip_slam_planes/growth/plane_track.h"
#include "vip_slam_planes/plane_mapper_options.h"

namespace vip_slam {

class PointAssociation {
 public:
  /// focal in pixels; depth_floor: systematic depth error, metres.
  PointAssociation(const PointAssociationOptions& options, double focal, double depth_floor)
      : options_(options), focal_(focal), depth_floor_(depth_floor) {}

  void applyMapUpdate(const MapUpdate& update);
  /// Adds the sightings of a placed keyframe, once per keyframe.
  void addSightings(const Keyframe& keyframe);
  /// Replaces its sightings after a new camera correction.
  void renewSightings(const Keyframe& keyframe);
  void removeKeyframe(const Keyframe& keyframe);

  /// Ids of merged landmarks: whoever owns the keyframes tells at times which tracks they still contain.
  LandmarkAliases& aliases() { return aliases_; }

  using FindPlane = std::function<const Plane*(PlaneId)>;
  /// Adds candidates from a keyframe whose nodes are labelled with indices into `plane_of_label`; decides on those that
  /// enough keyframes see. `trusted[k]` is false for planes that may not take points yet.
  void process(const Keyframe& keyframe, const SurfaceLabels& labels, const std::vector<PlaneId>& plane_of_label,
               const std::vector<char>& trusted, const CameraPoses& poses, const FindPlane& plane);
  /// Decides on all candidates of a plane that may take points from now on, in view or not.
  void decide(PlaneId id, const Plane& plane, const CameraPoses& poses);
  /// Re-checks all associated landmarks against moved planes; cheap.
  void recheck(const FindPlane& plane);

  void renamePlane(PlaneId from, PlaneId into);
  void removePlane(PlaneId id);
  /// Dissociates the points of a plane that may be several surfaces; they stay its candidates.
  void releaseFrom(PlaneId id);
  void clear();

  /// Changes since the last call.
  std::vector<std::pair<LandmarkId, PlaneId>> takeAssociated();
  std::vector<LandmarkId> takeDissociated();
  /// The plane of a landmark, 0: none.
  PlaneId planeOf(LandmarkId id) const;
  /// Number of landmarks with an undecided candidate; counted incrementally, since there are many landmarks.
  std::size_t candidates() const { return undecided_; }

 private:
  struct Sighting {
    KeyframeId keyframe;
    std::uint32_t feature;  ///< index among the keyframe's features
    Eigen::Vector2f xy;
    float depth, depth_sigma, pixel_sigma;
  };
  struct Landmark {
    std::vector<Sighting> sightings;
    Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
    bool placed = false;
    PlaneId plane = 0;      ///< associated
    PlaneId candidate = 0;  ///< 0: none
    int failures = 0;
    std::size_t tested = 0;  ///< number of sightings at the last test
    std::vector<PlaneId> refused;
  };
  using Landmarks = std::unordered_map<LandmarkId, Landmark>;
  static bool undecided(const Landmark& landmark) { return landmark.candidate && !landmark.plane; }
  void assign(LandmarkId id, Landmark* landmark, PlaneId candidate, PlaneId plane);
  void erase(Landmarks::iterator it);
  std::vector<LandmarkId> landmarksOf(PlaneId plane) const;
  /// The plane that a feature may lie on according to the labels around it, 0: none.
  PlaneId chooseCandidate(const Feature& feature, const Landmark& landmark, const SurfaceLabels& labels,
                          const std::vector<PlaneId>& plane_of_label, const SE3& T_map_C, const FindPlane& plane) const;
  void setPlane(LandmarkId id, Landmark* landmark, PlaneId plane);
  /// Whether there are enough sightings for a (new) test.
  bool isDue(const Landmark& landmark) const;
  void test(LandmarkId id, Landmark* landmark, const CameraPoses& poses, const Plane& plane);

  PointAssociationOptions options_;
  double focal_, depth_floor_;
  Landmarks landmarks_;
  std::unordered_map<PlaneId, std::unordered_set<LandmarkId>> on_plane_;  ///< candidates and associated ones
  std::size_t undecided_ = 0;
  LandmarkAliases aliases_;
  std::vector<std::pair<LandmarkId, PlaneId>> associated_;
  std::vector<LandmarkId> dissociated_;
};

}  // namespace vip_slam
