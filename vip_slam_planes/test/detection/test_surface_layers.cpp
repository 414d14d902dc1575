// SPDX-License-Identifier: BSD-3-Clause
// Parallel surfaces in one peak.
#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "vip_slam_planes/detection/surface_layers.h"

namespace vip_slam {
namespace {

class Layers : public ::testing::Test {
 protected:
  void surface(int votes, double at, double sigma, double weight = 1) {
    std::normal_distribution<double> gauss(at, sigma);
    for (int i = 0; i < votes; ++i) offset.push_back(gauss(random)), this->weight.push_back(weight);
  }
  double mean(const std::vector<int>& layer) const {
    double sum = 0;
    for (int i : layer) sum += offset[i];
    return sum / double(layer.size());
  }
  std::mt19937 random{7};
  std::vector<double> offset, weight;
};

TEST_F(Layers, OneSurfaceIsOneHoweverNoisy) {
  for (const double sigma : {0.0, 0.002, 0.01, 0.03}) {
    for (const int votes : {1, 5, 12, 40, 400}) {
      offset.clear(), weight.clear();
      surface(votes, 0.3, sigma);
      ASSERT_EQ(1u, splitLayers(offset, weight, sigma).size()) << sigma << " " << votes;
      ASSERT_EQ(std::size_t(votes), splitLayers(offset, weight, sigma)[0].size());
    }
  }
  EXPECT_EQ(1u, splitLayers({}, {}, 0.01).size());
}

TEST_F(Layers, TraysOnAWorktopLieApartFromIt) {
  surface(60, 0.0, 0.005);
  surface(100, 0.045, 0.005);
  const auto layers = splitLayers(offset, weight, 0.004);
  ASSERT_EQ(2u, layers.size());
  EXPECT_NEAR(0.045, mean(layers[0]), 0.002);  // the heavier one first
  EXPECT_NEAR(0.0, mean(layers[1]), 0.002);
  EXPECT_EQ(160u, layers[0].size() + layers[1].size());
  EXPECT_TRUE(std::is_sorted(layers[1].begin(), layers[1].end()));
}

TEST_F(Layers, WeightCountsNotTheNumberOfVotes) {
  surface(100, 0.0, 0.003);
  surface(25, 0.05, 0.003, 10);
  const auto layers = splitLayers(offset, weight, 0.003);
  ASSERT_EQ(2u, layers.size());
  EXPECT_EQ(25u, layers[0].size());
}

TEST_F(Layers, ThreeOfThem) {
  surface(50, 0.10, 0.004);
  surface(80, 0.05, 0.004);
  surface(60, 0.0, 0.004);
  const auto layers = splitLayers(offset, weight, 0.004);
  ASSERT_EQ(3u, layers.size());
  EXPECT_NEAR(0.05, mean(layers[0]), 0.002);
  EXPECT_NEAR(0.0, mean(layers[1]), 0.002);
}

TEST_F(Layers, NoiseThatFillsTheGapAndOutliersMakeNone) {
  surface(100, 0.0, 0.02);
  surface(100, 0.045, 0.02);
  EXPECT_EQ(1u, splitLayers(offset, weight, 0.02).size());
  offset.clear(), weight.clear();
  surface(100, 0.0, 0.004);
  surface(15, 0.06, 0.004);
  EXPECT_EQ(1u, splitLayers(offset, weight, 0.004).size());
}

}  // namespace
}  // namespace vip_slam
