// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/convert/bag_output.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include <rosbag/bag.h>

#include "vip_slam_bringup/convert/converters.h"

namespace vip_slam {

BagOutput::BagOutput(const std::string& path, bool overwrite)
    : path_(path), temporary_(path + ".part" + std::to_string(::getpid())), bag_(new rosbag::Bag) {
  if (!overwrite) {
    // The companion files are protected too: the user may have edited them, a calibrated sensor file above all.
    const std::string stem = bagStem(path);
    for (const std::string& file : {path, stem + "_sensor.yaml", stem + "_truth.tum"}) {
      if (std::filesystem::exists(file)) throw std::runtime_error(file + ": exists already; remove it or give --force");
    }
  }
  try {
    bag_->open(temporary_, rosbag::bagmode::Write);
  } catch (const rosbag::BagException& e) {
    // The words of the bag library name the temporary file.
    std::string why = e.what();
    if (const auto at = why.find(temporary_); at != std::string::npos) why.replace(at, temporary_.size(), path);
    throw std::runtime_error(path + ": cannot be written: " + why);
  }
  bag_->setCompression(rosbag::compression::LZ4);
}

BagOutput::~BagOutput() {
  if (finished_) return;
  try {
    bag_->close();
  } catch (const std::exception&) {
    // The half-written bag is removed next, so the error need not be reported. Released, since the bag's destructor
    // would close it again and, on a full disk, end the program by throwing.
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
