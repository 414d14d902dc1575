// SPDX-License-Identifier: BSD-3-Clause
// Data flow in the runner: images wait for IMU data on the IMU's clock, whose offset from the camera's may be large;
// the plane module's answers reach the back end.
#include <unistd.h>

#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include "vip_slam_backend/map_io/map_file.h"
#include "vip_slam_bringup/runner/mapping_thread.h"
#include "vip_slam_bringup/runner/pipeline.h"

namespace vip_slam {
namespace {

class RunnerTest : public testing::Test {
 protected:
  RunnerTest() {
    sensor_.topics.imu = "imu";
    sensor_.camera.width = 64;
    sensor_.camera.height = 48;
    sensor_.camera.fx = sensor_.camera.fy = 60;
    sensor_.camera.cx = 31.5;
    sensor_.camera.cy = 23.5;
    options_.mapping = false;
  }
  ImagePair image(double t) const { return {t, cv::Mat(48, 64, CV_8UC1, cv::Scalar(90)), {}, 0}; }
  void addImu(Pipeline* pipeline, double from, double until) const {
    for (double t = from; t < until; t += 0.01) pipeline->add(ImuSample{t, {0, 0, 0}, {0, 0, 9.81}});
  }
  PipelineOptions options_;
  SensorConfig sensor_;
};

TEST_F(RunnerTest, AnImuClockThatIsAheadIsNoReasonToGiveUp) {
  sensor_.time_offset = 0.8;
  Pipeline pipeline(options_, sensor_, nullptr);
  addImu(&pipeline, 0, 1.7);
  pipeline.add(image(1.0));  // 1.8 on the IMU's clock
  EXPECT_EQ(pipeline.images(), 0u);
  addImu(&pipeline, 1.7, 1.85);
  EXPECT_EQ(pipeline.images(), 1u);
}

TEST_F(RunnerTest, NorIsOneThatIsBehind) {
  sensor_.time_offset = -0.8;
  Pipeline pipeline(options_, sensor_, nullptr);
  addImu(&pipeline, 0, 0.1);
  pipeline.add(image(1.0));  // 0.2 on the IMU's clock
  EXPECT_EQ(pipeline.images(), 0u);
  addImu(&pipeline, 0.1, 0.25);
  EXPECT_EQ(pipeline.images(), 1u);
}

TEST_F(RunnerTest, WithoutTheImuImagesGoOn) {
  Pipeline pipeline(options_, sensor_, nullptr);
  addImu(&pipeline, 0, 0.5);
  pipeline.add(image(1.0));
  EXPECT_EQ(pipeline.images(), 0u);
  pipeline.add(image(1.6));
  EXPECT_EQ(pipeline.images(), 1u);
}

// The plane module drops a plane without area.
TEST_F(RunnerTest, WhatThePlaneModuleMakesOfALoadedMapReachesTheBackEnd) {
  const std::string path = "/tmp/test_pipeline." + std::to_string(getpid()) + ".vsm";
  Map map;
  PlaneEstimate empty;
  empty.id = 4;
  empty.plane = Plane({0, 0, 1}, 0);
  map.setPlane(empty);
  saveMapFile(path, map, {}, 0);
  options_.mapping = true;
  MappingThread mapping(options_, sensor_, nullptr);
  mapping.loadMap(path);
  std::remove(path.c_str());
  EXPECT_TRUE(mapping.planes().empty());
  EXPECT_TRUE(mapping.backEnd().snapshot().planes.empty());
}

}  // namespace
}  // namespace vip_slam
