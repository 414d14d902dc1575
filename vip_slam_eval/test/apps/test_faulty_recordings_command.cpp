// SPDX-License-Identifier: BSD-3-Clause
// The faulty_recordings command: what it finds wrong, with small scripts in place of the programs; and with the
// programs themselves, three faults as users have them.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "stand_ins.h"

namespace vip_slam {
namespace {

class FaultyRecordings : public StandIns {
 protected:
  void SetUp() override {
    StandIns::SetUp();
    std::ofstream covariance(path("covariance.csv"));  // 1 mm of each axis
    covariance << "t\n";
    for (int k = 5; k < 60; ++k) {
      covariance << 100 + 0.1 * k;
      for (int entry = 0; entry < 21; ++entry) covariance << (entry == 0 || entry == 6 || entry == 11 ? ",1e-6" : ",0");
      covariance << "\n";
    }
    // render_sequence FILE --out DIR
    program("vip_slam_sim", "render_sequence", R"(
cp )" + path("truth.tum") + R"( "$3/recording_truth.tum"
echo 'topics: {color: /c, color_info: /ci, depth: /d, depth_info: /di, imu: /imu}' > "$3/recording_sensor.yaml"
/usr/bin/python3 - "$3/recording.bag" <<'END'
import rosbag, rospy, sys
from sensor_msgs.msg import Imu
with rosbag.Bag(sys.argv[1], 'w') as bag:
    for k in range(60):
        bag.write('/imu', Imu(), rospy.Time.from_sec(100 + 0.1 * k))
END)");
    // check_bag BAG --sensor FILE
    program("vip_slam_bringup", "check_bag", R"(
case $1 in
*/mirrored/*) echo 'ERROR    colour image: mirrored, left and right changed over'; exit 1;;
*) echo 'ok       colour image: 60 messages'; echo 'Ready.';;
esac)");
    // run_bag BAG --sensor FILE --out DIR --no-report
    program("vip_slam_bringup", "run_bag",
            R"(
case $1 in */mirrored/*) echo 'run_bag: warning: no image has a pose'; exit 2;; esac
mkdir -p "$5"; cp )" +
                path("covariance.csv") + R"( "$5/odometry_covariance.csv"
for f in odometry trajectory; do cp )" +
                path("turned.tum") + R"( "$5/$f.tum"; done
echo "run_bag: 60 images in 1.0 s, results in $5")");
  }
  int run(const std::string& arguments) { return StandIns::run(VIP_SLAM_FAULTY_RECORDINGS, arguments); }
};

TEST_F(FaultyRecordings, WhatIsNotNamedOrTooFarOffIsFound) {
  EXPECT_EQ(run("no_fault mirrored upside_down"), 1) << said();
  expectSaid("no_fault: odometry is 1.9");  // 2 % of a circle of 1 m, of which a tenth is missing
  expectSaid("cm off, at most 0.3 cm; map is 1.9");
  expectSaid("off by more than three sigmas for ");
  expectSaid("mirrored: as expected");
  expectSaid("upside_down: not named: expected \"extrinsics|upside\"; check_bag calls it ready");
  expectSaid(
      "| the driver mirrors its pictures | not ready: colour image: mirrored, left and right changed over | no "
      "image has a pose | no pose | – | – |");
  expectSaid("1 of 3 as expected");
  EXPECT_TRUE(std::filesystem::exists(path("out/table.md")));
  EXPECT_EQ(run("sunshine"), 2);
  expectSaid("no fault sunshine, expected no_fault, clock_back");
}

TEST(FaultyRecordingsThemselves, AreNamedAndTheRestIsSound) {
  const std::string out = ::testing::TempDir() + "/faulty_recordings_themselves";
  std::filesystem::remove_all(out);
  const std::string command = std::string(VIP_SLAM_FAULTY_RECORDINGS) +
                              " no_fault accelerometer_in_other_axes lens_not_in_the_sensor_file --out " + out + " > " +
                              out + ".txt 2>&1";
  const int status = std::system(command.c_str());
  std::ostringstream said;
  said << std::ifstream(out + ".txt").rdbuf();
  EXPECT_EQ(WEXITSTATUS(status), 0) << said.str();
  EXPECT_NE(said.str().find("3 of 3 as expected"), std::string::npos) << said.str();
  std::filesystem::remove_all(out);
}

}  // namespace
}  // namespace vip_slam
