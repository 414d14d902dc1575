// SPDX-License-Identifier: BSD-3-Clause
// The real_recordings command with small scripts in place of converter and run_bag: its figures, what it does without
// a recording and with a run that has no pose.
#include <filesystem>

#include "stand_ins.h"

namespace vip_slam {
namespace {

class RealRecordings : public StandIns {
 protected:
  void SetUp() override {
    StandIns::SetUp();
    std::filesystem::create_directories(path("data/stray_phone"));
    // convert_to_bag stray FOLDER --out BAG --force
    program("vip_slam_bringup", "convert_to_bag",
            R"([ -d "$2" ] || exit 1; stem=${4%.bag}; : > "$4"; echo 'topics: {imu: ""}' > "${stem}_sensor.yaml"
cp )" + path("truth.tum") +
                R"( "${stem}_truth.tum")");
    // evaluate --truth T --estimate E --covariance C ...
    program("vip_slam_eval", "evaluate",
            R"([ -s "$4" ] || exit 1
case "$*" in *--no-gravity*) echo '  pose mean (honest: 6)   7.5';; *) echo '  pose mean (honest: 6)   99';; esac)");
    // run_bag BAG --sensor S --out DIR --no-report --set frontend/tracking/max_features=N
    program("vip_slam_bringup", "run_bag",
            R"(
echo 'states: [{t: 100.0, state: TRACKING, reason: ""}]' > "$5/summary.yaml"
echo 'images: 60' >> "$5/summary.yaml"; echo 'epochs: 1' >> "$5/summary.yaml"
case $8 in
*=210) echo 'tracked_images: 0' >> "$5/summary.yaml"; : > "$5/odometry.tum"; : > "$5/trajectory.tum"; exit 2;;
*=300) echo "run_bag: the disk is full" >&2; exit 1;;
esac
echo 'tracked_images: 55' >> "$5/summary.yaml"
for f in odometry trajectory; do cp )" +
                path("turned.tum") + R"( "$5/$f.tum"; done)");
  }
  int run(const std::string& arguments) { return StandIns::run(VIP_SLAM_REAL_RECORDINGS, arguments); }
};

TEST_F(RealRecordings, MediansSpreadsAndRunsWithoutAPose) {
  EXPECT_EQ(run("--data " + path("data") + " --features 190 200 210"), 0) << said();
  expectSaid("kitchen: skipped, " + path("data") + " holds no kinect_kitchen");
  // 2 % of a circle of 1 m, of which a tenth is missing: its centre is fitted as well.
  expectSaid("| ATE, odometry (cm) | 1.9");
  expectSaid(", 1 without |");
  expectSaid("| NEES of a pose (honest: 6) | 7.5, 1 without |");
  expectSaid("| scale, map | 0.98, 1 without |");
  expectSaid("| Sim3, map (cm) | ");
  expectSaid("| first pose (s) | 0.5, 1 without |");
  expectSaid("| coverage (%) | 91.7 (0 to 91.7) |");
  std::ifstream table(path("out/runs.csv"));
  for (std::string line; std::getline(table, line);) {
    if (line.rfind("stray,\"Sim3, map (cm)\"", 0) != 0 && line.rfind("stray,\"rotation, map (deg)\"", 0) != 0) continue;
    EXPECT_LT(std::stod(line.substr(line.find('"', 8) + 2)), 1e-3) << line;
  }
}

TEST_F(RealRecordings, WhatIsMissingOrFailsIsNamed) {
  EXPECT_EQ(run(""), 2);
  expectSaid("VIP_SLAM_REAL_DATA is not set");
  EXPECT_EQ(run("--data " + path("data") + " attic"), 2);
  expectSaid("no recording attic, expected fr1_noimu");
  EXPECT_EQ(run("--data " + path("nowhere")), 0);
  expectSaid("stray: skipped");
  EXPECT_EQ(run("--data " + path("data") + " --features 300"), 1);
  expectSaid("the disk is full");
  expectSaid("stray: FAILED, see its log");
}

}  // namespace
}  // namespace vip_slam
