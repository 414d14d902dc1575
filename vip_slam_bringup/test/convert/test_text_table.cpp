// SPDX-License-Identifier: BSD-3-Clause
// Checks of a table's rows.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>

#include "vip_slam_bringup/convert/text_table.h"

namespace vip_slam {
namespace {

class TextTables : public ::testing::Test {
 protected:
  TextTables() : path_(::testing::TempDir() + "text_table.csv") {
    std::ofstream(path_) << "# a comment\n1\n";
    table_ = std::make_unique<TextTable>(path_, ",", 1);
  }
  ~TextTables() override { std::filesystem::remove(path_); }

  template <class F>
  std::string errorOf(const F& f) {
    try {
      f();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }
  const TextRow& row() const { return table_->rows().front(); }

  std::string path_;
  std::unique_ptr<TextTable> table_;
};

TEST_F(TextTables, StampsAscend) {
  EXPECT_EQ(errorOf([&] { table_->ascending(row(), 1.25, 1.5); }), "");
  EXPECT_EQ(errorOf([&] { table_->ascending(row(), 1.5, 1.5); }),
            path_ + ":2: the stamp 1.500000000 does not follow 1.500000000");
  // A nanosecond is less than a double resolves of today's seconds.
  const ros::Time now(1403715273, 262142976), next(1403715273, 262142977);
  EXPECT_EQ(errorOf([&] { table_->ascending(row(), now, next); }), "");
  EXPECT_EQ(errorOf([&] { table_->ascending(row(), next, now); }),
            path_ + ":2: the stamp 1403715273.262142976 does not follow 1403715273.262142977");
}

TEST_F(TextTables, QuaternionsHaveLengthOne) {
  EXPECT_EQ(table_->quaternion(row(), 0.6, 0, 0.8, 0).y(), 0.8);
  EXPECT_EQ(errorOf([&] { table_->quaternion(row(), 1, 0, 0, 0.75); }),
            path_ + ":2: the quaternion (w 1, x 0, y 0, z 0.75) has length 1.250, expected 1");
  EXPECT_NE(errorOf([&] { table_->quaternion(row(), 1.02, 0, 0, 0); }), "");
}

}  // namespace
}  // namespace vip_slam
