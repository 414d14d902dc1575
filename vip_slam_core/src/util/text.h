// SPDX-License-Identifier: BSD-3-Clause
// Small text helpers of the file formats: locale-free numbers and their shortest exact spelling.
#pragma once

#include <cstddef>
#include <string>

namespace vip_slam {

/// The shortest text that reads back as the same double.
std::string formatDouble(double value);
/// False unless the whole text is one number; NaN and infinity are accepted, callers must check.
bool parseDouble(const std::string& text, double* value);
/// False unless the whole text is one decimal integer that fits.
bool parseInt(const std::string& text, int* value);
/// true/false, yes/no, on/off, 1/0.
bool parseBool(const std::string& text, bool* value);
/// Insertions, deletions and replacements of single characters that turn `a` into `b` (Levenshtein).
std::size_t editDistance(const std::string& a, const std::string& b);

}  // namespace vip_slam
