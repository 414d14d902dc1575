// SPDX-License-Identifier: BSD-3-Clause
// Camera models: pixels <-> normalised coordinates (x, y, 1) in the optical frame (x right, y down, z forward).
// Pixel (0,0) is the centre of the top-left pixel, as in OpenCV and ROS.
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace vip_slam {

enum class DistortionModel { kNone, kRadTan, kEquidistant };

/// "none", "radtan" (also "plumb_bob", "rational_polynomial"), "equidistant" (also "fisheye"); throws on others.
DistortionModel distortionModelFromName(const std::string& name);
std::string distortionModelName(DistortionModel model);

struct CameraIntrinsics {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< pixels
  DistortionModel model = DistortionModel::kNone;
  /// radtan: k1 k2 p1 p2 [k3 [k4 k5 k6]] in OpenCV order; equidistant: k1 k2 k3 k4.
  std::vector<double> distortion;

  /// Intrinsics of the image resized to that many pixels (pixel centres kept consistent).
  CameraIntrinsics scaled(int new_width, int new_height) const;
  /// Empty when usable, else what is wrong ("fx must be > 0, is 0").
  std::string validate() const;
};

class CameraModel {
 public:
  virtual ~CameraModel() = default;

  const CameraIntrinsics& intrinsics() const { return intrinsics_; }
  int width() const { return intrinsics_.width; }
  int height() const { return intrinsics_.height; }
  double focal() const { return 0.5 * (intrinsics_.fx + intrinsics_.fy); }

  /// Distorts normalised coordinates into pixels; optional 2x2 Jacobian d(pixel)/d(xy).
  virtual Eigen::Vector2d distort(const Eigen::Vector2d& xy, Eigen::Matrix2d* J = nullptr) const = 0;
  /// Inverse of distort(); false when the pixel has no pre-image (then xy is the best iterate).
  virtual bool undistort(const Eigen::Vector2d& uv, Eigen::Vector2d* xy) const = 0;

  /// Projects p_C (metres). False when z <= 1e-6 or (distortion folds over); uv may lie outside the image.
  bool project(const Eigen::Vector3d& p_C, Eigen::Vector2d* uv, Eigen::Matrix<double, 2, 3>* J = nullptr) const;
  /// Pixel and depth z (metres) to p_C.
  Eigen::Vector3d unproject(const Eigen::Vector2d& uv, double z) const;
  /// Inside the image by at least `margin` pixels.
  bool inImage(const Eigen::Vector2d& uv, double margin = 0.0) const;

 protected:
  explicit CameraModel(CameraIntrinsics intrinsics) : intrinsics_(std::move(intrinsics)) {}
  CameraIntrinsics intrinsics_;
  /// Squared normalised radius up to which the distortion is one-to-one; project() refuses points beyond.
  double max_radius2_ = std::numeric_limits<double>::infinity();
};

/// Throws std::invalid_argument with the message of intrinsics.validate() when unusable, and when the distortion folds
/// most of the image over.
std::shared_ptr<const CameraModel> makeCamera(const CameraIntrinsics& intrinsics);

}  // namespace vip_slam
