// SPDX-License-Identifier: BSD-3-Clause
#include "fit_to_observations.h"

#include "vip_slam_core/geometry/angle.h"

namespace vip_slam::planes {
namespace {

constexpr double kSureDirection = 2.0 * kDegree;  // largest sigma of a determined direction, rad

}  // namespace

void fitToObservations(PlaneTrack* track, const PlacedKeyframes& keyframes) {
  track->refit_due = false;
  if (track->optimised() && track->determined) return;
  const PlaneMoments moments = track->samples(keyframes.poses());
  if (!(moments.weight() > 0)) return;
  track->determined = normalSigma(moments, track->kind()) < kSureDirection;
  if (track->optimised()) return;
  // Until the samples determine the direction, keep that of detection, which used the surface up to its border.
  Plane plane = Plane::fromPointNormal(moments.centroid(), track->plane().n);
  if (track->determined && !fitLeaningPlane(moments, track->kind(), keyframes.gravitySigma(), track->plane().n, &plane))
    return;
  track->setPlane(plane);
}

}  // namespace vip_slam::planes
