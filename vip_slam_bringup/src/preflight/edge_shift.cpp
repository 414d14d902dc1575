// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/preflight/edge_shift.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "vip_slam_core/util/statistics.h"

namespace vip_slam {
namespace {

constexpr int kColumns = 160;            // of the small images, cells
constexpr int kPatch = 31;               // cells around, the mean of which is taken out
constexpr double kSecond = 1.0;          // s
constexpr float kEdgeJump = 0.08f;       // of the nearer depth, from one pixel to the next
constexpr float kStrong = 60;            // grey levels of gradient: stronger edges count no more
constexpr std::size_t kLeastEdges = 60;  // pixels of depth edges in an image

/// Without the mean around, of length one; the size of the correlation.
cv::Mat normalised(const cv::Mat& full, const cv::Size& size) {
  cv::Mat cells, around;
  cv::resize(full, cells, size, 0, 0, cv::INTER_AREA);
  cv::blur(cells, around, {kPatch, kPatch});
  cells -= around;
  const double length = cv::norm(cells);
  return length > 0 ? cv::Mat(cells / length) : cells;
}

/// At (dx, dy): how well `edges` of the image fit those of `depth` moved by that much, wrapped round.
cv::Mat correlation(const cv::Mat& edges, const cv::Mat& depth) {
  cv::Mat a, b, product, out;
  cv::dft(edges, a);
  cv::dft(depth, b);
  cv::mulSpectrums(a, b, product, 0, true);
  cv::idft(product, out, cv::DFT_REAL_OUTPUT | cv::DFT_SCALE);
  return out;
}

cv::Mat gradient(const cv::Mat& grey) {
  cv::Mat smooth, dx, dy, strength;
  cv::GaussianBlur(grey, smooth, {0, 0}, 1.0);
  cv::Sobel(smooth, dx, CV_32F, 1, 0);
  cv::Sobel(smooth, dy, CV_32F, 0, 1);
  cv::magnitude(dx, dy, strength);
  return cv::min(strength, kStrong);
}

/// The nearer depth where it jumps towards the right or lower neighbour, else 0.
cv::Mat nearerAtJumps(const cv::Mat& depth) {
  cv::Mat out = cv::Mat::zeros(depth.size(), CV_32F);
  const auto nearer = [](float a, float b) {
    return a > 0 && b > 0 && std::abs(a - b) > kEdgeJump * std::min(a, b) ? std::min(a, b) : 0.f;
  };
  for (int v = 0; v + 1 < depth.rows; ++v)
    for (int u = 0; u + 1 < depth.cols; ++u) {
      const float z = depth.at<float>(v, u);
      out.at<float>(v, u) = std::max(nearer(z, depth.at<float>(v, u + 1)), nearer(z, depth.at<float>(v + 1, u)));
    }
  return out;
}

}  // namespace

void EdgeShifts::Sum::add(const cv::Mat& one) {
  if (correlation.empty()) correlation = cv::Mat::zeros(one.size(), CV_32F);
  if (one.size() != correlation.size()) return;
  correlation += one;
  ++images;
}

EdgeShift EdgeShifts::Sum::shift(double cell) const {
  EdgeShift out;
  out.t = t;
  out.images = images;
  if (images == 0) return out;
  const cv::Mat& c = correlation;
  const auto at = [&](int x, int y) { return c.at<float>((y + c.rows) % c.rows, (x + c.cols) % c.cols); };
  cv::Point peak;
  double most;
  cv::minMaxLoc(c, nullptr, &most, nullptr, &peak);
  cv::Scalar mean, sigma;
  cv::meanStdDev(c, mean, sigma);
  const auto between = [](double before, double top, double after) {
    const double curve = before - 2 * top + after;
    return curve < 0 ? std::clamp(0.5 * (before - after) / curve, -0.5, 0.5) : 0.0;
  };
  const double x = peak.x + between(at(peak.x - 1, peak.y), most, at(peak.x + 1, peak.y));
  const double y = peak.y + between(at(peak.x, peak.y - 1), most, at(peak.x, peak.y + 1));
  out.shift = cell * Eigen::Vector2d(x > c.cols / 2 ? x - c.cols : x, y > c.rows / 2 ? y - c.rows : y);
  out.sigmas = sigma[0] > 0 ? most / sigma[0] : 0;
  double here = -1e9;
  for (int v = -2; v <= 2; ++v)
    for (int u = -2; u <= 2; ++u) here = std::max(here, double(at(u, v)));
  out.unmoved = most > 0 ? here / most : 1;
  return out;
}

void EdgeShifts::add(double t, const cv::Mat& grey, const cv::Mat& depth) {
  if (grey.size() != depth.size()) return;
  const cv::Mat jumps = nearerAtJumps(depth);
  std::vector<float> nearer;
  for (int v = 0; v < jumps.rows; ++v)
    for (int u = 0; u < jumps.cols; ++u)
      if (jumps.at<float>(v, u) > 0) nearer.push_back(jumps.at<float>(v, u));
  if (nearer.size() < kLeastEdges) return;
  const float middle = upperMedian(nearer);
  cell_ = double(grey.cols) / kColumns;
  const cv::Size size(kColumns, std::max(8, cvRound(grey.rows / cell_)));
  const cv::Mat edges = normalised(gradient(grey), size);
  const auto of = [&](const cv::Mat& mask) {
    cv::Mat ones;
    mask.convertTo(ones, CV_32F, 1 / 255.0);
    return correlation(edges, normalised(ones, size));
  };
  if (seconds_.empty() || t - seconds_.back().t >= kSecond || t < seconds_.back().t) seconds_.push_back({t, {}, 0});
  seconds_.back().add(of(jumps > 0));
  const auto inverse = [&](bool near) {
    double sum = 0, n = 0;
    for (const float z : nearer)
      if ((z < middle) == near) sum += 1 / z, n += 1;
    return n > 0 ? sum / n : 0;
  };
  near_.add(of((jumps > 0) & (jumps < middle)));
  far_.add(of(jumps >= middle));
  near_inverse_ += inverse(true);
  far_inverse_ += inverse(false);
}

EdgeShiftRecord EdgeShifts::record() const {
  EdgeShiftRecord out;
  Sum all;
  for (const Sum& second : seconds_) {
    out.seconds.push_back(second.shift(cell_));
    all.t = seconds_.front().t;
    if (second.images > 0) all.add(second.correlation);
  }
  out.all = all.shift(cell_);
  out.near = near_.shift(cell_);
  out.far = far_.shift(cell_);
  out.nearer = far_inverse_ > 0 ? near_inverse_ / far_inverse_ : 1;
  return out;
}

}  // namespace vip_slam
