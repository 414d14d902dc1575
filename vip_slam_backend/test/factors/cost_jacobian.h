// SPDX-License-Identifier: BSD-3-Clause
// A Ceres cost function's Jacobians against central differences, in the tangents of its parameter blocks.
// ceres::GradientChecker is of no use for poses: it needs ambient Jacobians, theirs are in the tangent.
#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include "../../src/solver/ceres_manifold.h"
#include "vip_slam_core/testing/numeric_jacobian.h"

namespace vip_slam {

struct CostBlock {
  Eigen::VectorXd x;
  const CeresManifold* manifold = nullptr;  ///< null: Euclidean

  int tangentSize() const { return manifold ? manifold->TangentSize() : static_cast<int>(x.size()); }
  Eigen::VectorXd plus(const Eigen::VectorXd& delta) const {
    if (!manifold) return x + delta;
    Eigen::VectorXd out(x.size());
    EXPECT_TRUE(manifold->Plus(x.data(), delta.data(), out.data()));
    return out;
  }
};

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

inline RowMajorMatrix plusJacobian(const CostBlock& block) {
  if (!block.manifold) return RowMajorMatrix::Identity(block.x.size(), block.x.size());
  RowMajorMatrix J(block.x.size(), block.tangentSize());
  EXPECT_TRUE(block.manifold->PlusJacobian(block.x.data(), J.data()));
  return J;
}

class CostJacobian {
 public:
  CostJacobian(const ceres::CostFunction& cost, const std::vector<CostBlock>& blocks) : cost_(cost), blocks_(blocks) {
    for (const CostBlock& b : blocks) tangent_size_ += b.tangentSize();
  }

  /// `only`: of this block alone, as Ceres asks when the others are constant; -1: of all.
  Eigen::MatrixXd analytic(int only = -1) const {
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(cost_.num_residuals(), tangent_size_);
    std::vector<Eigen::VectorXd> x;
    std::vector<RowMajorMatrix> ambient;
    for (const CostBlock& b : blocks_) {
      x.push_back(b.x);
      ambient.push_back(RowMajorMatrix::Constant(J.rows(), b.x.size(), std::nan("")));
    }
    const auto wanted = [only](std::size_t k) { return only < 0 || only == static_cast<int>(k); };
    std::vector<double*> out;
    for (std::size_t k = 0; k < blocks_.size(); ++k) out.push_back(wanted(k) ? ambient[k].data() : nullptr);
    EXPECT_EQ(evaluate(x, out.data()), evaluate(x, nullptr));
    int column = 0;
    for (std::size_t k = 0; k < blocks_.size(); column += blocks_[k++].tangentSize())
      if (wanted(k)) J.middleCols(column, blocks_[k].tangentSize()) = ambient[k] * plusJacobian(blocks_[k]);
    return J;
  }
  Eigen::MatrixXd numeric() const {
    const auto residual = [this](const Eigen::VectorXd& delta) {
      std::vector<Eigen::VectorXd> x;
      int column = 0;
      for (const CostBlock& b : blocks_) {
        x.push_back(b.plus(delta.segment(column, b.tangentSize())));
        column += b.tangentSize();
      }
      return evaluate(x, nullptr);
    };
    return testing::numericJacobian(residual, tangent_size_);
  }

 private:
  Eigen::VectorXd evaluate(const std::vector<Eigen::VectorXd>& x, double** jacobians) const {
    std::vector<const double*> blocks;
    for (const Eigen::VectorXd& block : x) blocks.push_back(block.data());
    Eigen::VectorXd r(cost_.num_residuals());
    EXPECT_TRUE(cost_.Evaluate(blocks.data(), r.data(), jacobians));
    return r;
  }

  const ceres::CostFunction& cost_;
  const std::vector<CostBlock>& blocks_;
  int tangent_size_ = 0;
};

/// Owns `cost`.
inline void expectRightJacobians(ceres::CostFunction* cost, const std::vector<CostBlock>& blocks) {
  const std::unique_ptr<ceres::CostFunction> owned(cost);
  const CostJacobian jacobian(*cost, blocks);
  const Eigen::MatrixXd J = jacobian.analytic();
  EXPECT_LT(testing::rowError(J, jacobian.numeric()), 1e-6);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(J.rows(), J.cols());
  for (std::size_t k = 0; k < blocks.size(); ++k) sum += jacobian.analytic(static_cast<int>(k));
  EXPECT_EQ(sum, J);
}

}  // namespace vip_slam
