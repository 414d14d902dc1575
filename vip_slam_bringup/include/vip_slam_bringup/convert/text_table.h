// SPDX-License-Identifier: BSD-3-Clause
// Tables in text files (CSV or blank-separated); every error names file and line.
#pragma once

#include <string>
#include <vector>

#include <ros/time.h>
#include <Eigen/Geometry>

namespace vip_slam {

struct TextRow {
  int line = 0;  ///< 1-based
  std::vector<std::string> cells;
};

class TextTable {
 public:
  /// Cells end at any of `separators` and are stripped of blanks. Lines that are empty or begin with '#' are left out;
  /// so is the first line when its first cell is not a number. Throws std::runtime_error when the file cannot be read,
  /// holds no row, or a row has fewer than `min_columns` cells.
  TextTable(const std::string& path, const std::string& separators, std::size_t min_columns);

  const std::vector<TextRow>& rows() const { return rows_; }
  const std::string& path() const { return path_; }

  /// The cell as a finite number; throws std::runtime_error "file:line: gyro x is 'abc', expected a number".
  double number(const TextRow& row, std::size_t column, const std::string& what) const;
  /// The first cell as a stamp in seconds, whose unit secondsPerUnit tells from the first and the last row. Throws when
  /// it is not from 0 to what a bag can hold.
  double seconds(const TextRow& row) const;
  /// The cell as whole nanoseconds, as far as a bag can hold them.
  long long nanoseconds(const TextRow& row, std::size_t column) const;
  /// Throws std::runtime_error "file:line: the stamp 1.500000000 does not follow 1.500000000" unless it is later.
  void ascending(const TextRow& row, double before, double t) const;
  void ascending(const TextRow& row, const ros::Time& before, const ros::Time& stamp) const;
  /// Throws std::runtime_error "file:line: the quaternion (w, x, y, z) has length 1.2, expected 1" when it is off by
  /// more than a hundredth.
  Eigen::Quaterniond quaternion(const TextRow& row, double w, double x, double y, double z) const;
  /// Throws std::runtime_error "file:line: message".
  [[noreturn]] void fail(const TextRow& row, const std::string& message) const;

 private:
  std::string path_;
  std::vector<TextRow> rows_;
  double unit_ = 1;  ///< seconds in one unit of the first column, where that is a stamp
};

}  // namespace vip_slam
