// SPDX-License-Identifier: BSD-3-Clause
// Every source file names its licence in its head, as tools that list licences expect.
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include <gtest/gtest.h>

namespace fs = std::filesystem;

namespace {

bool isSource(const fs::path& path) {
  static const std::set<std::string> kEndings{".cpp", ".h",  ".inc", ".S",     ".js",
                                              ".css", ".py", ".cfg", ".cmake", ".Dockerfile"};
  if (kEndings.count(path.extension()) || path.filename() == "CMakeLists.txt") return true;
  std::ifstream file(path);
  std::string line;
  return std::getline(file, line) && line.rfind("#!", 0) == 0;
}

/// Whether one of the first lines is a comment with the licence.
bool namesLicence(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  for (int i = 0; i < 20 && std::getline(file, line); ++i)
    for (const char* comment : {"// ", "# ", "/* "})
      if (line.rfind(std::string(comment) + "SPDX-License-Identifier: BSD-3-Clause", 0) == 0) return true;
  return false;
}

TEST(Licence, IsNamedInTheHeadOfEverySourceFile) {
  int sources = 0;
  for (const auto& folder : fs::directory_iterator(ROOT)) {
    const std::string name = folder.path().filename();
    if (!folder.is_directory() || (name.rfind("vip_slam", 0) != 0 && name != "scripts" && name != "docker")) continue;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      const fs::path& path = entry.path();
      if (!entry.is_regular_file() || path.string().find("/corpus/") != std::string::npos ||
          path.string().find("__pycache__") != std::string::npos || !isSource(path))
        continue;
      ++sources;
      EXPECT_TRUE(namesLicence(path)) << path << " names no licence; run: scripts/spdx";
    }
  }
  EXPECT_GT(sources, 1000);
}

}  // namespace
