// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/corner_detector.h"

#include <algorithm>
#include <cmath>

#include <opencv2/features2d.hpp>

#include "vip_slam_frontend/tracking/pixel_noise.h"

namespace vip_slam {

namespace {

/// Occupied pixels on a raster of min_distance / 2, so that a distance check only visits neighbouring cells.
class Occupancy {
 public:
  Occupancy(const cv::Size& size, double distance)
      : distance2_(distance * distance),
        cell_(std::max(1.0, distance)),
        cols_(static_cast<int>(size.width / cell_) + 1),
        rows_(static_cast<int>(size.height / cell_) + 1),
        cells_(static_cast<std::size_t>(cols_) * rows_) {}

  void add(const cv::Point2f& p) { cells_[indexOf(p)].push_back(p); }
  bool free(const cv::Point2f& p) const {
    const int cx = std::clamp(static_cast<int>(p.x / cell_), 0, cols_ - 1);
    const int cy = std::clamp(static_cast<int>(p.y / cell_), 0, rows_ - 1);
    for (int y = std::max(0, cy - 1); y <= std::min(rows_ - 1, cy + 1); ++y) {
      for (int x = std::max(0, cx - 1); x <= std::min(cols_ - 1, cx + 1); ++x) {
        for (const cv::Point2f& q : cells_[static_cast<std::size_t>(y) * cols_ + x]) {
          const double dx = p.x - q.x, dy = p.y - q.y;
          if (dx * dx + dy * dy < distance2_) return false;
        }
      }
    }
    return true;
  }

 private:
  std::size_t indexOf(const cv::Point2f& p) const {
    const int x = std::clamp(static_cast<int>(p.x / cell_), 0, cols_ - 1);
    const int y = std::clamp(static_cast<int>(p.y / cell_), 0, rows_ - 1);
    return static_cast<std::size_t>(y) * cols_ + x;
  }
  double distance2_, cell_;
  int cols_, rows_;
  std::vector<std::vector<cv::Point2f>> cells_;
};

bool stronger(const Corner& a, const Corner& b) {
  if (a.score != b.score) return a.score > b.score;
  return a.pixel.y != b.pixel.y ? a.pixel.y < b.pixel.y : a.pixel.x < b.pixel.x;
}

}  // namespace

float cornerScore(const cv::Mat& gray, int x, int y, int radius) {
  if (x - radius < 1 || y - radius < 1 || x + radius >= gray.cols - 1 || y + radius >= gray.rows - 1) return 0;
  int xx = 0, xy = 0, yy = 0;
  for (int v = y - radius; v <= y + radius; ++v) {
    const std::uint8_t* row = gray.ptr<std::uint8_t>(v);
    const std::uint8_t* above = gray.ptr<std::uint8_t>(v - 1);
    const std::uint8_t* below = gray.ptr<std::uint8_t>(v + 1);
    for (int u = x - radius; u <= x + radius; ++u) {
      const int gx = row[u + 1] - row[u - 1], gy = below[u] - above[u];
      xx += gx * gx;
      xy += gx * gy;
      yy += gy * gy;
    }
  }
  const float n = 4.0f * (2 * radius + 1) * (2 * radius + 1);
  const float a = xx / n, b = xy / n, c = yy / n;
  return 0.5f * (a + c - std::sqrt((a - c) * (a - c) + 4 * b * b));
}

std::vector<Corner> detectCorners(const cv::Mat& gray, const std::vector<cv::Point2f>& occupied, int wanted,
                                  const TrackingOptions& options, const cv::Mat& mask) {
  std::vector<Corner> result;
  if (wanted <= 0) return result;
  // For an even spread of corners the image has as many square cells as features are wanted in it.
  const double aspect = static_cast<double>(gray.cols) / gray.rows;
  const int cols = std::max(1, cvRound(std::sqrt(options.max_features * aspect)));
  const int rows = std::max(1, cvRound(std::sqrt(options.max_features / aspect)));
  const int border = options.border;
  std::vector<int> count(static_cast<std::size_t>(cols) * rows, 0);
  Occupancy occupancy(gray.size(), options.min_distance);
  for (const cv::Point2f& p : occupied) {
    occupancy.add(p);
    const int cx = std::clamp(static_cast<int>(p.x * cols / gray.cols), 0, cols - 1);
    const int cy = std::clamp(static_cast<int>(p.y * rows / gray.rows), 0, rows - 1);
    ++count[static_cast<std::size_t>(cy) * cols + cx];
  }

  std::vector<Corner> best, rest;
  std::vector<cv::KeyPoint> keypoints;
  for (int cy = 0; cy < rows; ++cy) {
    for (int cx = 0; cx < cols; ++cx) {
      const int x0 = std::max(border, cx * gray.cols / cols);
      const int x1 = std::min(gray.cols - border, (cx + 1) * gray.cols / cols);
      const int y0 = std::max(border, cy * gray.rows / rows);
      const int y1 = std::min(gray.rows - border, (cy + 1) * gray.rows / rows);
      const int taken = count[static_cast<std::size_t>(cy) * cols + cx];
      if (x1 - x0 < 3 || y1 - y0 < 3 || taken > 2) continue;
      // FAST looks three pixels around and leaves a frame of three: widen the cell by that.
      const cv::Rect roi(x0 - 3, y0 - 3, x1 - x0 + 6, y1 - y0 + 6);
      keypoints.clear();
      const auto search = [&](int threshold) {
        cv::FAST(gray(roi), keypoints, threshold, true);
        if (!mask.empty()) cv::KeyPointsFilter::runByPixelsMask(keypoints, mask(roi));
      };
      search(options.fast_threshold);
      if (keypoints.empty() && taken == 0) search(cvRound(kGreySigma));
      std::vector<Corner> cell;
      for (const cv::KeyPoint& k : keypoints) {
        const cv::Point2f p(k.pt.x + roi.x, k.pt.y + roi.y);
        if (!occupancy.free(p)) continue;
        const float score = cornerScore(gray, cvRound(p.x), cvRound(p.y), 4);
        if (score > 0) cell.push_back({p, score});
      }
      if (cell.empty()) continue;
      std::sort(cell.begin(), cell.end(), stronger);
      std::size_t first = 0;
      if (taken == 0) best.push_back(cell[first++]);
      for (std::size_t i = first; i < std::min<std::size_t>(cell.size(), 4); ++i) rest.push_back(cell[i]);
    }
  }
  std::sort(best.begin(), best.end(), stronger);
  std::sort(rest.begin(), rest.end(), stronger);
  for (const std::vector<Corner>* list : {&best, &rest}) {
    for (const Corner& corner : *list) {
      if (static_cast<int>(result.size()) >= wanted) return result;
      if (!occupancy.free(corner.pixel)) continue;
      occupancy.add(corner.pixel);
      result.push_back(corner);
    }
  }
  return result;
}

}  // namespace vip_slam
