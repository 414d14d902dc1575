#include "vip_slam_core/types/depth_correction.h"

#include <algorithm>

namespace vip_slam {
namespace {

constexpr double kNearest = 1e-3;  // m

}  // namespace

float shiftedDepth(float z, double change) { return z > 0 ? static_cast<float>(std::max(kNearest, z + change)) : z; }

Eigen::Vector3f shiftedPoint(const Eigen::Vector3f& p_C, double change) {
  return p_C.z() > 0 ? Eigen::Vector3f(p_C * (shiftedDepth(p_C.z(), change) / p_C.z())) : p_C;
}

KeyframePtr withDepthCorrection(const KeyframePtr& keyframe, double correction) {
  const double change = correction - keyframe->frame.depth_correction;
  if (change == 0) return keyframe;
  auto corrected = std::make_shared<Keyframe>(*keyframe);
  corrected->frame.depth_correction = correction;
  for (Feature& f : corrected->frame.features) f.depth = shiftedDepth(f.depth, change);
  for (float& z : corrected->frame.depth_grid.z) z = shiftedDepth(z, change);
  return corrected;
}

void setDepthCorrection(double correction, PlaneObservation* observation) {
  const double change = correction - observation->depth_correction;
  observation->depth_correction = correction;
  if (change == 0 || observation->points.empty()) return;
  observation->G.setZero();
  for (PlanePoint& point : observation->points) {
    point.p_C = shiftedPoint(point.p_C, change);
    const Eigen::Vector4d p = point.p_C.cast<double>().homogeneous();
    observation->G += observation->weight_scale / (double(point.sigma) * double(point.sigma)) * p * p.transpose();
  }
}

}  // namespace vip_slam
