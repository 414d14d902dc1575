// SPDX-License-Identifier: BSD-3-Clause
// Outlier rejection without a usable rotation: a general scene, a plane, a rotation on the spot.
#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "vip_slam_frontend/tracking/general_motion.h"

namespace vip_slam {
namespace {

enum class Scene { kGeneral, kPlane, kRotation };

struct Pairs {
  std::vector<PointPair> pairs;
  std::vector<char> good;
  SE3 truth;
  int accepted(const std::vector<char>& inlier, bool of_good) const {
    int count = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) count += inlier[i] && (good[i] != 0) == of_good;
    return count;
  }
  int total(bool of_good) const { return static_cast<int>(std::count(good.begin(), good.end(), of_good)); }
};

Eigen::Vector3d onRay(const PointPair& pair, double z) {
  return {pair.xy_previous.x() * z, pair.xy_previous.y() * z, z};
}

Pairs make(Scene scene, bool with_depth, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  Pairs result;
  result.truth = SE3(expSO3(Eigen::Vector3d(0.05, -0.09, 0.07)),
                     scene == Scene::kRotation ? Eigen::Vector3d(0, 0, 0) : Eigen::Vector3d(0.25, -0.08, 0.1));
  for (int i = 0; i < 160; ++i) {
    PointPair pair;
    pair.xy_previous = Eigen::Vector2d(0.6 * unit(random), 0.45 * unit(random));
    const double z = scene == Scene::kPlane ? 2.5 / (1 + 0.3 * pair.xy_previous.x()) : 3.0 + 1.5 * unit(random);
    const Eigen::Vector3d p = result.truth * onRay(pair, z);
    pair.xy_current = p.hnormalized() + 5e-4 * Eigen::Vector2d(unit(random), unit(random));
    if (with_depth) pair.depth_previous = z;
    result.good.push_back(i % 4 != 0);
    if (!result.good.back()) pair.xy_current += 0.12 * Eigen::Vector2d(unit(random), unit(random));
    result.pairs.push_back(pair);
  }
  return result;
}

/// An outlier moved by up to 0.12 lands within the threshold of its right place or epipolar line by chance.
constexpr double kByChanceOnLine = 0.12;

TEST(GeneralMotion, PoseFromDepthNeedsNoRotation) {
  for (const Scene scene : {Scene::kGeneral, Scene::kPlane, Scene::kRotation}) {
    const Pairs set = make(scene, true, 3);
    const GeneralMotion motion = poseFromDepth(set.pairs, SE3(), RansacOptions());
    ASSERT_TRUE(motion.ok);
    EXPECT_GE(set.accepted(motion.inlier, true), 0.97 * set.total(true));
    EXPECT_LE(set.accepted(motion.inlier, false), 2);
    EXPECT_LT((motion.T_current_previous.t() - set.truth.t()).norm(), 3e-3);
    EXPECT_LT(logSO3(motion.T_current_previous.rotation().inverse() * set.truth.rotation()).norm(), 1e-3);
  }
}

TEST(GeneralMotion, OutlierRejectionFallsBackOnlyWhenTheGyroIsContradicted) {
  const Pairs set = make(Scene::kGeneral, true, 5);
  const RansacResult right =
      rejectOutliers(set.pairs, SE3(set.truth.rotation(), Eigen::Vector3d::Zero()), RansacOptions());
  EXPECT_TRUE(right.ok);
  EXPECT_FALSE(right.free_rotation);
  // The gyro missed a rotation of seven degrees.
  const RansacResult wrong = rejectOutliers(set.pairs, SE3(), RansacOptions());
  EXPECT_TRUE(wrong.ok);
  EXPECT_TRUE(wrong.free_rotation);
  EXPECT_TRUE(wrong.with_depth);
  EXPECT_GE(set.accepted(wrong.inlier, true), 0.95 * set.total(true));
  EXPECT_LE(set.accepted(wrong.inlier, false), kByChanceOnLine * set.total(false) + 3);
}

TEST(GeneralMotion, ABodyThatMovesByItselfDoesNotWinAgainstTheGyro) {
  // Six in ten pairs are on a moving body; the gyro agrees with the rest.
  Pairs set = make(Scene::kGeneral, true, 7);
  const SE3 other(expSO3(Eigen::Vector3d(0, 0.1, 0)), Eigen::Vector3d(0.3, 0, 0));
  int on_body = 0;
  for (std::size_t i = 0; i < set.pairs.size(); ++i) {
    PointPair& pair = set.pairs[i];
    if (i % 10 < 6) {
      pair.xy_current = (other * onRay(pair, pair.depth_previous)).hnormalized();
      ++on_body;
    } else {
      pair.xy_current = (set.truth * onRay(pair, pair.depth_previous)).hnormalized();
    }
  }
  const RansacResult result =
      rejectOutliers(set.pairs, SE3(set.truth.rotation(), Eigen::Vector3d::Zero()), RansacOptions());
  EXPECT_FALSE(result.free_rotation);
  EXPECT_LE(result.inliers, static_cast<int>(set.pairs.size()) - on_body + 8);
}

TEST(GeneralMotion, TooFewPairsGiveNoModel) {
  Pairs set = make(Scene::kGeneral, true, 9);
  set.pairs.resize(7);
  EXPECT_FALSE(poseFromDepth(set.pairs, SE3(), RansacOptions()).ok);
}

}  // namespace
}  // namespace vip_slam
