// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/scene/procedural.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "vip_slam_sim/rng.h"

namespace vip_slam {
namespace {

cv::Scalar scalar(const cv::Vec3f& c) { return cv::Scalar(c[0], c[1], c[2]); }

cv::Vec3f randomColour(Rng& rng, double low, double high, double saturation) {
  const double v = rng.uniform(low, high);
  cv::Vec3f c;
  for (int k = 0; k < 3; ++k) c[k] = static_cast<float>(std::clamp(v + saturation * rng.uniform(-1, 1), 0.03, 0.97));
  return c;
}

/// Lines of "words": bars of varying length, like print seen from a distance.
void textBlock(cv::Mat& image, const cv::Rect& area, int line, const cv::Vec3f& ink, Rng& rng) {
  for (int y = area.y; y + line * 6 / 10 < area.y + area.height; y += line) {
    int x = area.x;
    const int end = area.x + static_cast<int>(area.width * rng.uniform(0.7, 1.0));
    while (x < end) {
      const int w = std::max(2, static_cast<int>(line * rng.uniform(0.6, 3.0)));
      const int right = std::min(x + w, end);
      for (int g = x; g < right;) {  // letters
        const int lw = std::max(1, static_cast<int>(line * rng.uniform(0.15, 0.4)));
        const int top = y + static_cast<int>(line * rng.uniform(0.0, 0.25));
        cv::rectangle(image, cv::Point(g, top), cv::Point(std::min(g + lw, right) - 1, y + line * 6 / 10), scalar(ink),
                      cv::FILLED);
        g += lw + std::max(1, line / 8);
      }
      x += w + line / 2;
    }
  }
}

void grain(cv::Mat& image, double sigma, Rng& rng) {
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      const float g = static_cast<float>(sigma * rng.gauss());
      image.at<cv::Vec3f>(y, x) += cv::Vec3f(g, g, g);
    }
}

}  // namespace

cv::Mat periodicNoise(int width, int height, int coarsest, double persistence, std::uint64_t seed) {
  Rng rng(seed);
  cv::Mat sum = cv::Mat::zeros(height, width, CV_32FC1);
  double amplitude = 1;
  for (int cell = coarsest; cell >= 2; cell /= 2, amplitude *= persistence) {
    const int gw = std::max(1, width / cell), gh = std::max(1, height / cell);
    cv::Mat grid(gh, gw, CV_32FC1);
    for (int y = 0; y < gh; ++y)
      for (int x = 0; x < gw; ++x) grid.at<float>(y, x) = static_cast<float>(amplitude * rng.gauss());
    cv::Mat tiled, big;
    cv::copyMakeBorder(grid, tiled, 2, 2, 2, 2, cv::BORDER_WRAP);
    cv::resize(tiled, big, cv::Size((gw + 4) * cell, (gh + 4) * cell), 0, 0, cv::INTER_CUBIC);
    sum += big(cv::Rect(2 * cell, 2 * cell, width, height));
  }
  cv::Scalar mean, stddev;
  cv::meanStdDev(sum, mean, stddev);
  return (sum - mean[0]) / std::max(1e-9, stddev[0]);
}

cv::Mat plaster(int size, const cv::Vec3f& colour, double contrast, std::uint64_t seed) {
  const cv::Mat noise = periodicNoise(size, size, size / 4, 0.75, seed);
  cv::Mat image(size, size, CV_32FC3);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      image.at<cv::Vec3f>(y, x) = colour * static_cast<float>(1 + contrast * noise.at<float>(y, x));
  return image;
}

cv::Mat tiles(int size, int tiles, const cv::Vec3f& colour, double speckle, double joint, double shade,
              std::uint64_t seed) {
  Rng rng(seed);
  const cv::Mat fine = periodicNoise(size, size, 8, 0.9, seed + 1);
  const int cell = size / tiles;
  std::vector<float> shades(tiles * tiles);
  for (float& s : shades) s = static_cast<float>(1 + shade * rng.gauss());
  cv::Mat image(size, size, CV_32FC3);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      const int inx = x % cell, iny = y % cell;
      const bool line = inx < 2 || iny < 2;
      const float s = shades[std::min(y / cell, tiles - 1) * tiles + std::min(x / cell, tiles - 1)];
      image.at<cv::Vec3f>(y, x) =
          colour * static_cast<float>((s + speckle * fine.at<float>(y, x)) * (line ? 1 - joint : 1));
    }
  return image;
}

cv::Mat wood(int size, const cv::Vec3f& colour, double contrast, std::uint64_t seed) {
  // Grain runs down the picture: noise stretched along y.
  const cv::Mat base = periodicNoise(size, std::max(4, size / 16), size / 8, 0.8, seed);
  cv::Mat stretched;
  cv::resize(base, stretched, cv::Size(size, size), 0, 0, cv::INTER_CUBIC);
  cv::Mat image(size, size, CV_32FC3);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      image.at<cv::Vec3f>(y, x) = colour * static_cast<float>(1 + contrast * stretched.at<float>(y, x));
  return image;
}

