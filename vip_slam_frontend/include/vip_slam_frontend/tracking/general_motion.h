// Outlier rejection when the rotation between two images is not known (IMU gap, wrong calibration): camera pose from
// points with depth, else the fundamental matrix. Coplanar points or a pure rotation leave a three-dimensional family
// of fundamental matrices, which outliers can fit; so a homography competes, and the geometric robust information
// criterion (Torr 1998) selects the model.
#pragma once

#include <vector>

#include "vip_slam_frontend/tracking/outlier_rejection.h"

namespace vip_slam {

enum class GeneralModel { kNone, kPose, kFundamental, kHomography };

struct GeneralMotion {
  GeneralModel model = GeneralModel::kNone;
  std::vector<char> inlier;
  int inliers = 0;
  SE3 T_current_previous;  ///< only of kPose
};

/// Pose from samples of four points with depth, started at `predicted`; kNone with fewer than eight points with depth.
/// Pairs without depth are judged by their distance from the epipolar line.
GeneralMotion poseFromDepth(const std::vector<PointPair>& pairs, const SE3& predicted, const RansacOptions& options);

/// Fundamental matrix or homography; kNone with fewer than 12 pairs.
GeneralMotion fundamentalOrHomography(const std::vector<PointPair>& pairs, const RansacOptions& options);

}  // namespace vip_slam
