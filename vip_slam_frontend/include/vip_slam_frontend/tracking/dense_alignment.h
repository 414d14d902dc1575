// SPDX-License-Identifier: BSD-3-Clause
// The camera's motion between two RGB-D images from all of their pixels: grey values and depth of the earlier image,
// moved to the later one, have to agree there. Coarse to fine on small images, so that large turns are found without
// any prediction. It gives the turn where no gyroscope does, for the start of optical flow, before features are
// tracked. After Steinbruecker et al. (2011) and Kerl et al. (2013), with the inverse roles of neither image
// precomputed.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_noise.h"
#include "vip_slam_core/geometry/se3.h"

namespace vip_slam::frontend {

/// One sigma of the motion between two images before they are looked at, rad and m. Optical flow need not follow more.
constexpr double kUsualMotion = 0.1;

struct AlignedMotion {
  SE3 T_current_previous;  ///< metres
  Matrix6d covariance;     ///< of boxplus: theta by R exp(theta) (rad), then t (m)
};

class DenseAlignment {
 public:
  DenseAlignment(std::shared_ptr<const CameraModel> camera, const DepthNoise& noise);

  /// `gray`: 8UC1, of the camera's size; `depth`: 32FC1, metres, 0 invalid, may be empty. The earlier depth image is of
  /// the moment of its grey image; the later one was read when this share of the time between the grey images had
  /// passed. `guess`: an alternative to standing still, such as the motion before. Empty when too few pixels agree.
  std::optional<AlignedMotion> motion(const cv::Mat& gray_previous, const cv::Mat& depth_previous, const cv::Mat& gray,
                                      const cv::Mat& depth, double depth_share, const SE3& guess) const;

 private:
  struct Normal;
  struct Level {
    cv::Mat gray;    ///< 32FC1
    cv::Mat depth;   ///< 32FC1, 0: none
    cv::Mat slopes;  ///< 32FC2, gradient of the depth per pixel; NaN: none
  };
  struct Fit {
    SE3 T_current_previous;
    Matrix6d information = Matrix6d::Zero();  ///< theta on the left of R, t
    double cost = 0;                          ///< mean robust cost per pixel in view
    int used = 0;                             ///< pixels
  };
  std::vector<Level> pyramid(const cv::Mat& gray, const cv::Mat& depth) const;
  /// Gauss-Newton on one level, 0 being the coarsest.
  Fit align(const Level& from, const Level& to, int level, const SE3& start, double depth_share, int iterations) const;
  /// Adds what the later depth image has to say on a point of the earlier one: `turned` by R, to be moved by t.
  void compareDepth(const Level& to, const Eigen::Vector3d& turned, const Eigen::Vector3d& t, double depth_share,
                    Normal* normal) const;

  std::shared_ptr<const CameraModel> camera_;
  DepthNoise noise_;
  std::vector<cv::Size> sizes_;                     ///< of the levels
  std::vector<std::vector<Eigen::Vector2d>> rays_;  ///< normalised coordinates of each level's pixels; NaN: none
};

}  // namespace vip_slam::frontend
