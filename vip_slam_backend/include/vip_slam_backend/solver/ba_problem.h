// SPDX-License-Identifier: BSD-3-Clause
// A bundle adjustment as plain arrays: what both solvers read and change. Indices are positions in these arrays.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "vip_slam_backend/factors/frame_geometry.h"
#include "vip_slam_backend/factors/gauge_prior.h"
#include "vip_slam_backend/factors/homography.h"
#include "vip_slam_backend/factors/motion_prior.h"
#include "vip_slam_core/imu/preintegration.h"
#include "vip_slam_core/types/plane_map.h"

namespace vip_slam {

struct BaFrame {
  NavState state;
  SE3 T_I_C;
  bool fixed = false;  ///< pose and motion are constants
  bool motion = true;  ///< velocity and biases are variables (when not fixed); else they are constants

  SE3 T_W_C() const { return state.T_W_I * T_I_C; }
};

struct BaObservation {
  int frame = 0;
  double x = 0, y = 0;      ///< undistorted normalised coordinates
  double weight = 1;        ///< focal length / sigma in px
  double depth = 0;         ///< metres
  double depth_weight = 0;  ///< 1 / sigma; 0: no depth
};

/// Its observations are observations[first .. first + count).
struct BaPoint {
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  int first = 0, count = 0;
};

struct BaPlane {
  Plane plane;
  PlaneKind kind = PlaneKind::kGeneral;
  double prior_weight = 0;  ///< 1 / sigma of the horizontal/vertical prior, 1/rad; 0: none
};

struct BaImu {
  int i = 0, j = 0;
  std::shared_ptr<const Preintegration> preintegration;
};

struct BaHomography {  ///< compressed
  int i = 0, j = 0, plane = 0;
  HomographySums sums{};
  int pairs = 0;
};

struct BaHomographyPair {  ///< uncompressed
  int i = 0, j = 0, plane = 0;
  HomographyPair pair;
};

struct BaPointToPlane {  ///< compressed
  int frame = 0, plane = 0;
  Eigen::Matrix4d G = Eigen::Matrix4d::Zero();
  int points = 0;
};

struct BaPlaneSample {  ///< uncompressed
  int frame = 0, plane = 0;
  Eigen::Vector3d p_C = Eigen::Vector3d::Zero();
  double weight = 1;  ///< 1 / sigma
};

/// See factors/relative_pose.h.
struct BaRelativePose {
  int i = 0, j = 0;
  SE3 T_i_j;
  Matrix6d sqrt_information = Matrix6d::Identity();  ///< upper triangular, of (theta, t)
};

struct BaGauge {
  int frame = 0;
  GaugePrior prior;
};

struct BaMotionPrior {
  int frame = 0;
  MotionPrior prior;
};

struct BaProblem {
  Eigen::Vector3d gravity = gravityVector();
  double huber = 0, depth_huber = 0;  ///< in sigmas; 0: plain squares

  std::vector<BaFrame> frames;
  std::vector<BaPoint> points;
  std::vector<BaObservation> observations;
  std::vector<BaPlane> planes;

  std::vector<BaImu> imu;
  std::vector<BaHomography> homographies;
  std::vector<BaHomographyPair> homography_pairs;
  std::vector<BaPointToPlane> point_to_plane;
  std::vector<BaPlaneSample> plane_samples;
  std::vector<BaRelativePose> relative_poses;
  std::vector<BaGauge> gauges;
  std::vector<BaMotionPrior> motion_priors;

  std::size_t residualBlocks() const;
  std::size_t parameters() const;  ///< tangent dimension of all variables
};

/// Geometry of each frame at its present estimate.
std::vector<FrameGeometry> frameGeometry(const BaProblem& problem);

/// Empty when the arrays are consistent, else the first error in words.
std::string validateProblem(const BaProblem& problem);

/// Half the sum of squared (robust) residuals: the plain definition of the cost that both solvers minimise.
double evaluateCost(const BaProblem& problem);

}  // namespace vip_slam
