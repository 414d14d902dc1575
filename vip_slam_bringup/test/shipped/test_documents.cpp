// SPDX-License-Identifier: BSD-3-Clause
// Documents generated from the code are up to date, and their links have targets.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>

#include <gtest/gtest.h>

#include "vip_slam_bringup/parameter_reference.h"

namespace fs = std::filesystem;

namespace {

std::string slurp(const fs::path& path) {
  std::ifstream file(path);
  return std::string((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
}

TEST(Documents, ParameterReferenceIsUpToDate) {
  EXPECT_EQ(slurp(fs::path(ROOT) / "docs/parameters.md"), vip_slam::parameterReference())
      << "run: rosrun vip_slam_bringup parameter_reference > docs/parameters.md";
}

TEST(Documents, LinksLeadToFiles) {
  std::vector<fs::path> pages{fs::path(ROOT) / "README.md"};
  for (const auto& entry : fs::directory_iterator(fs::path(ROOT) / "docs"))
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  ASSERT_GT(pages.size(), 4u);
  const std::regex link("\\]\\(([^)#]+)(#[^)]*)?\\)");
  for (const fs::path& page : pages) {
    const std::string text = slurp(page);
    ASSERT_FALSE(text.empty()) << page;
    for (std::sregex_iterator it(text.begin(), text.end(), link), end; it != end; ++it) {
      const std::string target = (*it)[1];
      if (target.rfind("http", 0) == 0) continue;
      EXPECT_TRUE(fs::exists(page.parent_path() / target)) << page << " links to " << target;
    }
  }
}

/// Rows "| `name` | type |" and "| `name`, `name` |" of a page: name -> second cell without backticks.
std::map<std::string, std::string> namedRows(const std::string& text) {
  std::map<std::string, std::string> out;
  std::istringstream lines(text);
  const std::regex name("`([^`]+)`");
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("| `", 0) != 0) continue;
    const auto first_end = line.find(" |", 2), second_end = line.find(" |", first_end + 2);
    std::string second = line.substr(first_end + 3, second_end - first_end - 3);
    second.erase(std::remove(second.begin(), second.end(), '`'), second.end());
    const std::string first = line.substr(0, first_end);
    for (std::sregex_iterator it(first.begin(), first.end(), name), end; it != end; ++it) out[(*it)[1]] = second;
  }
  return out;
}

// docs/ros_api.md is checked against the running system; the readme's shorter tables against it.
TEST(Documents, ReadmeNamesTopicsAndServicesThatExist) {
  const auto readme = namedRows(slurp(fs::path(ROOT) / "README.md")),
             api = namedRows(slurp(fs::path(ROOT) / "docs/ros_api.md"));
  EXPECT_GT(readme.size(), 18u);
  for (const auto& [name, type] : readme) {
    if (name == "map" || name == "odom" || name == "base_link") continue;  // frames
    const auto known = api.find(name);
    ASSERT_NE(known, api.end()) << name << " is not in docs/ros_api.md";
    if (type.find('/') != std::string::npos) EXPECT_EQ(known->second, type) << name;
  }
}

}  // namespace
