// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <stdexcept>

#include "place_metrics/true_poses.h"

namespace vip_slam {
namespace {

TEST(TruePoses, AMapOfABodyThatOnlyTurnedIsAlignedByItsOrientations) {
  const SE3 T_truth_map(expQuaternion({0, 0, 2.0}), {3, -1, 0.5});
  Map map;
  TruePoses truth;
  for (int k = 0; k < 8; ++k) {
    auto kf = std::make_shared<Keyframe>();
    kf->id = k + 1;
    kf->previous = k;
    kf->frame.t = 0.5 * k;
    NavState state;
    state.t = kf->frame.t;
    // Millimetres of noise on a straight line, which leaves rotation about it undetermined.
    state.T_W_I = SE3(expQuaternion({0.02, 0.01, 0.3 * k}), {0.001 * (k % 2), 0, 0});
    kf->frame.state = state;
    map.addKeyframe(kf, state, ImuNoise());
    truth[kf->id] = T_truth_map * state.T_W_I;
    truth[kf->id].t() += Eigen::Vector3d(0, 0.001 * (k % 3), 0);
  }
  const SE3 found = alignMap(map, truth);
  EXPECT_LT(found.rotation().angularDistance(T_truth_map.rotation()), 0.02);
  EXPECT_LT((found.t() - T_truth_map.t()).norm(), 0.005);
}

TEST(TruePoses, AnEmptyTruthIsRefusedByName) {
  try {
    alignMap(Map(), TruePoses());
    FAIL();
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("truth: has no pose"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace vip_slam
