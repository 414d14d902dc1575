// Matrices that are no rigid transforms are refused with what is wrong.
#include <gtest/gtest.h>

#include <cmath>

#include "vip_slam_core/geometry/rigid_check.h"
#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {
namespace {

Eigen::Matrix4d good() { return SE3(expSO3(Eigen::Vector3d(0.3, -0.2, 1)), Eigen::Vector3d(1, 2, 3)).matrix(); }

std::string problemOf(int row, int column, double value) {
  Eigen::Matrix4d T = good();
  T(row, column) = value;
  return rigidProblem(T);
}

TEST(RigidCheck, NamesWhatIsWrong) {
  EXPECT_EQ(rigidProblem(good()), "");
  EXPECT_EQ(problemOf(0, 3, std::nan("")), "a number is not finite");
  EXPECT_EQ(problemOf(3, 3, 2), "the last row is 0 0 0 2, expected 0 0 0 1");
  Eigen::Matrix4d T = good();
  T.topLeftCorner<3, 3>() *= 1.01;  // R R^T = 1.0201 I
  EXPECT_EQ(rigidProblem(T), "the rotation is off orthonormal by 0.035, expected less than 0.001");
  T = good();
  T.row(0).head<3>() *= -1;
  EXPECT_EQ(rigidProblem(T), "the rotation mirrors (determinant -1), expected determinant 1");
}

TEST(RigidCheck, AcceptsRoundedNumbers) {
  const Eigen::Matrix4d T = good();
  Eigen::Matrix4d rounded = (1e4 * T).array().round() / 1e4;
  EXPECT_EQ(rigidProblem(rounded), "");
}

}  // namespace
}  // namespace vip_slam
