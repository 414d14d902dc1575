// SPDX-License-Identifier: BSD-3-Clause
// Opening recordings, with the same error messages in every tool.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <rosbag/bag.h>
#include <rosbag/view.h>

namespace vip_slam {

/// Opens `path` for reading. Throws std::runtime_error naming the file: missing, not a bag, or truncated, with the
/// remedy.
void openBag(const std::string& path, rosbag::Bag* bag);

/// The bags of one recording, split in time or by topics, read as one: messages come in the order of their record
/// times, whatever the order of the bags.
class BagSet {
 public:
  /// `inputs`: bags, folders (every *.bag in them) and patterns ("run_*.bag"). A bag that is named twice is read once,
  /// and the "*.orig.bag" that `rosbag reindex` leaves is taken by its name only. Throws std::runtime_error naming the
  /// input: nothing there, no bag in a folder, a file that openBag refuses, or no message in all of them.
  explicit BagSet(const std::vector<std::string>& inputs);
  BagSet(const std::string& input) : BagSet(std::vector<std::string>{input}) {}
  BagSet(const char* input) : BagSet(std::string(input)) {}

  /// The messages of `topics` (none: of all) recorded from `begin` to `end`.
  std::unique_ptr<rosbag::View> view(const std::vector<std::string>& topics = {},
                                     const ros::Time& begin = ros::TIME_MIN,
                                     const ros::Time& end = ros::TIME_MAX) const;

  std::size_t size() const { return bags_.size(); }
  /// For messages: the bag's path; of several the first one's "and 2 more".
  std::string name() const;
  /// All paths in order of time, separated by ", ".
  std::string paths() const;
  /// One line on several bags: in which order they are read, how long each is, gaps between them of over a second.
  std::string description() const;

 private:
  struct Part {
    std::string path;
    std::unique_ptr<rosbag::Bag> bag;
    ros::Time begin, end;
    bool empty;
  };
  std::vector<Part> bags_;  ///< by begin
};

}  // namespace vip_slam
