// SPDX-License-Identifier: BSD-3-Clause
// A folder to convert, what is written into it, and the bag that comes of it.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <opencv2/imgcodecs.hpp>

namespace vip_slam::test_support {

namespace fs = std::filesystem;

class ConvertedFolder : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    root_ = fs::temp_directory_path() / ("vip_slam_convert_" + std::string(info->name()) + std::to_string(::getpid()));
    fs::remove_all(root_);
    fs::create_directories(root_);
    bag_ = (root_ / "out.bag").string();
  }
  void TearDown() override { fs::remove_all(root_); }

  void write(const std::string& name, const std::string& text) {
    fs::create_directories((root_ / name).parent_path());
    std::ofstream(root_ / name) << text;
  }
  void writeImage(const std::string& name, const cv::Mat& image) {
    fs::create_directories((root_ / name).parent_path());
    ASSERT_TRUE(cv::imwrite((root_ / name).string(), image));
  }
  std::string errorOf(const std::function<void()>& call) {
    try {
      call();
    } catch (const std::exception& e) {
      const std::string text = e.what();
      EXPECT_EQ(text.find('\n'), std::string::npos) << text;
      // No partial file stays behind.
      for (const auto& entry : fs::directory_iterator(root_))
        EXPECT_EQ(entry.path().filename().string().find("out"), std::string::npos) << entry.path();
      return text;
    }
    return "";
  }
  template <class Message>
  std::vector<boost::shared_ptr<Message>> read(const std::string& topic) {
    rosbag::Bag bag(bag_);
    std::vector<boost::shared_ptr<Message>> out;
    for (const auto& m : rosbag::View(bag, rosbag::TopicQuery(topic))) {
      auto message = m.instantiate<Message>();
      EXPECT_TRUE(message) << topic;
      if (message) {
        EXPECT_EQ(m.getTime(), message->header.stamp);
        out.push_back(message);
      }
    }
    return out;
  }

  fs::path root_;
  std::string bag_;
};

}  // namespace vip_slam::test_support
