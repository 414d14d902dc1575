// SPDX-License-Identifier: BSD-3-Clause
// Bags whose clock jumps, and bags that cannot be read to their end.
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "driver_bag.h"
#include "vip_slam_bringup/runner/bag_reader.h"
#include "vip_slam_bringup/runner/pipeline.h"

namespace fs = std::filesystem;

namespace vip_slam {
namespace {

class BagReaderTest : public testing::Test {
 protected:
  BagReaderTest() {
    options_.sensor = loadSensorConfig(CONFIG_DIR "/sensors/simulator.yaml");
    options_.sensor.camera.width = 320;
    options_.sensor.camera.height = 240;
    options_.sensor.camera.fx = options_.sensor.camera.fy = 260;
    options_.sensor.camera.cx = 159.5;
    options_.sensor.camera.cy = 119.5;
    options_.still = 4.0;
    options_.moving = 1.0;
  }
  ~BagReaderTest() override { fs::remove(bag_); }

  std::size_t run(Pipeline* pipeline, BagReader* reader) {
    std::size_t jumps = 0;
    reader->start();
    while (const auto event = reader->next()) {
      jumps += std::holds_alternative<TimeJump>(*event);
      pipeline->add(*event);
    }
    pipeline->finish();
    return jumps;
  }
  static bool warned(const BagReader& reader, const std::string& words) {
    return std::any_of(reader.warnings().begin(), reader.warnings().end(),
                       [&](const std::string& w) { return w.find(words) != std::string::npos; });
  }

