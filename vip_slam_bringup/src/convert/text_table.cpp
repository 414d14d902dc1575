// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/convert/text_table.h"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <stdexcept>

#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/stamp_unit.h"

namespace vip_slam {
namespace {

std::string stripped(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<std::string> split(const std::string& line, const std::string& separators) {
  const bool blanks = separators.find(' ') != std::string::npos;
  std::vector<std::string> cells;
  std::size_t begin = 0;
  while (true) {
    const auto end = line.find_first_of(separators, begin);
    const std::string cell = stripped(line.substr(begin, end == std::string::npos ? end : end - begin));
    if (!(blanks && cell.empty())) cells.push_back(cell);
    if (end == std::string::npos) return cells;
    begin = end + 1;
  }
}

bool isNumber(const std::string& text) {
  if (text.empty()) return false;
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return *end == '\0' && std::isfinite(value);
}

}  // namespace

TextTable::TextTable(const std::string& path, const std::string& separators, std::size_t min_columns) : path_(path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be opened");
  std::string line;
  int number = 0;
  while (std::getline(file, line)) {
    ++number;
    const std::string text = stripped(line);
    if (text.empty() || text[0] == '#') continue;
    TextRow row{number, split(text, separators)};
    if (number == 1 && !isNumber(row.cells[0])) continue;  // a header
    if (row.cells.size() < min_columns)
      fail(row, std::to_string(row.cells.size()) + " columns, expected at least " + std::to_string(min_columns));
    rows_.push_back(std::move(row));
  }
  if (rows_.empty())
    throw std::runtime_error(path + ": no data, expected rows of " + std::to_string(min_columns) + " columns");
  const std::string &first = rows_.front().cells[0], &last = rows_.back().cells[0];
  if (isNumber(first) && isNumber(last))
    unit_ = secondsPerUnit(std::strtod(first.c_str(), nullptr), std::strtod(last.c_str(), nullptr), rows_.size());
}

double TextTable::number(const TextRow& row, std::size_t column, const std::string& what) const {
  if (column >= row.cells.size()) fail(row, what + " is missing (column " + std::to_string(column + 1) + ")");
  if (!isNumber(row.cells[column])) fail(row, what + " is '" + row.cells[column] + "', expected a number");
  return std::strtod(row.cells[column].c_str(), nullptr);
}

double TextTable::seconds(const TextRow& row) const {
  const double t = unit_ * number(row, 0, "the stamp");
  constexpr double kEnd = std::numeric_limits<std::uint32_t>::max();
  if (!(t >= 0 && t < kEnd))
    fail(row, formatted("the stamp is %.9g s, expected 0 to %.0f, as a bag can hold", t, kEnd));
  return t;
}

long long TextTable::nanoseconds(const TextRow& row, std::size_t column) const {
  const std::string& text = row.cells.at(column);
  char* end = nullptr;
  const long long value = std::strtoll(text.c_str(), &end, 10);
  if (text.empty() || *end != '\0' || value < 0) fail(row, "the stamp is '" + text + "', expected whole nanoseconds");
  if (value / 1000000000 > std::numeric_limits<std::uint32_t>::max())
    fail(row, "the stamp is " + text + " ns, which is more than a bag can hold (4294967295 s)");
  return value;
}

void TextTable::ascending(const TextRow& row, double before, double t) const {
  if (!(t > before)) fail(row, formatted("the stamp %.9f does not follow %.9f", t, before));
}

void TextTable::ascending(const TextRow& row, const ros::Time& before, const ros::Time& stamp) const {
  if (stamp <= before)
    fail(row, formatted("the stamp %u.%09u does not follow %u.%09u", stamp.sec, stamp.nsec, before.sec, before.nsec));
}

Eigen::Quaterniond TextTable::quaternion(const TextRow& row, double w, double x, double y, double z) const {
  const Eigen::Quaterniond q(w, x, y, z);
  if (!(std::abs(q.norm() - 1.0) <= 0.01))
    fail(row, formatted("the quaternion (w %g, x %g, y %g, z %g) has length %.3f, expected 1", w, x, y, z, q.norm()));
  return q;
}

void TextTable::fail(const TextRow& row, const std::string& message) const {
  throw std::runtime_error(path_ + ":" + std::to_string(row.line) + ": " + message);
}

}  // namespace vip_slam
