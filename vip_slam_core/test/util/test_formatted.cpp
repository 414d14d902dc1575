// SPDX-License-Identifier: BSD-3-Clause
// printf into a string.
#include <gtest/gtest.h>

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

TEST(Formatted, PrintsAsPrintfDoes) {
  EXPECT_EQ(formatted("%d of %zu, %.2f m, %s", 3, std::size_t{7}, 0.125, "kept"), "3 of 7, 0.12 m, kept");
  EXPECT_EQ(formatted("100 %%"), "100 %");
}

TEST(Formatted, KeepsTextsOfAnyLength) {
  const std::string path(5000, 'p');
  EXPECT_EQ(formatted("%s: %d files", path.c_str(), 2), path + ": 2 files");
  EXPECT_EQ(formatted("%s", ""), "");
}

}  // namespace
}  // namespace vip_slam
