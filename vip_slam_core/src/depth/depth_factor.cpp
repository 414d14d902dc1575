// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/depth/depth_factor.h"

#include <algorithm>
#include <cstdint>
#include <set>
#include <stdexcept>

#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/statistics.h"

namespace vip_slam {
namespace {

constexpr double kMillimetres = 1000, kFiveThousand = 5000;
constexpr std::uint16_t kNone = 65535;
constexpr int kEvery = 4;  // px, of rows and columns

}  // namespace

DepthFactor guessDepthFactor(const std::vector<cv::Mat>& raw) {
  constexpr double kFar = 13000;    // mm: 13 m
  constexpr double kNear = 1500;    // in 1/5000 m: 0.3 m
  constexpr double kLikely = 3600;  // between 1.6 m, where half of a room's pixels often lie, in either unit
  constexpr double kMultiples = 0.98;
  constexpr std::size_t kDistinct = 20;  // a few values may be multiples of 5 by chance
  std::vector<std::uint16_t> values;
  std::size_t multiples = 0;
  for (const cv::Mat& image : raw) {
    if (image.type() != CV_16UC1) throw std::invalid_argument("depth image: expected 16-bit grey");
    for (int v = 0; v < image.rows; v += kEvery)
      for (int u = 0; u < image.cols; u += kEvery) {
        const std::uint16_t z = image.at<std::uint16_t>(v, u);
        if (z == 0 || z == kNone) continue;
        values.push_back(z);
        multiples += z % 5 == 0;
      }
  }
  if (values.empty()) return {kFiveThousand, false, "no reading in the depth images looked at"};
  const double median = upperMedian(values), far = quantile(values, 0.95);
  const double share = static_cast<double>(multiples) / static_cast<double>(values.size());
  const bool varied = std::set<std::uint16_t>(values.begin(), values.end()).size() > kDistinct;
  DepthFactor out;
  if (varied && share > kMultiples && median > kNear)
    out = {kFiveThousand, true, "the values are multiples of 5, as millimetres written so"};
  else if (far > kFar)
    out = {kFiveThousand, true, formatted("in millimetres one reading in twenty were beyond %.0f m", kFar / 1000)};
  else if (median < kNear)
    out = {kMillimetres, true, formatted("as 1/5000 m the median were %.2f m", median / kFiveThousand)};
  else if (median < kLikely)
    out = {kMillimetres, false, formatted("as 1/5000 m the median were %.2f m", median / kFiveThousand)};
  else
    out = {kFiveThousand, false, formatted("in millimetres the median were %.1f m", median / kMillimetres)};
  out.reason += formatted("; so it is %.2f m", median / out.units_per_metre);
  return out;
}

}  // namespace vip_slam
