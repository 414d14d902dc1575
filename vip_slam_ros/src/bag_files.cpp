#include "vip_slam_ros/bag_files.h"

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace vip_slam {

void openBag(const std::string& path, rosbag::Bag* bag) {
  if (!std::filesystem::exists(path)) throw std::runtime_error(path + ": no such file, expected a bag");
  std::ifstream file(path, std::ios::binary);
  std::string first;
  if (!std::getline(file, first) || first.rfind("#ROSBAG V", 0) != 0)
    throw std::runtime_error(path + ": not a readable bag, expected a file that rosbag recorded");
  try {
    bag->open(path, rosbag::bagmode::Read);
  } catch (const std::exception& error) {
    throw std::runtime_error(path + ": not a readable bag: " + error.what() +
                             "; if the recording was cut off, run: rosbag reindex " + path);
  }
}

}  // namespace vip_slam
