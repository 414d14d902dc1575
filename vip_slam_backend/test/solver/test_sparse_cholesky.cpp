// SPDX-License-Identifier: BSD-3-Clause
// The block-sparse Cholesky against Eigen's dense one on random structures, for every instruction set this machine
// runs.
#include <random>
#include <set>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include "../../src/solver/dense_kernels.h"
#include "vip_slam_backend/solver/sparse_cholesky.h"

using namespace vip_slam;

namespace {

using Block = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

struct Case {
  SparseCholesky cholesky;
  std::vector<std::pair<int, int>> pairs;
  std::vector<int> sizes;
  std::vector<double> values;
  Eigen::MatrixXd A;
};

Case makeCase(int frames, int reach, int planes, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Case c;
  for (int k = 0; k < frames; ++k) c.sizes.push_back(6);
  for (int k = 0; k < frames; ++k) c.sizes.push_back(9);
  for (int k = 0; k < planes; ++k) c.sizes.push_back(3);
  std::set<std::pair<int, int>> pairs;
  for (int k = 0; k < frames; ++k) {
    pairs.insert({k, frames + k});
    for (int d = 1; d <= reach && k + d < frames; ++d) pairs.insert({k, k + d});
    if (k + 1 < frames) {
      pairs.insert({frames + k, frames + k + 1});
      pairs.insert({k, frames + k + 1});
      pairs.insert({k + 1, frames + k});
    }
    if (planes) pairs.insert({2 * frames + static_cast<int>(random() % planes), k});
  }
  if (frames > 4) pairs.insert({0, frames - 1});
  c.pairs.assign(pairs.begin(), pairs.end());
  c.cholesky.analyze(c.sizes, c.pairs);
  c.values.assign(c.cholesky.valueCount(), 0.0);
  c.A = Eigen::MatrixXd::Zero(c.cholesky.dimension(), c.cholesky.dimension());
  for (std::size_t k = 0; k < c.pairs.size(); ++k) {
    int a = c.pairs[k].first, b = c.pairs[k].second;
    if (c.cholesky.position(a) < c.cholesky.position(b)) std::swap(a, b);
    Block block(c.values.data() + c.cholesky.pairOffset(k), c.sizes[a], c.sizes[b],
                Eigen::OuterStride<>(SparseCholesky::leading(c.sizes[a])));
    for (int j = 0; j < block.cols(); ++j)
      for (int i = 0; i < block.rows(); ++i) block(i, j) = normal(random);
    c.A.block(c.cholesky.unknown(a), c.cholesky.unknown(b), c.sizes[a], c.sizes[b]) = block;
    c.A.block(c.cholesky.unknown(b), c.cholesky.unknown(a), c.sizes[b], c.sizes[a]) = block.transpose();
  }
  const double shift = c.A.cwiseAbs().rowwise().sum().maxCoeff() + 1;
  for (int v = 0; v < c.cholesky.nodes(); ++v) {
    Block block(c.values.data() + c.cholesky.diagonalOffset(v), c.sizes[v], c.sizes[v],
                Eigen::OuterStride<>(SparseCholesky::leading(c.sizes[v])));
    block = shift * Eigen::MatrixXd::Identity(c.sizes[v], c.sizes[v]);
    c.A.block(c.cholesky.unknown(v), c.cholesky.unknown(v), c.sizes[v], c.sizes[v]) = block;
  }
  return c;
}

}  // namespace

TEST(SparseCholesky, SolvesLikeTheDenseOne) {
  for (const auto& shape : {std::array<int, 3>{1, 0, 0}, {2, 1, 1}, {7, 2, 3}, {40, 6, 5}, {60, 59, 0}}) {
    Case c = makeCase(shape[0], shape[1], shape[2], 7 + shape[0]);
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(c.cholesky.dimension(), -1, 2);
    Eigen::VectorXd x = b;
    ASSERT_TRUE(c.cholesky.solve(c.values.data(), x.data()));
    const Eigen::VectorXd expected = c.A.llt().solve(b);
    EXPECT_LT((x - expected).norm(), 1e-11 * expected.norm()) << shape[0] << " frames";
  }
}

TEST(SparseCholesky, RefusesAnIndefiniteMatrix) {
  Case c = makeCase(5, 2, 1, 3);
  c.values[c.cholesky.diagonalOffset(4)] = -1;
  Eigen::VectorXd b = Eigen::VectorXd::Ones(c.cholesky.dimension());
  EXPECT_FALSE(c.cholesky.solve(c.values.data(), b.data()));
}

TEST(DenseKernels, AllBuildsAgree) {
  const int n = 53, c = 29, ld = 72;
  const Eigen::MatrixXd M = Eigen::MatrixXd::Random(n, n);
  const Eigen::MatrixXd S = M * M.transpose() + n * Eigen::MatrixXd::Identity(n, n);
  const Eigen::MatrixXd L = Eigen::LLT<Eigen::MatrixXd>(S).matrixL();
  int tried = 0;
  for (const InstructionSet set : {InstructionSet::kBaseline, InstructionSet::kAvx2, InstructionSet::kAvx512}) {
    if (!runsHere(set)) continue;
    const DenseKernels& kernels = denseKernels(set);
    const char* name = instructionSetName(set);
    ++tried;
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(ld, n + 1);
    A.topLeftCorner(n, n) = S;
    ASSERT_TRUE(kernels.factorPanel(A.data(), n, c, ld));
    for (int j = 0; j < c; ++j)
      EXPECT_LT((A.col(j).segment(j, n - j) - L.col(j).tail(n - j)).norm(), 1e-12 * S.norm()) << name;
    const int m = n - c, columns = m - 1;
    Eigen::MatrixXd C = Eigen::MatrixXd::Constant((m + 7) / 8 * 8, m, 7.0);
    kernels.negativeSyrk(C.data(), static_cast<int>(C.rows()), A.data() + c, ld, m, columns, c);
    EXPECT_EQ(C(m - 1, m - 1), 7.0) << name;
    const Eigen::MatrixXd L21 = L.bottomLeftCorner(n - c, c);
    const Eigen::MatrixXd expected = -L21 * L21.transpose();
    for (int j = 0; j < columns; ++j)
      EXPECT_LT((C.col(j).segment(j, m - j) - expected.col(j).tail(m - j)).norm(), 1e-11 * S.norm()) << name;
    // Back substitution with the first c columns of L.
    const Eigen::VectorXd b = Eigen::VectorXd::Random(n);
    Eigen::MatrixXd K = Eigen::MatrixXd::Identity(n, n);
    K.leftCols(c) = L.leftCols(c);
    Eigen::VectorXd x = b;
    kernels.backSubstitute(A.data(), n, c, ld, x.data());
    EXPECT_LT((K.transpose() * x - b).norm(), 1e-12 * b.norm()) << name;
    // Three columns of an update of five rows into a front of nine.
    const FrontSegment segments[] = {{0, 1, 2}, {2, 5, 3}};
    Eigen::MatrixXd to = Eigen::MatrixXd::Zero(9, 9), sum = to;
    const Eigen::MatrixXd from = Eigen::MatrixXd::Random(8, 5);
    kernels.extendAdd(to.data(), 9, from.data(), 8, segments, 2, 1, 4);
    const int row[] = {1, 2, 5, 6, 7};
    for (int q = 1; q < 4; ++q)
      for (int r = q; r < 5; ++r) sum(row[r], row[q]) = from(r, q);
    EXPECT_EQ(Eigen::MatrixXd(to.triangularView<Eigen::Lower>()), sum) << name;
  }
  EXPECT_GE(tried, 1);
}
