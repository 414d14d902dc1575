// SPDX-License-Identifier: BSD-3-Clause
// A bag that appears completely or not at all, filled from streams that are each in time order.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <ros/time.h>

namespace rosbag {
class Bag;
}

namespace vip_slam {

class BagOutput {
 public:
  /// Writes a temporary file next to `path`, which finish() renames. Throws std::runtime_error naming the path when it
  /// cannot be opened, or when the bag or one of its companion files (sensor, truth) exists and `overwrite` is false.
  BagOutput(const std::string& path, bool overwrite);
  /// Removes what was written when finish() was not reached.
  ~BagOutput();

  /// Announces a message: `write` is called in stamp order by finish().
  void add(const ros::Time& stamp, std::function<void(rosbag::Bag&)> write);
  /// Writes all messages in stamp order (equal stamps keep the order of add()) and gives the bag its name.
  /// `progress` gets (done, all).
  void finish(const std::function<void(std::size_t, std::size_t)>& progress = {});
  std::size_t size() const { return events_.size(); }

 private:
  struct Event {
    ros::Time stamp;
    std::function<void(rosbag::Bag&)> write;
  };
  std::string path_, temporary_;
  std::vector<Event> events_;
  std::unique_ptr<rosbag::Bag> bag_;
  bool finished_ = false;
};

}  // namespace vip_slam
