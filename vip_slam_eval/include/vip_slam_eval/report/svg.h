// SPDX-License-Identifier: BSD-3-Clause
// Pictures as SVG: a page of primitives, and axes with ticks, grid and labels that map data to the page.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace vip_slam {

struct SvgStyle {
  std::string stroke = "none", fill = "none";  ///< CSS colours
  double width = 1.0;                          ///< pixels
  double opacity = 1.0;
  std::string dash;  ///< "4 3"
};

enum class SvgAnchor { kStart, kMiddle, kEnd };

class SvgPage {
 public:
  SvgPage(double width, double height);
  void line(double x0, double y0, double x1, double y1, const SvgStyle& style);
  void rectangle(double x, double y, double width, double height, const SvgStyle& style);
  void circle(double x, double y, double radius, const SvgStyle& style);
  void polyline(const std::vector<Eigen::Vector2d>& points, const SvgStyle& style);
  /// Rings filled by the even-odd rule.
  void polygon(const std::vector<std::vector<Eigen::Vector2d>>& rings, const SvgStyle& style);
  void text(double x, double y, const std::string& text, double size, SvgAnchor anchor = SvgAnchor::kStart,
            const std::string& colour = "#333", bool bold = false, double turn_degrees = 0);
  /// Defines a clip rectangle and returns its id for beginClip().
  int addClip(double x, double y, double width, double height);
  /// Everything until endClip() is clipped to the rectangle.
  void beginClip(int clip);
  void endClip();
  std::string str() const;

 private:
  double width_, height_;
  int clips_ = 0;
  std::string body_;
};

/// Axes in a rectangle of the page.
class SvgAxes {
 public:
  SvgAxes(SvgPage* page, double x, double y, double width, double height);
  /// Sets the data range; `equal` widens one axis so that both have the same scale.
  void range(double x0, double x1, double y0, double y1, bool equal = false);
  /// Frame, grid, ticks, title and axis labels.
  void draw(const std::string& title, const std::string& x_label, const std::string& y_label);
  Eigen::Vector2d map(const Eigen::Vector2d& p) const;
  void polyline(const std::vector<Eigen::Vector2d>& points, const SvgStyle& style);
  void polygon(const std::vector<std::vector<Eigen::Vector2d>>& rings, const SvgStyle& style);
  double x0() const { return x0_; }
  double x1() const { return x1_; }
  double y0() const { return y0_; }
  double y1() const { return y1_; }

 private:
  SvgPage* page_;
  double left_, top_, width_, height_;
  int clip_;
  double x0_ = 0, x1_ = 1, y0_ = 0, y1_ = 1;
};

/// A step of 1, 2 or 5 times a power of ten that divides `span` into about `count` parts.
double niceStep(double span, int count);
/// Dark blue (0) over green to yellow (1): readable in greyscale and with colour blindness.
std::string colourScale(double s);

}  // namespace vip_slam
