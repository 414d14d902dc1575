// Images wait for the IMU by the IMU's own clock, which may be far from the camera's.
#include <gtest/gtest.h>

#include "vip_slam_bringup/runner/pipeline.h"

namespace vip_slam {
namespace {

class ImuPatience : public testing::Test {
 protected:
  ImuPatience() {
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

TEST_F(ImuPatience, AnImuClockThatIsAheadIsNoReasonToGiveUp) {
  sensor_.time_offset = 0.8;
  Pipeline pipeline(options_, sensor_, nullptr);
  addImu(&pipeline, 0, 1.7);
  pipeline.add(image(1.0));  // the IMU's 1.8
  EXPECT_EQ(pipeline.images(), 0u);
  addImu(&pipeline, 1.7, 1.85);
  EXPECT_EQ(pipeline.images(), 1u);
}

TEST_F(ImuPatience, NorIsOneThatIsBehind) {
  sensor_.time_offset = -0.8;
  Pipeline pipeline(options_, sensor_, nullptr);
  addImu(&pipeline, 0, 0.1);
  pipeline.add(image(1.0));  // the IMU's 0.2
  EXPECT_EQ(pipeline.images(), 0u);
  addImu(&pipeline, 0.1, 0.25);
  EXPECT_EQ(pipeline.images(), 1u);
}

TEST_F(ImuPatience, WithoutTheImuImagesGoOn) {
  Pipeline pipeline(options_, sensor_, nullptr);
  addImu(&pipeline, 0, 0.5);
  pipeline.add(image(1.0));
  EXPECT_EQ(pipeline.images(), 0u);
  pipeline.add(image(1.6));
  EXPECT_EQ(pipeline.images(), 1u);
}

}  // namespace
}  // namespace vip_slam
