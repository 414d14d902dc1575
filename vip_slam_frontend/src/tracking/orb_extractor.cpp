// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/orb_extractor.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "vip_slam_core/geometry/angle.h"

namespace vip_slam {

namespace {

constexpr int kPatch = 31;

/// Direction from the centre to the grey-value centroid of the disc around it.
float orientation(const cv::Mat& gray, float x, float y) {
  const int radius = kPatch / 2, cx = cvRound(x), cy = cvRound(y);
  long mx = 0, my = 0;
  for (int dy = -radius; dy <= radius; ++dy) {
    const int v = cv::borderInterpolate(cy + dy, gray.rows, cv::BORDER_REFLECT_101);
    const std::uint8_t* row = gray.ptr<std::uint8_t>(v);
    const int half = static_cast<int>(std::sqrt(static_cast<double>(radius * radius - dy * dy)));
    const bool inside = cx - half >= 0 && cx + half < gray.cols;
    for (int dx = -half; dx <= half; ++dx) {
      const int u = inside ? cx + dx : cv::borderInterpolate(cx + dx, gray.cols, cv::BORDER_REFLECT_101);
      mx += dx * row[u];
      my += dy * row[u];
    }
  }
  float degrees = static_cast<float>(std::atan2(static_cast<double>(my), static_cast<double>(mx)) / kDegree);
  return degrees < 0 ? degrees + 360.0f : degrees;
}

void store(const cv::Mat& row, Feature* feature) { std::memcpy(feature->descriptor.data(), row.data, 32); }

}  // namespace

OrbExtractor::OrbExtractor(int corners) : corners_(corners) {
  // Descriptors may reach over the image border: OpenCV mirrors the image there.
  describer_ = cv::ORB::create(10000, 1.2f, 1, 0, 0, 2, cv::ORB::FAST_SCORE, kPatch, 20);
  // Twice as many as wanted: the spreading below keeps the better ones.
  detector_ = cv::ORB::create(std::max(1, 2 * corners), static_cast<float>(kOctaveScale), 3, kPatch / 2 + 1, 0, 2,
                              cv::ORB::FAST_SCORE, kPatch, 8);
}

void OrbExtractor::describe(const cv::Mat& gray, std::vector<Feature>* features) const {
  std::vector<cv::KeyPoint> keypoints;
  keypoints.reserve(features->size());
  for (std::size_t i = 0; i < features->size(); ++i) {
    const Feature& f = (*features)[i];
    cv::KeyPoint k(f.pixel.x(), f.pixel.y(), kPatch, orientation(gray, f.pixel.x(), f.pixel.y()), 1.0f, 0,
                   static_cast<int>(i));
    keypoints.push_back(k);
  }
  if (keypoints.empty()) return;
  cv::Mat descriptors;
  describer_->compute(gray, keypoints, descriptors);
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    Feature& f = (*features)[keypoints[i].class_id];
    f.angle = static_cast<float>(keypoints[i].angle * kDegree);
    f.octave = 0;
    store(descriptors.row(static_cast<int>(i)), &f);
  }
}

std::vector<Feature> OrbExtractor::extract(const cv::Mat& gray, const std::vector<cv::Point2f>& occupied,
                                           double distance, const cv::Mat& mask) const {
  std::vector<Feature> result;
  if (corners_ == 0) return result;
  std::vector<cv::KeyPoint> keypoints;
  detector_->detect(gray, keypoints, mask);
  std::stable_sort(keypoints.begin(), keypoints.end(),
                   [](const cv::KeyPoint& a, const cv::KeyPoint& b) { return a.response > b.response; });
  // Even spread: at most a few per raster cell, and none close to a tracked feature.
  const int cell = 32, cols = gray.cols / cell + 1, rows = gray.rows / cell + 1;
  const int most = 2 + 2 * corners_ / (cols * rows);
  std::vector<int> count(static_cast<std::size_t>(cols) * rows, 0);
  const double distance2 = distance * distance;
  std::vector<cv::KeyPoint> kept;
  for (const cv::KeyPoint& k : keypoints) {
    if (static_cast<int>(kept.size()) >= corners_) break;
    int& here = count[static_cast<std::size_t>(k.pt.y / cell) * cols + static_cast<std::size_t>(k.pt.x / cell)];
    if (here >= most) continue;
    const bool beside = std::any_of(occupied.begin(), occupied.end(), [&](const cv::Point2f& p) {
      const double dx = p.x - k.pt.x, dy = p.y - k.pt.y;
      return dx * dx + dy * dy < distance2;
    });
    if (beside) continue;
    ++here;
    kept.push_back(k);
  }
  cv::Mat descriptors;
  detector_->compute(gray, kept, descriptors);
  result.reserve(kept.size());
  for (std::size_t i = 0; i < kept.size(); ++i) {
    Feature f;
    f.pixel = Eigen::Vector2f(kept[i].pt.x, kept[i].pt.y);
    f.angle = static_cast<float>(kept[i].angle * kDegree);
    f.octave = static_cast<std::uint8_t>(kept[i].octave);
    store(descriptors.row(static_cast<int>(i)), &f);
    result.push_back(f);
  }
  return result;
}

}  // namespace vip_slam
