#include "vip_slam_planes/plane_mapper.h"

#include <stdexcept>

namespace vip_slam {

class PlaneMapper::Impl {
 public:
  PlaneMapperOptions options;
  PlaneMapperCounters counters;
  std::vector<PlaneEstimate> published;
};

PlaneMapper::PlaneMapper(const PlaneMapperOptions& options, std::shared_ptr<const CameraModel> camera,
                         const DepthNoise& noise, TimingLog*)
    : impl_(new Impl) {
  if (!camera) throw std::invalid_argument("plane mapper: no camera model");
  const std::string bad = noise.validate();
  if (!bad.empty()) throw std::invalid_argument("plane mapper: depth noise: " + bad);
  impl_->options = options;
}
PlaneMapper::~PlaneMapper() = default;
void PlaneMapper::addKeyframe(KeyframePtr) {}
void PlaneMapper::grow(const TrackedFrame&, const SE3&) {}
PlaneUpdate PlaneMapper::applyMapUpdate(const MapUpdate& update) {
  PlaneUpdate result;
  result.revision = update.revision;
  result.t = update.t;
  return result;
}
const std::vector<PlaneEstimate>& PlaneMapper::planes() const { return impl_->published; }
void PlaneMapper::restore(const std::vector<PlaneEstimate>& planes) { impl_->published = planes; }
void PlaneMapper::clear() { impl_->published.clear(); }
const PlaneMapperCounters& PlaneMapper::counters() const { return impl_->counters; }
const PlaneMapperOptions& PlaneMapper::options() const { return impl_->options; }

}  // namespace vip_slam
