// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/calibration_estimate.h"

#include <gtest/gtest.h>

#include "vip_slam_core/geometry/so3.h"

namespace vip_slam {
namespace {

TEST(Calibration, SaysWhatTheConfigurationShouldHave) {
  CalibrationEstimate given, found;
  found.T_I_C = SE3(expSO3(Eigen::Vector3d(0, 0.01, 0)), Eigen::Vector3d(0.02, 0, 0));
  found.time_offset = 0.004;
  EXPECT_TRUE(calibrationDifferences(given, found).empty()) << "nothing was estimated";
  found.sigma_rotation.setConstant(0.0005);
  found.sigma_translation.setConstant(0.001);
  found.sigma_time_offset = 0.0002;
  found.depth_offset = -0.0098;
  found.sigma_depth_offset = 0.0003;
  const std::vector<std::string> all = calibrationDifferences(given, found);
  ASSERT_EQ(all.size(), 4u);
  EXPECT_NE(all[0].find("0.57 degrees"), std::string::npos) << all[0];
  EXPECT_NE(all[1].find("20.0 mm"), std::string::npos) << all[1];
  EXPECT_NE(all[2].find("4.0 ms"), std::string::npos) << all[2];
  const std::string rows =
      "T_imu_cam should have the rows [0.99995, 0.00000, 0.01000, 0.02000], [0.00000, 1.00000, 0.00000, 0.00000], "
      "[-0.01000, 0.00000, 0.99995, 0.00000], [0, 0, 0, 1]";
  EXPECT_NE(all[0].find(rows), std::string::npos) << all[0];
  EXPECT_NE(all[1].find(rows), std::string::npos) << all[1];
  EXPECT_NE(all[2].find("time_offset should be 0.0040"), std::string::npos) << all[2];
  EXPECT_NE(all[3].find("9.8 mm too long"), std::string::npos) << all[3];
  EXPECT_NE(all[3].find("depth/offset in the sensor's configuration should be -0.0098"), std::string::npos) << all[3];
  found.delay_drifts = true;  // no number holds then
  const std::string drift = calibrationDifferences(given, found)[2];
  EXPECT_NE(drift.find("drifts and is followed: from the 0.0 ms of time_offset to 4.0 ms"), std::string::npos) << drift;
  EXPECT_EQ(drift.find("should be"), std::string::npos) << drift;
  given.depth_offset = -0.005;  // applied already: 7 mm remain
  found.depth_offset = -0.012;
  const std::string more = calibrationDifferences(given, found).back();
  EXPECT_NE(more.find("7.0 mm too long"), std::string::npos) << more;
  EXPECT_NE(more.find("-0.0120"), std::string::npos) << more;
  const std::size_t without = calibrationDifferences(given, found).size();
  found.depth_scale = 0.971;
  found.sigma_depth_scale = 0.008;
  EXPECT_EQ(calibrationDifferences(given, found).size(), without) << "not significant";
  found.sigma_depth_scale = 0.005;
  const std::string scale = calibrationDifferences(given, found).back();
  EXPECT_NE(scale.find("depth reads 2.9 % too long"), std::string::npos) << scale;
  EXPECT_EQ(scale.find("depth/scale"), std::string::npos) << scale;
  found.depth_unit = 0.000971;
  const std::string unit = calibrationDifferences(given, found).back();
  EXPECT_NE(unit.find("depth/scale in the sensor's configuration should be 0.000971"), std::string::npos) << unit;
  found.gyro_contradicts = true;
  const std::string doubtful = calibrationDifferences(given, found).back();
  EXPECT_NE(doubtful.find("depth reads 2.9 % too long"), std::string::npos) << doubtful;
  EXPECT_EQ(doubtful.find("should be"), std::string::npos) << "of an IMU that is itself in question: " << doubtful;
  found.gyro_contradicts = false;
  found.depth_scale = 1;
  found.depth_delay = 0.0412;
  found.sigma_depth_delay = 0.002;
  const std::string late = calibrationDifferences(given, found).back();
  EXPECT_NE(late.find("an earlier moment than its stamps say, by 41 ms"), std::string::npos) << late;
  EXPECT_NE(late.find("depth/delay in the sensor's configuration should be 0.041"), std::string::npos) << late;
  found.depth_delay = 0;
  given.readout = 0.01;
  found.readout = 0.0243;
  found.sigma_readout = 0.001;
  const std::string read = calibrationDifferences(given, found).back();
  EXPECT_NE(read.find("within 24.3 ms (one sigma 1.0 ms), not 10.0 ms"), std::string::npos) << read;
  EXPECT_NE(read.find("color/rolling_shutter in the sensor's configuration should be 0.0243"), std::string::npos);
  found.readout = -1e-5;
  const std::string none = calibrationDifferences(given, found).back();
  EXPECT_NE(none.find("within 0.0 ms"), std::string::npos) << none;
  found.readout = -0.02;
  const std::string turned = calibrationDifferences(given, found).back();
  EXPECT_NE(turned.find("is the image turned round?"), std::string::npos) << turned;
  EXPECT_EQ(turned.find("should be"), std::string::npos) << "no sensor file may have it";
  given.readout = found.readout = 0;
  // Filled holes pass for a shift: what is found is not called right.
  found.depth_shift << 0.002, 0;
  found.depth_shift_px << 1.04, 0;
  found.sigma_depth_shift.setConstant(1e-4);
  const std::string beside = calibrationDifferences(given, found).back();
  EXPECT_NE(beside.find("by [1.04, 0.00] pixels"), std::string::npos) << beside;
  EXPECT_EQ(beside.find("should be"), std::string::npos) << beside;
  found.depth_shift.setZero();
  found.bearing.value << 0, 0.003, 0, 0;
  found.sigma_bearing.setConstant(0.0003);
  found.intrinsics << 480.04, 481.46, 320.2, 240.1;
  const std::string intrinsics = calibrationDifferences(given, found).back();
  EXPECT_NE(intrinsics.find("480.0, 481.5, 320.2, 240.1"), std::string::npos) << intrinsics;
  found.gyro_correction(1, 1) = -0.0123;
  found.sigma_gyro_correction(1, 1) = 0.0003;
  const std::string gyro = calibrationDifferences(given, found).back();
  EXPECT_NE(gyro.find("up to 1.2 %"), std::string::npos) << gyro;
  EXPECT_NE(gyro.find("[0.0000, -0.0123, 0.0000]"), std::string::npos) << gyro;
  const std::size_t said = calibrationDifferences(given, found).size();
  found.gyro_contradicts = true;
  const std::vector<std::string> contradicting = calibrationDifferences(given, found);
  EXPECT_EQ(contradicting.size(), said);
  EXPECT_NE(contradicting.back().find("more than imu/gyro_correction_sigma allows"), std::string::npos);
  EXPECT_EQ(contradicting.back().find("should have the rows"), std::string::npos) << contradicting.back();
  found.gyro_contradicts = false;
  found.sigma_gyro_correction(1, 1) = 0.004;
  found.sigma_rotation.setConstant(0.01);  // not significant
  found.sigma_translation.setConstant(0.01);
  found.sigma_time_offset = 0.002;
  found.sigma_depth_offset = 0.002;
  found.sigma_bearing.setConstant(0.001);
  EXPECT_TRUE(calibrationDifferences(given, found).empty());
}

}  // namespace
}  // namespace vip_slam
