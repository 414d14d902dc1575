// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/plot/line_plot.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

// A step of 1, 2 or 5 times a power of ten that gives about five ticks.
double tickStep(double range) {
  const double raw = range / 5, power = std::pow(10, std::floor(std::log10(raw)));
  for (const double m : {1.0, 2.0, 5.0})
    if (m * power >= raw) return m * power;
  return 10 * power;
}

void text(cv::Mat& image, const std::string& s, cv::Point at, double scale = 0.5) {
  cv::putText(image, s, at, cv::FONT_HERSHEY_SIMPLEX, scale, cv::Scalar(40, 40, 40), 1, cv::LINE_AA);
}

std::string number(double v) { return formatted("%g", v); }

}  // namespace

void writeLinePlot(const std::string& path, const std::string& title, const std::string& x_label,
                   const std::string& y_label, const std::vector<PlotSeries>& series) {
  const int width = 960, height = 600, left = 90, right = 220, top = 50, bottom = 70;
  cv::Mat image(height, width, CV_8UC3, cv::Scalar(255, 255, 255));
  double x_max = 1e-9, y_max = 1e-9;
  for (const PlotSeries& s : series)
    for (std::size_t k = 0; k < s.x.size(); ++k) {
      x_max = std::max(x_max, s.x[k]);
      y_max = std::max(y_max, s.y[k]);
    }
  y_max *= 1.05;
  const auto at = [&](double x, double y) {
    return cv::Point(left + static_cast<int>(std::lround(x / x_max * (width - left - right))),
                     height - bottom - static_cast<int>(std::lround(y / y_max * (height - top - bottom))));
  };
  for (double v = 0; v <= x_max * 1.0001; v += tickStep(x_max)) {
    cv::line(image, at(v, 0), at(v, y_max), cv::Scalar(225, 225, 225));
    text(image, number(v), at(v, 0) + cv::Point(-12, 22));
  }
  for (double v = 0; v <= y_max; v += tickStep(y_max)) {
    cv::line(image, at(0, v), at(x_max, v), cv::Scalar(225, 225, 225));
    text(image, number(v), at(0, v) + cv::Point(-60, 5));
  }
  cv::rectangle(image, at(0, y_max), at(x_max, 0), cv::Scalar(90, 90, 90));
  text(image, title, cv::Point(left, 30), 0.65);
  text(image, x_label, cv::Point((width - right) / 2, height - 20));
  text(image, y_label, cv::Point(8, top - 12));
  const cv::Scalar colours[] = {{180, 90, 20}, {30, 120, 230}, {60, 160, 60},
                                {60, 60, 210}, {160, 70, 150}, {120, 120, 120}};
  for (std::size_t k = 0; k < series.size(); ++k) {
    const cv::Scalar& colour = colours[k % 6];
    for (std::size_t i = 0; i < series[k].x.size(); ++i) {
      const cv::Point p = at(series[k].x[i], series[k].y[i]);
      cv::circle(image, p, 3, colour, cv::FILLED, cv::LINE_AA);
      if (i > 0) cv::line(image, at(series[k].x[i - 1], series[k].y[i - 1]), p, colour, 2, cv::LINE_AA);
    }
    const cv::Point legend(width - right + 15, top + 25 * static_cast<int>(k) + 10);
    cv::line(image, legend, legend + cv::Point(25, 0), colour, 2, cv::LINE_AA);
    text(image, series[k].name, legend + cv::Point(32, 5), 0.45);
  }
  if (!cv::imwrite(path, image)) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace vip_slam
