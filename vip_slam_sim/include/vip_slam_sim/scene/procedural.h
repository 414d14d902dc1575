// SPDX-License-Identifier: BSD-3-Clause
// Procedural pictures: walls, carpets, ceiling tiles, wood, posters, shelves of books. CV_32FC3 RGB, square root of
// reflectance, deterministic in the seed.
#pragma once

#include <cstdint>
#include <string>

#include <opencv2/core.hpp>

namespace vip_slam {

/// Periodic noise with octaves from `coarsest` pixels down to 2; zero mean, unit variance; CV_32FC1.
cv::Mat periodicNoise(int width, int height, int coarsest, double persistence, std::uint64_t seed);

/// Paint on plaster: colour with `contrast` (relative standard deviation, e.g. 0.01).
cv::Mat plaster(int size, const cv::Vec3f& colour, double contrast, std::uint64_t seed);
/// Carpet or ceiling tiles: `tiles` per side with faint joints and per-tile shade.
cv::Mat tiles(int size, int tiles, const cv::Vec3f& colour, double speckle, double joint, double shade,
              std::uint64_t seed);
cv::Mat wood(int size, const cv::Vec3f& colour, double contrast, std::uint64_t seed);
/// A printed page: title, text lines, picture, diagrams.
cv::Mat poster(int width, int height, std::uint64_t seed);
/// A label with words on it.
cv::Mat sign(int width, int height, const std::string& text, const cv::Vec3f& paper, const cv::Vec3f& ink);
/// Rows of book spines on shelves.
cv::Mat bookshelf(int width, int height, int shelves, std::uint64_t seed);
/// A photograph-like picture: soft blobs, edges, grain.
cv::Mat photograph(int width, int height, std::uint64_t seed);
/// A monitor, switched on, with windows of text.
cv::Mat screen(int width, int height, std::uint64_t seed);
/// Window with blinds, light outside.
cv::Mat blinds(int width, int height, std::uint64_t seed);
/// Cardboard box face with tape and a label.
cv::Mat cardboard(int size, std::uint64_t seed);
/// Regular checkers, `cells` per side.
cv::Mat checkers(int size, int cells, const cv::Vec3f& a, const cv::Vec3f& b);

}  // namespace vip_slam
