// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <stdexcept>

#include "vip_slam_bringup/convert/bag_output.h"
#include "vip_slam_bringup/convert/converters.h"

namespace vip_slam {

std::string bagStem(const std::string& bag) {
  const std::string ending = ".bag";
  if (bag.size() <= ending.size() || bag.compare(bag.size() - ending.size(), ending.size(), ending) != 0)
    throw std::runtime_error(bag + ": the output must be named *.bag");
  return bag.substr(0, bag.size() - ending.size());
}

void finishConversion(const ConversionOptions& options, const SensorConfig& sensor, const Trajectory& truth,
                      BagOutput* bag, ConversionReport* report) {
  const std::string stem = bagStem(options.bag);
  // Before the other files are written: when the bag fails, those of an older bag with this name stay intact.
  bag->finish(options.progress);
  try {
    report->files.push_back(stem + "_sensor.yaml");
    saveSensorConfig(report->files.back(), sensor);
    if (!truth.empty()) {
      report->files.push_back(stem + "_truth.tum");
      writeTum(report->files.back(), truth);
    } else {  // that of another recording, which this bag replaced
      std::error_code ignored;
      std::filesystem::remove(stem + "_truth.tum", ignored);
    }
  } catch (...) {
    for (const std::string& file : report->files) {
      std::error_code ignored;
      std::filesystem::remove(file, ignored);
    }
    throw;
  }
  report->files.insert(report->files.begin(), options.bag);
}

}  // namespace vip_slam
