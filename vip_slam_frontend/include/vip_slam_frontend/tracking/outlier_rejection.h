// Gyro-aided outlier rejection. The rotation between two images comes from the gyro, so the translation is all that a
// sample has to give: two points with depth (metric), or two rays (direction only). Unlike the eight-point fundamental
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
  int age = 0;                ///< images the point was followed for
  /// Maps a small step of the current point to pixels over the focal length. Far from one only where the image is bent:
  /// at 65 degrees a pixel of a fisheye covers five times as much of the normalised radius as in its centre.
  Eigen::Matrix2d pixels = Eigen::Matrix2d::Identity();
};

struct RansacOptions {
  double threshold = 0.004;  ///< pixels over the focal length
  int iterations = 60;
  std::uint32_t seed = 1;
  /// Of the translation from the predicted one, m; the rotation is kept. 0: whatever explains most.
  double most_apart = 0;
  bool turn_unknown = false;  ///< a pose from depth with a free rotation is taken when it explains more
};

struct RansacResult {
  bool ok = false;                                             ///< a model was found
  SE3 T_current_previous;                                      ///< translation metric only when with_depth
  Eigen::Vector3d t_given_rotation = Eigen::Vector3d::Zero();  ///< what goes best with the predicted rotation
  bool with_depth = false;
  bool free_rotation = false;  ///< the predicted rotation contradicted the pairs; a model without it was taken
  std::vector<char> inlier;
  int inliers = 0;
};

/// `predicted` supplies the rotation and a first guess of the translation. Pairs without depth are judged by their
/// distance from the epipolar line. When that leaves most pairs unexplained and a motion with a free rotation explains
/// most of them (general_motion.h), that motion judges.
RansacResult rejectOutliers(const std::vector<PointPair>& pairs, const SE3& predicted, const RansacOptions& options);

/// Gauss-Newton on the reprojection of points with depth, Huber-weighted at `huber` (pixels over the focal length);
/// returns false when it fails.
bool refinePose(const std::vector<PointPair>& pairs, const std::vector<char>& use, double huber,
                SE3* T_current_previous);

/// The translation, metres, that goes best with a given rotation, and how sure the pairs are of it.
struct TranslationFit {
  bool ok = false;
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};
/// Huber-weighted at `huber` over the pairs with depth that are in `use`; noise as their residuals scatter.
TranslationFit fitTranslation(const std::vector<PointPair>& pairs, const std::vector<char>& use,
                              const Eigen::Matrix3d& R_current_previous, const Eigen::Vector3d& start, double huber);

}  // namespace vip_slam