cv::Mat photograph(int width, int height, std::uint64_t seed) {
  Rng rng(seed);
  cv::Mat image(height, width, CV_32FC3);
  const cv::Vec3f sky = randomColour(rng, 0.6, 0.85, 0.15), ground = randomColour(rng, 0.25, 0.55, 0.2);
  const int horizon = static_cast<int>(height * rng.uniform(0.35, 0.65));
  for (int y = 0; y < height; ++y) {
    const cv::Vec3f base = y < horizon ? sky * (0.85f + 0.15f * y / std::max(1, horizon)) : ground;
    for (int x = 0; x < width; ++x) image.at<cv::Vec3f>(y, x) = base;
  }
  for (int i = 0; i < 14; ++i) {
    const cv::Vec3f c = randomColour(rng, 0.12, 0.85, 0.25);
    const cv::Point p(rng.integer(width), rng.integer(height));
    if (rng.uniform() < 0.5) {
      cv::ellipse(image, p, cv::Size(4 + rng.integer(width / 6), 4 + rng.integer(height / 6)), rng.uniform(0, 180), 0,
                  360, scalar(c), cv::FILLED, cv::LINE_AA);
    } else {
      std::vector<cv::Point> poly;
      for (int k = 0; k < 3 + rng.integer(3); ++k)
        poly.emplace_back(p.x + rng.integer(width / 3) - width / 6, p.y + rng.integer(height / 3) - height / 6);
      cv::fillPoly(image, std::vector<std::vector<cv::Point>>{poly}, scalar(c), cv::LINE_AA);
    }
  }
  cv::GaussianBlur(image, image, cv::Size(0, 0), 1.0);
  grain(image, 0.015, rng);
  return image;
}

cv::Mat poster(int width, int height, std::uint64_t seed) {
  Rng rng(seed);
  const bool light = rng.uniform() < 0.75;
  const cv::Vec3f paper = light ? randomColour(rng, 0.82, 0.92, 0.05) : randomColour(rng, 0.2, 0.5, 0.2);
  const cv::Vec3f ink = light ? randomColour(rng, 0.1, 0.3, 0.12) : cv::Vec3f(0.9f, 0.9f, 0.88f);
  cv::Mat image(height, width, CV_32FC3, scalar(paper));
  const int m = width / 14;
  const int title = height / 9;
  cv::rectangle(image, cv::Rect(0, 0, width, title), scalar(randomColour(rng, 0.2, 0.6, 0.25)), cv::FILLED);
  textBlock(image, cv::Rect(m, title / 4, width - 2 * m, title / 2), std::max(6, title / 2),
            cv::Vec3f(.93f, .93f, .93f), rng);
  const int picture = static_cast<int>(height * rng.uniform(0.25, 0.45));
  photograph(width - 2 * m, picture, seed * 7 + 3).copyTo(image(cv::Rect(m, title + m / 2, width - 2 * m, picture)));
  const int top = title + picture + m;
  const int columns = 1 + rng.integer(2);
  const int cw = (width - (columns + 1) * m) / columns;
  for (int c = 0; c < columns; ++c)
    textBlock(image, cv::Rect(m + c * (cw + m), top, cw, std::max(1, height - top - m)), std::max(6, height / 42), ink,
              rng);
  cv::rectangle(image, cv::Rect(0, 0, width, height), scalar(paper * 0.6f), 2);
  return image;
}

cv::Mat sign(int width, int height, const std::string& text, const cv::Vec3f& paper, const cv::Vec3f& ink) {
  cv::Mat image(height, width, CV_32FC3, scalar(paper));
  int baseline = 0;
  const cv::Size unit = cv::getTextSize(text, cv::FONT_HERSHEY_DUPLEX, 1.0, 1, &baseline);
  const double scale = std::min(0.8 * width / unit.width, 0.6 * height / unit.height);
  const cv::Point at(static_cast<int>((width - unit.width * scale) / 2),
                     static_cast<int>((height + unit.height * scale) / 2));
  cv::Mat bytes(height, width, CV_8UC1, cv::Scalar(0));
  cv::putText(bytes, text, at, cv::FONT_HERSHEY_DUPLEX, scale, cv::Scalar(255), std::max(1, int(scale * 2)),
              cv::LINE_AA);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float a = bytes.at<unsigned char>(y, x) / 255.f;
      image.at<cv::Vec3f>(y, x) = paper * (1 - a) + ink * a;
    }
  cv::rectangle(image, cv::Rect(0, 0, width, height), scalar(ink * 0.8f), std::max(1, height / 40));
  return image;
}

