// Documents that follow from the code are up to date, and their links lead somewhere.
#include <filesystem>
#include <fstream>
#include <regex>

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

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
