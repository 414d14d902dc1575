// SPDX-License-Identifier: BSD-3-Clause
// The shared part of the noise of points' depth: rows as with the dense covariance, and N readings of one place worth
// one.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "vip_slam_frontend/filter/shared_depth.h"

using namespace vip_slam::frontend;

namespace {

Eigen::MatrixXd drawn(int rows, int columns, std::mt19937* random) {
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(*random); });
}

}  // namespace

// Information and gradient of the state, the point marginalised out, against those with the covariance as it is.
TEST(SharedDepth, RowsSayWhatTheDenseCovarianceSays) {
  std::mt19937 random(3);
  const int views = 7;
  Eigen::MatrixXd H_x = drawn(3 * views, 12, &random), H_f = drawn(3 * views, 3, &random);
  Eigen::VectorXd r = drawn(3 * views, 1, &random);
  std::vector<DepthRow> depths;
  Eigen::MatrixXd C = Eigen::MatrixXd::Identity(3 * views, 3 * views);
  for (int i = 0; i < views; ++i) {
    if (i == 2) continue;  // a view without depth
    depths.push_back({3 * i + 2, 0.5 + 0.3 * i, Eigen::Vector2d(0.03 * i, 0.02 * i * i)});
  }
  for (const DepthRow& a : depths)
    for (const DepthRow& b : depths) C(a.row, b.row) += a.shared * b.shared * std::exp(-(a.xy - b.xy).norm() / 0.12);
  const Eigen::MatrixXd W = C.inverse();
  const Eigen::MatrixXd free = W - W * H_f * (H_f.transpose() * W * H_f).inverse() * H_f.transpose() * W;
  const Eigen::MatrixXd information = H_x.transpose() * free * H_x;
  const Eigen::VectorXd gradient = H_x.transpose() * free * r;

  decorrelateDepth(depths, &H_x, &H_f, &r);
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(3 * views, 3 * views);
  const Eigen::MatrixXd white = I - H_f * (H_f.transpose() * H_f).inverse() * H_f.transpose();
  EXPECT_LT((H_x.transpose() * white * H_x - information).norm(), 1e-9 * information.norm());
  EXPECT_LT((H_x.transpose() * white * r - gradient).norm(), 1e-9 * gradient.norm());
}

TEST(SharedDepth, ARowKeepsItsZerosBeforeItsView) {
  std::mt19937 random(5);
  Eigen::MatrixXd H_x = Eigen::MatrixXd::Zero(4, 8), H_f = drawn(4, 3, &random);
  Eigen::VectorXd r = drawn(4, 1, &random);
  std::vector<DepthRow> depths;
  for (int i = 0; i < 4; ++i) {
    H_x.block(i, 2 * i, 1, 2) = drawn(1, 2, &random);
    depths.push_back({i, 1.0, Eigen::Vector2d(0.05 * i, 0)});
  }
  decorrelateDepth(depths, &H_x, &H_f, &r);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(H_x.row(i).head(2 * i).norm(), 0) << "view " << i;
}

TEST(SharedDepth, WithoutASharedPartNothingChanges) {
  std::mt19937 random(7);
  Eigen::MatrixXd H_x = drawn(3, 4, &random), H_f = drawn(3, 3, &random);
  Eigen::VectorXd r = drawn(3, 1, &random);
  const Eigen::MatrixXd H_x_before = H_x;
  const Eigen::VectorXd r_before = r;
  decorrelateDepth({{0, 0, {0, 0}}, {2, 0, {0.1, 0}}}, &H_x, &H_f, &r);
  EXPECT_EQ(H_x, H_x_before);
  EXPECT_EQ(r, r_before);
}
