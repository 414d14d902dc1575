// SPDX-License-Identifier: BSD-3-Clause
// The real_sequences command with small scripts in place of its programs: figures, what a second call does, failures.
#include "stand_ins.h"

namespace vip_slam {
namespace {

class RealSequences : public StandIns {
 protected:
  void SetUp() override {
    StandIns::SetUp();
    // render_sequence NAME --out DIR
    program("vip_slam_sim", "render_sequence",
            R"([ "$1" != real_03 ] || { echo "no such scene" >&2; exit 1; }
echo "$1" >> )" +
                path("rendered") + R"(
: > "$3/$1.bag"; echo 'camera: {fx: 500, fy: 500}' > "$3/$1_sensor.yaml"; echo 'planes: []' > "$3/$1_planes.yaml"
echo '{camera: [495, 495], depth_scale: 1.02}' > "$3/$1_errors.yaml"; cp )" +
                path("truth.tum") + R"( "$3/$1_truth.tum")");
    // run_bag BAG --sensor S --out DIR --no-report --variant V --set frontend/tracking/max_features=N
    program("vip_slam_bringup", "run_bag",
            R"(
echo "{images: 60, tracked_images: 55, epochs: 1, warnings: [$8 says so], loops: [{accepted: true}, {accepted: false}],
  calibration: {intrinsics: [504.9, 504.9], depth_offset: 0.001, depth_curve: [0, -0.004]}}" > "$5/summary.yaml"
: > "$5/planes.yaml"; for f in odometry trajectory; do cp )" +
                path("turned.tum") + R"( "$5/$f.tum"; done)");
    // evaluate --truth T --estimate E --planes-truth P --planes M --time-offset D --out DIR
    program("vip_slam_eval", "evaluate", R"(mkdir -p "${12}"
printf 'visible_m2,found,represented_by\n3,1,2\n1.5,0,0\n1,1,1\n0.9,1,3\n' > "${12}/true_planes.csv")");
  }
  int run(const std::string& arguments) { return StandIns::run(VIP_SLAM_REAL_SEQUENCES, arguments); }
};

TEST_F(RealSequences, FiguresAgainstTheTruthAndWithoutPlanes) {
  EXPECT_EQ(run("real_01"), 0) << said();
  expectSaid("one run each");
  // 2 % of a circle of 1 m, of which a tenth is missing; the same with planes and without.
  expectSaid("| real_01 | 1.9");
  expectSaid(" | 1.00 | 1.00 | ");
  expectSaid(" | 1 | +1.01 / +2.00 | 0.980 / – | 4 | 2 of 3, 1 twice |");
  expectSaid("- real_01: vip says so");
  // What was run stays: neither rendered nor run again.
  program("vip_slam_bringup", "run_bag", "exit 1");
  EXPECT_EQ(run("real_01"), 0) << said();
  expectSaid("2 of 3, 1 twice");
  std::ifstream rendered(path("rendered"));
  std::string first, second;
  rendered >> first >> second;
  EXPECT_EQ(first, "real_01");
  EXPECT_EQ(second, "");
}

TEST_F(RealSequences, WhatIsUnknownOrFailsIsNamed) {
  EXPECT_EQ(run("real_09"), 2);
  expectSaid("no sequence real_09, expected real_01");
  EXPECT_EQ(run("real_03 real_02"), 1);
  expectSaid("real_03: FAILED: no such scene");
  expectSaid("| real_02 | 1.9");
}

}  // namespace
}  // namespace vip_slam
