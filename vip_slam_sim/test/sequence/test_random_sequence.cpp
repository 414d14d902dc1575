// SPDX-License-Identifier: BSD-3-Clause
// The script that draws random definitions: all are accepted, and equal seeds give equal definitions.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include <gtest/gtest.h>

#include "test_support.h"

namespace vip_slam {
namespace {

namespace fs = std::filesystem;

std::string drawn(const fs::path& folder, int seed) {
  const std::string command = std::string("/usr/bin/python3 ") + VIP_SLAM_SIM_SOURCE_DIR + "/scripts/random_sequence " +
                              std::to_string(seed) + " --out " + folder.string() + " > /dev/null";
  EXPECT_EQ(std::system(command.c_str()), 0);
  return (folder / ("random_" + std::to_string(seed) + ".yaml")).string();
}

std::string slurp(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(RandomSequence, EveryDefinitionIsAccepted) {
  const fs::path folder = fs::temp_directory_path() / "vip_slam_random_sequence";
  fs::remove_all(folder);
  std::set<std::string> scenes, depths;
  for (int seed = 0; seed < 25; ++seed) {
    const SequenceSpec spec = loadSequence(drawn(folder, seed), libraryPath());
    EXPECT_GE(spec.motion.duration, 45);
    EXPECT_NE(spec.depth.separate(), spec.depth.lag == 0) << seed;
    scenes.insert(spec.scene);
    depths.insert(spec.depth.model);
  }
  EXPECT_GE(scenes.size(), 5u);
  EXPECT_EQ(depths.size(), 4u);
  const std::string once = slurp(drawn(folder, 7));
  EXPECT_FALSE(once.empty());
  EXPECT_EQ(slurp(drawn(folder, 7)), once);
  EXPECT_NE(slurp(drawn(folder, 8)), once);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace vip_slam
