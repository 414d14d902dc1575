// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/plane_mapper.h"

#include <stdexcept>
#include <utility>

#include "plane_mapper_impl.h"

namespace vip_slam {
namespace {

const CameraModel& checked(const std::shared_ptr<const CameraModel>& camera, const DepthNoise& noise) {
  if (!camera) throw std::invalid_argument("plane mapper: the camera model is missing");
  const std::string fault = noise.validate();
  if (!fault.empty()) throw std::invalid_argument("plane mapper: depth noise: " + fault);
  return *camera;
}

}  // namespace

PlaneMapper::Impl::Impl(const PlaneMapperOptions& options, std::shared_ptr<const CameraModel> camera,
                        const DepthNoise& noise, TimingLog* timing)
    : options_(options),
      camera_(std::move(camera)),
      noise_(noise),
      timing_(timing),
      mesher_(options.mesh, camera_, noise),
      observer_(options, camera_, noise),
      evidence_(options.detection, options.growth),
      keyframes_(noise),
      planes_(options),
      points_(options.association, checked(camera_, noise).focal(), noise.bias_floor) {}

PlaneMapperCounters PlaneMapper::Impl::counters() const {
  PlaneMapperCounters all = counters_;
  const auto& [started, merged, removed] = planes_.counts();
  all.planes_started = started, all.planes_merged = merged, all.planes_removed = removed;
  all.keyframes_waiting = keyframes_.waiting();
  all.point_candidates = points_.candidates();
  return all;
}

PlaneMapper::PlaneMapper(const PlaneMapperOptions& options, std::shared_ptr<const CameraModel> camera,
                         const DepthNoise& noise, TimingLog* timing)
    : impl_(new Impl(options, std::move(camera), noise, timing)) {}
PlaneMapper::~PlaneMapper() = default;

void PlaneMapper::addKeyframe(KeyframePtr keyframe) { impl_->addKeyframe(keyframe); }
void PlaneMapper::grow(const TrackedFrame& frame, const SE3& T_map_odom) { impl_->grow(frame, T_map_odom); }
PlaneUpdate PlaneMapper::applyMapUpdate(const MapUpdate& update) { return impl_->applyMapUpdate(update); }
const std::vector<PlaneEstimate>& PlaneMapper::planes() const { return impl_->published(); }
void PlaneMapper::restore(const std::vector<StoredPlane>& planes, KeyframeId newest_keyframe) {
  impl_->restore(planes, newest_keyframe);
}
void PlaneMapper::clear() { impl_->clear(); }
PlaneMapperCounters PlaneMapper::counters() const { return impl_->counters(); }

}  // namespace vip_slam
