// Small text helpers of the file formats: locale-free numbers and their shortest exact spelling.
#pragma once

#include <string>

namespace vip_slam {

/// The shortest text that reads back as the same double.
std::string formatDouble(double value);
/// False unless the whole text is one number; NaN and infinity are numbers here, callers judge.
bool parseDouble(const std::string& text, double* value);
/// False unless the whole text is one decimal integer that fits.
bool parseInt(const std::string& text, int* value);
/// true/false, yes/no, on/off, 1/0.
bool parseBool(const std::string& text, bool* value);

}  // namespace vip_slam
