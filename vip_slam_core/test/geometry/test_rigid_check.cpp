// SPDX-License-Identifier: BSD-3-Clause
// Matrices that are no rigid transforms are refused with what is wrong; rounded ones are made exact.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/geometry/rigid_check.h"

namespace vip_slam {
namespace {

SE3 pose(double a, double b, double c) { return SE3(expSO3(Eigen::Vector3d(a, b, c)), Eigen::Vector3d(1, 2, 3)); }
Eigen::Matrix4d good() { return pose(0.3, -0.2, 1).matrix(); }

std::string problemOf(const Eigen::Matrix4d& M) { return rigidTransform(M).problem; }
std::string problemOf(int row, int column, double value) {
  Eigen::Matrix4d T = good();
  T(row, column) = value;
  return problemOf(T);
}
Eigen::Matrix4d rounded(const Eigen::Matrix4d& M, int decimals) {
  const double unit = std::pow(10, decimals);
  return (unit * M).array().round() / unit;
}

TEST(RigidCheck, NamesWhatIsWrong) {
  EXPECT_EQ(problemOf(good()), "");
  EXPECT_EQ(problemOf(0, 3, std::nan("")), "a number is not finite");
  EXPECT_EQ(problemOf(3, 3, 2), "the last row is 0 0 0 2, expected 0 0 0 1");
  Eigen::Matrix4d T = good();
  T.topLeftCorner<3, 3>() *= 1.01;  // R R^T = 1.0201 I
  EXPECT_EQ(problemOf(T), "the rotation is off orthonormal by 0.035, expected less than 0.025");
  T = good();
  T.row(0).head<3>() *= -1;
  EXPECT_EQ(problemOf(T), "the rotation mirrors (determinant -1), expected determinant 1");
  EXPECT_NE(problemOf(rounded(good(), 1)), "") << "one decimal may be five degrees off";
}

TEST(RigidCheck, RoundedRotationsAreMadeExact) {
  // Decimals, and by how much the result may be turned.
  for (const auto& [decimals, degrees] : {std::pair{6, 1e-4}, {4, 0.01}, {3, 0.05}, {2, 0.45}}) {
    int noted = 0;
    for (int k = 0; k < 50; ++k) {
      const SE3 T = pose(std::sin(3.0 * k), 2 * std::cos(5.0 * k), std::sin(7.0 * k + 1));
      const RigidTransform read = rigidTransform(rounded(T.matrix(), decimals));
      EXPECT_EQ(read.problem, "") << decimals << " decimals: " << read.problem;
      EXPECT_LT(read.T.rotation().angularDistance(T.rotation()), degrees * kDegree) << decimals;
      const Eigen::Matrix3d R = read.T.R();
      EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
      EXPECT_EQ(read.T.t(), Eigen::Vector3d(1, 2, 3));
      noted += !read.note.empty();
    }
    EXPECT_TRUE(decimals < 4 || noted == 0) << decimals;
    EXPECT_TRUE(decimals > 2 || noted == 50) << decimals;
  }
}

}  // namespace
}  // namespace vip_slam
