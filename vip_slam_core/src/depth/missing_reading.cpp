// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/depth/missing_reading.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "vip_slam_core/util/statistics.h"

namespace vip_slam {

namespace {

constexpr int kAcross = 50;       // samples along a row
constexpr double kShare = 0.01;   // of the samples, that have the value
constexpr int kAround = 5;        // values of the image on either side, whose distances tell how coarse they are
constexpr double kNear = 0.05;    // of the distance: neighbours on one surface
constexpr int kBorders = 30;      // neighbours with another value that are asked for
constexpr double kFewNear = 0.1;  // of them on one surface

struct Candidate {
  float value = 0;    ///< that most samples have, m; 0 when it is not many
  float spacing = 0;  ///< of the values around it, m
};

Candidate commonest(const cv::Mat& depth) {
  std::vector<float> values;
  const int step = std::max(1, depth.cols / kAcross);
  for (int v = 0; v < depth.rows; v += step)
    for (int u = 0; u < depth.cols; u += step) values.push_back(depth.at<float>(v, u));
  const std::size_t all = values.size();
  values.erase(std::remove_if(values.begin(), values.end(), [](float z) { return !std::isfinite(z) || z <= 0; }),
               values.end());
  std::sort(values.begin(), values.end());
  Candidate common;
  std::vector<float> distinct;
  std::size_t index = 0;
  std::size_t most = static_cast<std::size_t>(kShare * static_cast<double>(all));
  for (std::size_t i = 0; i < values.size();) {
    std::size_t next = i + 1;
    while (next < values.size() && values[next] == values[i]) ++next;
    if (next - i > most) {
      most = next - i;
      common.value = values[i];
      index = distinct.size();
    }
    distinct.push_back(values[i]);
    i = next;
  }
  std::vector<float> gaps;
  for (std::size_t i = std::max<std::size_t>(index, kAround) - kAround; i + 1 < distinct.size() && i < index + kAround;
       ++i)
    gaps.push_back(distinct[i + 1] - distinct[i]);
  if (!gaps.empty()) common.spacing = upperMedian(std::move(gaps));
  return common;
}

/// Whether no patch of this value passes into a neighbouring reading.
bool standsApart(const cv::Mat& depth, const Candidate& candidate) {
  const float value = candidate.value;
  const double same_surface = std::max(kNear * value, 2.0 * candidate.spacing);
  int near = 0, borders = 0;
  for (int v = 0; v < depth.rows; ++v) {
    const float* row = depth.ptr<float>(v);
    for (int u = 0; u + 1 < depth.cols; ++u) {
      // Across; what stands apart does so in every direction.
      const bool here = row[u] == value, there = row[u + 1] == value;
      if (here == there) continue;
      const float other = here ? row[u + 1] : row[u];
      if (!std::isfinite(other) || other <= 0) continue;
      ++borders;
      near += std::abs(other - value) < same_surface;
    }
  }
  return borders >= kBorders && near < kFewNear * borders;
}

}  // namespace

void MissingReading::look(const cv::Mat& depth) {
  const Candidate common = commonest(depth);
  const bool stands = common.value > 0 && standsApart(depth, common);
  if (!stands || common.value != candidate_) images_ = 0;
  candidate_ = stands ? common.value : 0;
  if (stands) images_ = std::min(images_ + 1, kImages);
}

}  // namespace vip_slam
