// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/util/output_folder.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <system_error>

#include <unistd.h>

namespace vip_slam {

void prepareOutputFolder(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw std::runtime_error(folder + ": cannot be created: " + error.message());
  const std::filesystem::path probe = std::filesystem::path(folder) / (".partial-" + std::to_string(::getpid()));
  errno = 0;
  if (!std::ofstream(probe))
    throw std::runtime_error(folder + ": no file can be written into it: " + std::strerror(errno));
  std::filesystem::remove(probe, error);
}

}  // namespace vip_slam
