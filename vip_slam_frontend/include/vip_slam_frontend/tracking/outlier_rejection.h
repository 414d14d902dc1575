// SPDX-License-Identifier: BSD-3-Clause
// Gyro-aided outlier rejection. The rotation between two images comes from the gyro, so a sample only has to determine
// the translation: two points with depth (metric), or two rays (direction only). Unlike the eight-point fundamental
// matrix this does not degenerate when all points lie on one plane.
#pragma once

#include <cstdint>
#include <vector>

#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

struct PointPair {
  Eigen::Vector2d xy_previous = Eigen::Vector2d::Zero();  ///< normalised
  Eigen::Vector2d xy_current = Eigen::Vector2d::Zero();
  double depth_previous = 0;  ///< metres; 0: none
  int age = 0;                ///< number of images the point was followed for
  /// Maps a small step of the normalised current point to pixels over the focal length. Far from identity only under
  /// strong distortion: at 65 degrees a fisheye's pixel covers five times as much normalised radius as in the centre.
  Eigen::Matrix2d pixels = Eigen::Matrix2d::Identity();
};

struct RansacOptions {
  double threshold = 0.004;  ///< pixels over the focal length
  int iterations = 60;
  std::uint32_t seed = 1;
  /// Largest distance of the translation from the predicted one, m; the rotation is kept. 0: no limit.
  double most_apart = 0;
  bool turn_unknown = false;  ///< the predicted rotation is unsure: prefer a free one from depth that explains more
};

struct RansacResult {
  bool ok = false;                                             ///< a model was found
  SE3 T_current_previous;                                      ///< translation metric only when with_depth
  Eigen::Vector3d t_given_rotation = Eigen::Vector3d::Zero();  ///< best translation for the predicted rotation
  bool with_depth = false;
  bool free_rotation = false;  ///< the predicted rotation contradicted the pairs; a model without it was taken
  std::vector<char> inlier;
  int inliers = 0;
};

/// `predicted` supplies the rotation and a first guess of the translation. Pairs without depth are judged by their
/// distance from the epipolar line. When that leaves most pairs unexplained and a motion with a free rotation explains
/// most of them (general_motion.h), that motion is used instead.
RansacResult rejectOutliers(const std::vector<PointPair>& pairs, const SE3& predicted, const RansacOptions& options);

/// Gauss-Newton on the reprojection of points with depth, Huber-weighted at `huber` (pixels over the focal length);
/// returns false when it fails.
bool refinePose(const std::vector<PointPair>& pairs, const std::vector<char>& use, double huber,
                SE3* T_current_previous);

/// The motion that the points with depth show, and its covariance in SE3::boxplus' order, by the scatter of the pairs.
struct MotionFit {
  bool ok = false;
  SE3 T_current_previous;
  Matrix6d covariance = Matrix6d::Zero();
  int pairs = 0;
};
/// refinePose() over the pairs in `use`, from `start`.
MotionFit fitMotion(const std::vector<PointPair>& pairs, const std::vector<char>& use, const SE3& start, double huber);

}  // namespace vip_slam
