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

class DenseAlignment {
 public:
  DenseAlignment(std::shared_ptr<const CameraModel> camera, const DepthNoise& noise);

  /// T_current_previous, metres. `gray`: 8UC1, of the camera's size; `depth`: 32FC1, metres, 0 invalid, may be empty.
  /// `guess`: an alternative to standing still, such as the motion before. Empty when too few pixels agree.
  std::optional<SE3> motion(const cv::Mat& gray_previous, const cv::Mat& depth_previous, const cv::Mat& gray,
                            const cv::Mat& depth, const SE3& guess) const;

 private:
  struct Level {
    cv::Mat gray;   ///< 32FC1
    cv::Mat depth;  ///< 32FC1, 0: none
  };
  struct Fit {
    SE3 T_current_previous;
    double cost = 0;  ///< mean robust cost per pixel in view
    int used = 0;     ///< pixels
  };
  std::vector<Level> pyramid(const cv::Mat& gray, const cv::Mat& depth) const;
  /// Gauss-Newton on one level, 0 being the coarsest.
  Fit align(const Level& from, const Level& to, int level, const SE3& start, int iterations) const;

  std::shared_ptr<const CameraModel> camera_;
  DepthNoise noise_;
  std::vector<cv::Size> sizes_;                     ///< of the levels
  std::vector<std::vector<Eigen::Vector2d>> rays_;  ///< normalised coordinates of each level's pixels; NaN: none
};

}  // namespace vip_slam::frontend
