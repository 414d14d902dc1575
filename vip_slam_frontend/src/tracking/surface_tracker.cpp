// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/surface_tracker.h"

#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "vip_slam_frontend/filter/gating.h"
#include "vip_slam_frontend/tracking/patch_surface.h"

namespace vip_slam {

namespace {

constexpr int kSampleStep = 3;  // px between samples of a patch
constexpr int kStride = 32;     // px between patches
constexpr int kReach = 9;       // px from a patch's centre to its edge
// What two images less than half a second apart see of a wall errs alike (correlation 0.5 to 0.9, measured on Kinect,
// Xtion and a LiDAR phone): so much of their errors is left in the difference.
constexpr double kApart = 0.7;

/// A reading of a patch.
struct Sample {
  double z;
  Eigen::Vector2d at;  ///< place in the patch, px
};

}  // namespace

SurfaceTracker::SurfaceTracker(std::shared_ptr<const CameraModel> camera, const DepthNoise& noise, int window)
    : camera_(std::move(camera)), noise_(noise), window_(window) {
  const CameraIntrinsics& k = camera_->intrinsics();
  if (k.model == DistortionModel::kNone) return;
  undistorted_.reserve(static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height));
  for (int v = 0; v < k.height; ++v) {
    for (int u = 0; u < k.width; ++u) {
      Eigen::Vector2d xy;
      if (!camera_->undistort(Eigen::Vector2d(u, v), &xy)) xy.setConstant(std::nan(""));
      undistorted_.push_back(xy.cast<float>());
    }
  }
}

bool SurfaceTracker::fit(const cv::Mat& depth, int u, int v, SurfacePatch* patch) const {
  if (u < kReach || v < kReach || u + kReach >= depth.cols || v + kReach >= depth.rows) return false;
  Eigen::Vector2d xy;
  Eigen::Matrix2d d_uv_xy;
  if (!camera_->undistort(Eigen::Vector2d(u, v), &xy)) return false;
  camera_->distort(xy, &d_uv_xy);
  // A plane N^T p = 1 is affine in inverse depth, 1/z = N^T (x, y, 1), and for a pinhole also in pixels. With
  // distortion use the pixels of the pinhole that is tangent to the lens at the patch's centre: in a fisheye's own
  // pixels the curvature of a floor would appear as an offset of all depth.
  const auto place = [&](int x, int y) -> Eigen::Vector2d {
    if (undistorted_.empty()) return {x, y};
    const std::size_t pixel = static_cast<std::size_t>(v + y) * static_cast<std::size_t>(depth.cols);
    return d_uv_xy * (undistorted_[pixel + static_cast<std::size_t>(u + x)].cast<double>() - xy);
  };
  const int side = 2 * kReach / kSampleStep + 1;
  std::vector<Sample> samples;
  samples.reserve(side * side);
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (int y = -kReach; y <= kReach; y += kSampleStep) {
    const float* row = depth.ptr<float>(v + y) + u;
    for (int x = -kReach; x <= kReach; x += kSampleStep) {
      const double z = row[x];
      const Eigen::Vector2d at = place(x, y);
      if (!noise_.inRange(z) || !at.allFinite()) continue;
      const double w = z * z / noise_.sigma(z);
      const Eigen::Vector3d J(w, w * at.x(), w * at.y());
      A += J * J.transpose();
      b += J * (w / z);
      samples.push_back({z, at});
    }
  }
  if (samples.size() < kMinValid * side * side) return false;
  const Eigen::Matrix3d covariance = A.inverse();
  const Eigen::Vector3d c = covariance * b;
  if (!c.allFinite() || !(c.x() > 1.0 / noise_.max_range)) return false;
  int explained = 0;
  for (const Sample& s : samples) {
    const double inverse = c.x() + c.y() * s.at.x() + c.z() * s.at.y();
    explained += inverse > 0 && std::abs(1.0 / inverse - s.z) < kReadingSigmas * noise_.sigma(s.z);
  }
  if (explained < kGateProbability * samples.size()) return false;

  const Eigen::Vector2d gradient = d_uv_xy.transpose() * c.tail<2>();
  const Eigen::Vector3d ray = xy.homogeneous();
  const Eigen::Vector3d N(gradient.x(), gradient.y(), c.x() - gradient.dot(xy));
  patch->p_C = ray / c.x();
  patch->n_C = -N.normalized();
  const double towards = -patch->n_C.dot(ray);  // d distance / d z
  patch->reading = towards * noise_.sigma(1.0 / c.x());
  const double fitted = towards * std::sqrt(covariance(0, 0)) / (c.x() * c.x());
  patch->sigma = std::max(fitted, learnt_.white() * patch->reading);
  // Rotation of N by the gradient's errors; the camera's own magnification is left out.
  const double slope = std::sqrt(std::max(covariance(1, 1), covariance(2, 2)));
  patch->sigma_normal = slope * d_uv_xy.norm() / N.norm();
  return true;
}

std::vector<SurfacePatch> SurfaceTracker::patches(const cv::Mat& depth, const MovingRegions& moving) const {
  std::vector<SurfacePatch> result;
  for (int v = kReach; v + kReach < depth.rows; v += kStride) {
    for (int u = kReach; u + kReach < depth.cols; u += kStride) {
      SurfacePatch patch;
      if (!fit(depth, u, v, &patch) || moving.moves({u, v}, patch.p_C.z())) continue;
      patch.cell = {u / kStride, v / kStride};
      result.push_back(patch);
    }
  }
  return result;
}

bool SurfaceTracker::sees(const cv::Mat& depth) const { return shareNormals(patches(depth, {})).size() >= kEnough; }

void SurfaceTracker::setReference(const cv::Mat& depth, CloneId clone, const MovingRegions& moving) {
  patches_ = shareNormals(patches(depth, moving));
  learnt_.addImage(patches_);
  reference_ = clone;
}

void SurfaceTracker::clear() {
  patches_.clear();
  reference_ = 0;
}

SurfaceMatches SurfaceTracker::match(const cv::Mat& depth, const SE3& T_cur_ref, const MovingRegions& moving) {
  SurfaceMatches result;
  result.reference = reference_;
  // The filter takes the images for independent. But all images of a window meet the same errors of one reference, and
  // what surfaces share hardly changes meanwhile: with so many times these variances the images together are worth what
  // they should be.
  const double repeated = std::sqrt(window_);
  std::vector<frontend::SurfaceDifference> differences;
  const SE3 T_ref_cur = T_cur_ref.inverse();
  for (const SurfacePatch& patch : patches_) {
    Eigen::Vector2d uv;
    SurfacePatch seen;
    if (!camera_->project(T_cur_ref * patch.p_C, &uv) || !camera_->inImage(uv)) continue;
    if (!fit(depth, static_cast<int>(std::lround(uv.x())), static_cast<int>(std::lround(uv.y())), &seen)) continue;
    if (moving.moves(uv, seen.p_C.z())) continue;
    const double turned = seen.n_C.cross(T_cur_ref.R() * patch.n_C).norm();
    if (turned > kGateSigmas * std::hypot(patch.sigma_normal, seen.sigma_normal)) continue;  // another surface
    const double reading = std::hypot(patch.reading, seen.reading);
    result.pairs.push_back({patch.p_C, patch.n_C, seen.p_C, std::hypot(repeated * patch.sigma, seen.sigma),
                            repeated * kApart * learnt_.shared() * reading, patch.surface});
    differences.push_back({patch.surface, patch.p_C, patch.n_C.dot(T_ref_cur * seen.p_C - patch.p_C), reading});
  }
  learnt_.addDifferences(differences);
  return result;
}

}  // namespace vip_slam