  test_support::DriverBagOptions options_;
  PipelineOptions pipeline_options_;
  const std::string bag_ =
      (fs::temp_directory_path() / ("vip_slam_bag_reader_" + std::to_string(::getpid()) + ".bag")).string();
};

TEST_F(BagReaderTest, ARecordingSplitOverBagsGivesTheSameEvents) {
  test_support::writeDriverBag(bag_, options_);
  const std::string parts[] = {bag_ + "_0.bag", bag_ + "_1.bag", bag_ + "_2.bag"};
  {
    const BagSet whole({bag_});
    rosbag::Bag early(parts[0], rosbag::bagmode::Write), imu(parts[1], rosbag::bagmode::Write),
        late(parts[2], rosbag::bagmode::Write);
    const auto view = whole.view();
    const ros::Time half = view->getBeginTime() + ros::Duration(2.5);
    for (const auto& message : *view) {
      rosbag::Bag& part = message.getTime() < half                           ? early
                          : message.getTopic() == options_.sensor.topics.imu ? imu
                                                                             : late;
      part.write(message.getTopic(), message.getTime(), message);
    }
  }
  const auto stampsOf = [&](const std::vector<std::string>& bags) {
    SensorConfig sensor = options_.sensor;
    BagReader reader(BagSet(bags), sensor);
    std::vector<double> stamps;
    reader.start();
    while (const auto event = reader.next()) {
      if (const auto* pair = std::get_if<ImagePair>(&*event)) stamps.push_back(pair->t);
      if (const auto* sample = std::get_if<ImuSample>(&*event)) stamps.push_back(sample->t);
    }
    return stamps;
  };
  const std::vector<double> whole = stampsOf({bag_});
  EXPECT_GT(whole.size(), 100u);
  EXPECT_EQ(stampsOf({parts[2], parts[0], parts[1]}), whole);
  EXPECT_EQ(stampsOf({bag_ + "_?.bag"}), whole);
  for (const std::string& part : parts) fs::remove(part);
}

TEST_F(BagReaderTest, WhereTheClockRanBackTheOdometryStartsAnewAndTheMapGoesOn) {
  options_.late_jump = -100;  // a second recording, joined to the first
  test_support::writeDriverBag(bag_, options_);
  SensorConfig sensor = options_.sensor;
  BagReader reader(bag_, sensor);
  Pipeline pipeline(pipeline_options_, sensor, nullptr);
  EXPECT_EQ(run(&pipeline, &reader), 1u);
  EXPECT_EQ(reader.counters().at("time_jumps"), 1u);
  EXPECT_TRUE(warned(reader, "(a clock that was set or wraps round"));
  EXPECT_FALSE(reader.damaged());
  const auto& odometry = pipeline.odometry();
  ASSERT_FALSE(odometry.empty());
  EXPECT_EQ(odometry.front().epoch, 1u);  // it is the earlier one by its stamps
  EXPECT_EQ(odometry.back().epoch, 0u);
  EXPECT_GT(odometry.back().t - odometry.front().t, 90);
  for (std::size_t i = 1; i < odometry.size(); ++i) EXPECT_LT(odometry[i - 1].t, odometry[i].t);
  ASSERT_EQ(pipeline.covariances().size(), odometry.size());
  for (std::size_t i = 0; i < odometry.size(); ++i) EXPECT_EQ(pipeline.covariances()[i].t, odometry[i].t);
}

TEST_F(BagReaderTest, WhereTheClockIsSetTimeGoesOnAndPosesKeepTheirStamps) {
  const auto odometry = [&](double late_jump, std::vector<double>* stamps) {
    options_.late_jump = late_jump;
    test_support::writeDriverBag(bag_, options_);
    SensorConfig sensor = options_.sensor;
    BagReader reader(bag_, sensor);
    Pipeline pipeline(pipeline_options_, sensor, nullptr);
    EXPECT_EQ(run(&pipeline, &reader), 0u);
    EXPECT_EQ(warned(reader, "the clock was set back by 0.900 s"), late_jump != 0);
    for (const OdometryPose& pose : pipeline.odometry()) stamps->push_back(pipeline.machineClock().stamp(pose.t));
    return pipeline.odometry();
  };
  std::vector<double> stamps, stamps_set;
  const auto whole = odometry(0, &stamps), set = odometry(-0.9, &stamps_set);
  ASSERT_EQ(whole.size(), set.size());
  ASSERT_FALSE(whole.empty());
  for (std::size_t i = 0; i < set.size(); ++i) {
    EXPECT_NEAR(set[i].t, whole[i].t, 1e-6);
    EXPECT_LT((set[i].T_odom_I.t() - whole[i].T_odom_I.t()).norm(), 1e-3);
  }
  EXPECT_NEAR(stamps_set.front(), stamps.front(), 1e-6);
  EXPECT_NEAR(stamps_set.back(), stamps.back() - 0.9, 1e-6);
}

TEST_F(BagReaderTest, ASecondCameraOnTheSameTopicsIsNamedAndLeftOut) {
  const auto odometry = [&](bool second_camera) {
    options_.second_camera = second_camera;
    test_support::writeDriverBag(bag_, options_);
    SensorConfig sensor = options_.sensor;
    BagReader reader(bag_, sensor);
    Pipeline pipeline(pipeline_options_, sensor, nullptr);
    run(&pipeline, &reader);
    EXPECT_EQ(warned(reader, "'back_camera_color_optical_frame' instead of 'camera_color_optical_frame'"),
              second_camera);
    EXPECT_EQ(reader.counters().count("messages_of_another_frame"), second_camera ? 1u : 0u);
    return pipeline.odometry();
  };
  const auto alone = odometry(false), disturbed = odometry(true);
  ASSERT_EQ(alone.size(), disturbed.size());
  ASSERT_FALSE(alone.empty());
  EXPECT_EQ(alone.back().T_odom_I.t(), disturbed.back().T_odom_I.t());  // bit for bit
}

TEST_F(BagReaderTest, CameraInfosThatAreEmptyAtFirstAreWaitedOver) {
  options_.sensor.intrinsics_from_camera_info = true;
  options_.empty_infos = 6;
  test_support::writeDriverBag(bag_, options_);
  SensorConfig sensor = options_.sensor;
  sensor.camera = CameraIntrinsics();
  BagReader reader(bag_, sensor);
  EXPECT_EQ(sensor.camera.fx, options_.sensor.camera.fx);
  EXPECT_EQ(sensor.camera.width, options_.sensor.camera.width);

  options_.calibrated = false;
  options_.empty_infos = 0;
  test_support::writeDriverBag(bag_, options_);
  EXPECT_THROW(BagReader(bag_, sensor), std::runtime_error);
}

TEST_F(BagReaderTest, ATopicOfAnotherTypeIsNamedAtOnce) {
  test_support::writeDriverBag(bag_, options_);
  SensorConfig sensor = options_.sensor;
  sensor.topics.imu = sensor.topics.color;
  try {
    BagReader reader(bag_, sensor);
    FAIL() << "images were taken for an IMU";
  } catch (const std::runtime_error& error) {
    const std::string expected = "topic " + sensor.topics.imu + " is sensor_msgs/Image, expected sensor_msgs/Imu";
    EXPECT_NE(std::string(error.what()).find(expected), std::string::npos) << error.what();
  }
}

TEST_F(BagReaderTest, OfTimesThatComeTwiceTheFirstPassCounts) {
  options_.late_jump = -2.0;  // the second half repeats the times of the first
  test_support::writeDriverBag(bag_, options_);
  SensorConfig sensor = options_.sensor;
  BagReader reader(bag_, sensor);
  Pipeline pipeline(pipeline_options_, sensor, nullptr);
  EXPECT_EQ(run(&pipeline, &reader), 1u);
  const auto& odometry = pipeline.odometry();
  ASSERT_FALSE(odometry.empty());
  for (std::size_t i = 1; i < odometry.size(); ++i) EXPECT_LT(odometry[i - 1].t, odometry[i].t);
  EXPECT_EQ(odometry.front().epoch, 0u);
  EXPECT_EQ(odometry.back().epoch, 1u);
  EXPECT_GT(pipeline.images(), 1.5 * odometry.size());
}

TEST_F(BagReaderTest, DepthWithoutTheLensIsBroughtToTheColourImage) {
  options_.still = 0.2;
  options_.moving = 0.6;
  options_.sensor.camera.model = DistortionModel::kRadTan;
  options_.sensor.camera.distortion = {-0.12, 0.02, 0.0, 0.0, 0.0};
  const auto depths = [&](bool published_without_lens, bool sensor_file_says_so) {
    options_.sensor.depth_undistorted = published_without_lens;
    test_support::writeDriverBag(bag_, options_);
    SensorConfig sensor = options_.sensor;
    sensor.depth_undistorted = sensor_file_says_so;
    BagReader reader(bag_, sensor);
    std::vector<cv::Mat> out;
    reader.start();
    while (const auto event = reader.next())
      if (const auto* pair = std::get_if<ImagePair>(&*event)) out.push_back(pair->depth);
    return out;
  };
  // Share of the pixels that are off by more than neighbouring pixels of these slanted walls are.
  const auto wrong = [](const std::vector<cv::Mat>& seen, const std::vector<cv::Mat>& truth) {
    double off = 0, all = 0;
    for (std::size_t i = 0; i < std::min(seen.size(), truth.size()); ++i) {
      if (seen[i].empty()) continue;
      const cv::Mat valid = seen[i] > 0;
      all += cv::countNonZero(valid);
      off += cv::countNonZero((cv::abs(seen[i] - truth[i]) > 0.02f * truth[i]) & valid);
    }
    return off / all;
  };
  const std::vector<cv::Mat> truth = depths(false, false), brought = depths(true, true), left = depths(true, false);
  ASSERT_GT(truth.size(), 15u);
  ASSERT_EQ(brought.size(), truth.size());
  EXPECT_LT(wrong(brought, truth), 0.001);
  EXPECT_GT(wrong(left, truth), 0.02);
}

TEST_F(BagReaderTest, OfADamagedBagTheRestIsRead) {
  test_support::writeDriverBag(bag_, options_);
  std::string sound;
  {
    std::ifstream in(bag_, std::ios::binary);
    sound.assign(std::istreambuf_iterator<char>(in), {});
  }
  // The index is intact, but a chunk's header names an unknown compression: for images, and for the IMU, which is
  // written last.
  const std::string none = "compression=none";
  for (const std::size_t at : {sound.find(none, sound.size() * 6 / 10), sound.rfind(none)}) {
    ASSERT_NE(at, std::string::npos);
    std::string damaged = sound;
    damaged.replace(at, none.size(), "compression=what");
    std::ofstream(bag_, std::ios::binary) << damaged;
    SensorConfig sensor = options_.sensor;
    BagReader reader(bag_, sensor);
    Pipeline pipeline(pipeline_options_, sensor, nullptr);
    run(&pipeline, &reader);
    EXPECT_TRUE(reader.damaged());
    EXPECT_TRUE(warned(reader, "the bag is damaged"));
    EXPECT_GT(reader.counters().at("unreadable_messages"), 1u);
    EXPECT_GT(reader.counters().at("image_pairs"), 80u);
  }
}

}  // namespace
}  // namespace vip_slam
