// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/camera/camera_model.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/LU>

#include "vip_slam_core/util/formatted.h"

#include "camera/equidistant_camera.h"
#include "camera/radtan_camera.h"
#include "util/text.h"
#include "vip_slam_core/util/size_text.h"

namespace vip_slam {

DistortionModel distortionModelFromName(const std::string& name) {
  if (name == "none" || name == "pinhole") return DistortionModel::kNone;
  if (name == "radtan" || name == "plumb_bob" || name == "rational_polynomial") return DistortionModel::kRadTan;
  if (name == "equidistant" || name == "fisheye") return DistortionModel::kEquidistant;
  throw std::invalid_argument("distortion model '" + name +
                              "' is unknown, expected none, radtan, plumb_bob, rational_polynomial, equidistant or "
                              "fisheye");
}

std::string distortionModelName(DistortionModel model) {
  switch (model) {
    case DistortionModel::kNone:
      return "none";
    case DistortionModel::kRadTan:
      return "radtan";
    case DistortionModel::kEquidistant:
      return "equidistant";
  }
  return "unknown";
}

CameraIntrinsics CameraIntrinsics::scaled(int new_width, int new_height) const {
  if (new_width <= 0 || new_height <= 0 || width <= 0 || height <= 0) {
    throw std::invalid_argument("camera scaling: from " + sizeText({width, height}) + " to " +
                                sizeText({new_width, new_height}) + ", expected sizes > 0");
  }
  const double sx = double(new_width) / width, sy = double(new_height) / height;
  CameraIntrinsics result = *this;
  result.width = new_width;
  result.height = new_height;
  result.fx = fx * sx;
  result.fy = fy * sy;
  // (0,0) is a pixel's centre: the image's corner is at -0.5 and stays there.
  result.cx = (cx + 0.5) * sx - 0.5;
  result.cy = (cy + 0.5) * sy - 0.5;
  return result;
}

std::string CameraIntrinsics::validate() const {
  if (width <= 0) return "width must be > 0, is " + std::to_string(width);
  if (height <= 0) return "height must be > 0, is " + std::to_string(height);
  if (!(fx > 0) || !std::isfinite(fx)) return "fx must be > 0, is " + formatDouble(fx);
  if (!(fy > 0) || !std::isfinite(fy)) return "fy must be > 0, is " + formatDouble(fy);
  // Off-centre crops exist, but a principal point outside by the size of the image is a mistake.
  if (!(cx > -width && cx < 2 * width)) return "cx must be near the image, is " + formatDouble(cx);
  if (!(cy > -height && cy < 2 * height)) return "cy must be near the image, is " + formatDouble(cy);
  for (std::size_t i = 0; i < distortion.size(); ++i) {
    if (!std::isfinite(distortion[i])) return "distortion[" + std::to_string(i) + "] must be a finite number";
  }
  const std::size_t count = distortion.size();
  if (model == DistortionModel::kRadTan && count != 0 && count != 4 && count != 5 && count != 8) {
    return "distortion of radtan must have 0, 4, 5 or 8 coefficients, has " + std::to_string(count);
  }
  if (model == DistortionModel::kEquidistant && count != 4) {
    return "distortion of equidistant must have 4 coefficients, has " + std::to_string(count);
  }
  return "";
}

bool CameraModel::project(const Eigen::Vector3d& p_C, Eigen::Vector2d* uv, Eigen::Matrix<double, 2, 3>* J) const {
  if (!(p_C.z() > 1e-6)) return false;
  const double inverse_z = 1.0 / p_C.z();
  const Eigen::Vector2d xy(p_C.x() * inverse_z, p_C.y() * inverse_z);
  if (!(xy.squaredNorm() <= max_radius2_)) return false;
  if (!J) {
    *uv = distort(xy);
    return true;
  }
  Eigen::Matrix2d J_xy;
  *uv = distort(xy, &J_xy);
  J->leftCols<2>() = J_xy * inverse_z;
  J->col(2) = -J_xy * xy * inverse_z;
  return true;
}

Eigen::Vector3d CameraModel::unproject(const Eigen::Vector2d& uv, double z) const {
  Eigen::Vector2d xy;
  undistort(uv, &xy);
  return Eigen::Vector3d(xy.x() * z, xy.y() * z, z);
}

bool CameraModel::inImage(const Eigen::Vector2d& uv, double margin) const {
  return uv.x() >= margin && uv.y() >= margin && uv.x() <= intrinsics_.width - 1 - margin &&
         uv.y() <= intrinsics_.height - 1 - margin;
}

namespace {

/// Share of the image whose pixels no ray reaches, or only beyond a fold of the distortion.
double foldedShare(const CameraModel& camera) {
  constexpr int kColumns = 16, kRows = 12, kSteps = 8;
  int folded = 0;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const Eigen::Vector2d uv((column + 0.5) * camera.width() / kColumns - 0.5,
                               (row + 0.5) * camera.height() / kRows - 0.5);
      Eigen::Vector2d xy;
      bool one_to_one = camera.undistort(uv, &xy);
      for (int step = 1; one_to_one && step <= kSteps; ++step) {
        Eigen::Matrix2d J;
        camera.distort(xy * step / kSteps, &J);
        one_to_one = J.determinant() > 0;
      }
      folded += !one_to_one;
    }
  }
  return static_cast<double>(folded) / (kColumns * kRows);
}

// Polynomials that were fitted to the middle of the image may fold in its corners, where no feature is taken then.
constexpr double kMostFolded = 0.5;

std::shared_ptr<const CameraModel> refuseFolded(std::shared_ptr<const CameraModel> camera) {
  const double folded = foldedShare(*camera);
  if (folded <= kMostFolded) return camera;
  const CameraIntrinsics& k = camera->intrinsics();
  std::string numbers;
  for (const double d : k.distortion) numbers += (numbers.empty() ? "" : ", ") + formatted("%g", d);
  const bool part = k.model == DistortionModel::kRadTan && k.distortion.size() == 5;
  throw std::invalid_argument(
      formatted("camera: the distortion [%s] (%s) folds %.0f %% of the image over; ", numbers.c_str(),
                distortionModelName(k.model).c_str(), 100 * folded) +
      (part ? "are these the first five of eight coefficients of rational_polynomial, or those of another model?"
            : "are the coefficients those of this model, in its order, and is the focal length right?"));
}

}  // namespace

std::shared_ptr<const CameraModel> makeCamera(const CameraIntrinsics& intrinsics) {
  const std::string problem = intrinsics.validate();
  if (!problem.empty()) throw std::invalid_argument("camera: " + problem);
  switch (intrinsics.model) {
    case DistortionModel::kEquidistant:
      return refuseFolded(std::make_shared<EquidistantCamera>(intrinsics));
    case DistortionModel::kRadTan:
      if (std::any_of(intrinsics.distortion.begin(), intrinsics.distortion.end(), [](double k) { return k != 0; })) {
        return refuseFolded(std::make_shared<RadTanCamera>(intrinsics));
      }
      break;
    case DistortionModel::kNone:
      break;
  }
  return std::make_shared<PinholeCamera>(intrinsics);
}

}  // namespace vip_slam