cv::Mat bookshelf(int width, int height, int shelves, std::uint64_t seed) {
  Rng rng(seed);
  cv::Mat image(height, width, CV_32FC3, cv::Scalar(0.22, 0.20, 0.18));
  const int row = height / shelves, board = std::max(3, row / 12);
  for (int s = 0; s < shelves; ++s) {
    const int bottom = (s + 1) * row - board;
    cv::rectangle(image, cv::Rect(0, bottom, width, board), cv::Scalar(0.62, 0.55, 0.47), cv::FILLED);
    int x = 4;
    while (x < width - 6) {
      if (rng.uniform() < 0.08) {
        x += static_cast<int>(row * rng.uniform(0.2, 0.8));
        continue;
      }
      const int w = std::max(4, static_cast<int>(row * rng.uniform(0.06, 0.22)));
      const int h = static_cast<int>((row - board) * rng.uniform(0.6, 0.92));
      const cv::Rect spine(x, bottom - h, std::min(w, width - 5 - x), h);
      if (spine.width < 3) break;
      const cv::Vec3f c = randomColour(rng, 0.2, 0.85, 0.28);
      cv::rectangle(image, spine, scalar(c), cv::FILLED);
      const int label = spine.y + static_cast<int>(h * rng.uniform(0.1, 0.4));
      cv::rectangle(image, cv::Rect(spine.x + 1, label, std::max(1, spine.width - 2), std::max(3, h / 5)),
                    scalar(randomColour(rng, 0.3, 0.95, 0.1)), cv::FILLED);
      cv::line(image, spine.tl(), cv::Point(spine.x, bottom), scalar(c * 0.4f), 1);
      x += w;
    }
  }
  return image;
}

cv::Mat screen(int width, int height, std::uint64_t seed) {
  Rng rng(seed);
  cv::Mat image(height, width, CV_32FC3, cv::Scalar(0.08, 0.08, 0.09));
  const int m = std::max(3, width / 40);
  const cv::Rect inner(m, m, width - 2 * m, height - 2 * m);
  cv::rectangle(image, inner, scalar(randomColour(rng, 0.25, 0.5, 0.15)), cv::FILLED);
  for (int i = 0; i < 3; ++i) {
    const cv::Rect w = cv::Rect(inner.x + rng.integer(inner.width / 2), inner.y + rng.integer(inner.height / 2),
                                inner.width / 2, inner.height / 2) &
                       inner;
    const bool dark = rng.uniform() < 0.5;
    cv::rectangle(image, w, dark ? cv::Scalar(0.15, 0.16, 0.2) : cv::Scalar(0.85, 0.85, 0.86), cv::FILLED);
    cv::rectangle(image, cv::Rect(w.x, w.y, w.width, std::max(3, height / 30)), cv::Scalar(0.4, 0.45, 0.6), cv::FILLED);
    textBlock(
        image,
        cv::Rect(w.x + m, w.y + height / 20 + m, std::max(1, w.width - 2 * m), std::max(1, w.height - height / 10)),
        std::max(6, height / 30), dark ? cv::Vec3f(.6f, .8f, .6f) : cv::Vec3f(.2f, .2f, .25f), rng);
  }
  return image;
}

cv::Mat blinds(int width, int height, std::uint64_t seed) {
  Rng rng(seed);
  cv::Mat image = photograph(width, height, seed + 5) * 0.35 + cv::Scalar(0.6, 0.6, 0.62);
  const int slat = std::max(6, height / 24);
  const int down = static_cast<int>(height * rng.uniform(0.2, 0.7));
  for (int y = 0; y < down; y += slat)
    cv::rectangle(image, cv::Rect(0, y, width, slat * 7 / 10), cv::Scalar(0.78, 0.78, 0.76), cv::FILLED);
  const int f = std::max(4, width / 30);
  cv::rectangle(image, cv::Rect(f / 2, f / 2, width - f, height - f), cv::Scalar(0.6, 0.6, 0.6), f);
  cv::line(image, cv::Point(width / 2, 0), cv::Point(width / 2, height), cv::Scalar(0.6, 0.6, 0.6), f);
  return image;
}

cv::Mat cardboard(int size, std::uint64_t seed) {
  Rng rng(seed);
  const cv::Vec3f brown(0.68f, 0.55f, 0.40f);
  cv::Mat image = wood(size, brown, 0.03, seed);
  cv::rectangle(image, cv::Rect(size * 44 / 100, 0, size * 12 / 100, size), cv::Scalar(0.76, 0.66, 0.50), cv::FILLED);
  const cv::Rect label(size / 10 + rng.integer(size / 8), size / 2 + rng.integer(size / 8), size / 3, size / 4);
  cv::rectangle(image, label, cv::Scalar(0.9, 0.9, 0.88), cv::FILLED);
  textBlock(image, cv::Rect(label.x + 4, label.y + 4, label.width - 8, label.height - 8), std::max(6, size / 26),
            cv::Vec3f(.15f, .15f, .15f), rng);
  for (int i = 0; i < 3; ++i)
    cv::circle(image, cv::Point(size * 3 / 4 + rng.integer(size / 8), size / 8 + i * size / 7), size / 26,
               cv::Scalar(0.2, 0.18, 0.16), -1, cv::LINE_AA);
  cv::rectangle(image, cv::Rect(0, 0, size, size), scalar(brown * 0.75f), std::max(2, size / 128));
  return image;
}

cv::Mat checkers(int size, int cells, const cv::Vec3f& a, const cv::Vec3f& b) {
  cv::Mat image(size, size, CV_32FC3);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) image.at<cv::Vec3f>(y, x) = ((x * cells / size + y * cells / size) & 1) ? a : b;
  return image;
}

}  // namespace vip_slam
