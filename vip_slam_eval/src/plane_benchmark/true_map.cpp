// SPDX-License-Identifier: BSD-3-Clause
#include "plane_benchmark/true_map.h"

#include <cmath>

namespace vip_slam {

bool TrueMap::place(TrackedFrame* frame) const {
  SE3 T_W_I;
  if (!poseAt(truth_, frame->t + sensor_.time_offset, &T_W_I)) return false;
  frame->state.T_W_I = T_W_I;
  frame->T_I_C = sensor_.T_imu_cam;
  frame->epoch = 0;
  return true;
}

MapUpdate TrueMap::addKeyframe(const Keyframe& keyframe) {
  MapUpdate update;
  update.revision = ++revision_;
  update.t = keyframe.frame.t;
  update.newest_keyframe = keyframe.id;
  update.keyframes.push_back(
      {keyframe.id, keyframe.frame.state, keyframe.frame.T_I_C, keyframe.frame.camera_correction});
  const SE3 T_W_C = keyframe.frame.state.T_W_I * keyframe.frame.T_I_C;
  for (const Feature& f : keyframe.frame.features) {
    if (f.id == kNoLandmark) continue;
    Landmark& landmark = landmarks_[f.id];
    ++landmark.keyframes;
    if (f.depth > 0) {
      const double sigma = std::hypot(double(f.depth_sigma), 0.001);
      landmark.sum += T_W_C * (Eigen::Vector3d(f.xy.x(), f.xy.y(), 1.0) * f.depth) / (sigma * sigma);
      landmark.weight += 1.0 / (sigma * sigma);
    }
    if (landmark.weight == 0) continue;
    LandmarkEstimate estimate;
    estimate.id = f.id;
    estimate.p_W = landmark.sum / landmark.weight;
    estimate.observations = static_cast<std::uint32_t>(landmark.keyframes);
    estimate.plane = landmark.plane;
    update.landmarks.push_back(estimate);
  }
  return update;
}

void TrueMap::apply(const PlaneUpdate& update) {
  for (const PlaneMerge& merge : update.merges) {
    for (auto& [id, landmark] : landmarks_) {
      if (landmark.plane == merge.from) landmark.plane = merge.into;
    }
  }
  for (PlaneId removed : update.removed) {
    for (auto& [id, landmark] : landmarks_) {
      if (landmark.plane == removed) landmark.plane = 0;
    }
  }
  for (LandmarkId id : update.dissociated) landmarks_[id].plane = 0;
  for (const auto& [id, plane] : update.associated) landmarks_[id].plane = plane;
}

std::vector<LabelledPoint> TrueMap::points() const {
  std::vector<LabelledPoint> points;
  for (const auto& [id, landmark] : landmarks_) {
    if (landmark.weight == 0) continue;
    points.push_back({id, landmark.sum / landmark.weight, landmark.plane, landmark.keyframes});
  }
  return points;
}

}  // namespace vip_slam
