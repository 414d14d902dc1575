#include "vip_slam_bringup/convert/bag_output.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include <rosbag/bag.h>

namespace vip_slam {

BagOutput::BagOutput(const std::string& path, bool overwrite)
    : path_(path), temporary_(path + ".part" + std::to_string(::getpid())), bag_(new rosbag::Bag) {
  if (!overwrite && std::filesystem::exists(path))
    throw std::runtime_error(path + ": exists already; remove it or give --force");
  try {
    bag_->open(temporary_, rosbag::bagmode::Write);
  } catch (const rosbag::BagException& e) {
    throw std::runtime_error(path + ": cannot be written: " + e.what());
  }
  bag_->setCompression(rosbag::compression::LZ4);
}

BagOutput::~BagOutput() {
  if (finished_) return;
  try {
    bag_->close();
  } catch (const std::exception&) {
    // The half-written bag is removed next; there is nothing to tell the user about it. The bag would close itself once
    // more and, on a full disk, end the program by throwing.
    static_cast<void>(bag_.release());
  }
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void BagOutput::add(const ros::Time& stamp, std::function<void(rosbag::Bag&)> write) {
  events_.push_back({stamp, std::move(write)});
}

void BagOutput::finish(const std::function<void(std::size_t, std::size_t)>& progress) {
  std::stable_sort(events_.begin(), events_.end(), [](const Event& a, const Event& b) { return a.stamp < b.stamp; });
  try {
    for (std::size_t i = 0; i < events_.size(); ++i) {
      events_[i].write(*bag_);
      if (progress) progress(i + 1, events_.size());
    }
    bag_->close();
  } catch (const rosbag::BagException& e) {
    throw std::runtime_error(path_ + ": cannot be written: " + e.what());
  }
  std::error_code error;
  std::filesystem::rename(temporary_, path_, error);
  if (error) throw std::runtime_error(path_ + ": cannot be written: " + error.message());
  finished_ = true;
}

}  // namespace vip_slam
