// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/report/svg.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <locale>
#include <sstream>

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

// One decimal (a tenth of a pixel) is enough and keeps the files small.
std::string pixel(double value) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << std::fixed << std::setprecision(1) << value;
  return out.str();
}

std::string number(double value) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << value;
  return out.str();
}

// With as many decimals as are needed to distinguish neighbouring ticks.
std::string tickLabel(double value, double step) {
  if (std::abs(value) < 1e-9 * step) return "0";
  const int decimals = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << std::fixed << std::setprecision(decimals) << value;
  return out.str();
}

std::string attributes(const SvgStyle& style) {
  std::string text = " fill=\"" + style.fill + "\"";
  if (style.stroke != "none") {
    text += " stroke=\"" + style.stroke + "\" stroke-width=\"" + number(style.width) + "\"";
    if (!style.dash.empty()) text += " stroke-dasharray=\"" + style.dash + "\"";
  }
  if (style.opacity < 1.0) text += " opacity=\"" + number(style.opacity) + "\"";
  return text;
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else
      result += c;
  }
  return result;
}

std::string pointsText(const std::vector<Eigen::Vector2d>& points) {
  std::string text;
  for (const Eigen::Vector2d& p : points) text += (text.empty() ? "" : " ") + pixel(p.x()) + "," + pixel(p.y());
  return text;
}

}  // namespace

SvgPage::SvgPage(double width, double height) : width_(width), height_(height) {}

void SvgPage::line(double x0, double y0, double x1, double y1, const SvgStyle& style) {
  body_ += "<line x1=\"" + pixel(x0) + "\" y1=\"" + pixel(y0) + "\" x2=\"" + pixel(x1) + "\" y2=\"" + pixel(y1) + "\"" +
           attributes(style) + "/>\n";
}

void SvgPage::rectangle(double x, double y, double width, double height, const SvgStyle& style) {
  body_ += "<rect x=\"" + pixel(x) + "\" y=\"" + pixel(y) + "\" width=\"" + pixel(width) + "\" height=\"" +
           pixel(height) + "\"" + attributes(style) + "/>\n";
}

void SvgPage::circle(double x, double y, double radius, const SvgStyle& style) {
  body_ += "<circle cx=\"" + pixel(x) + "\" cy=\"" + pixel(y) + "\" r=\"" + pixel(radius) + "\"" + attributes(style) +
           "/>\n";
}

void SvgPage::polyline(const std::vector<Eigen::Vector2d>& points, const SvgStyle& style) {
  if (points.size() < 2) return;
  body_ += "<polyline stroke-linejoin=\"round\" stroke-linecap=\"round\" points=\"" + pointsText(points) + "\"" +
           attributes(style) + "/>\n";
}

void SvgPage::polygon(const std::vector<std::vector<Eigen::Vector2d>>& rings, const SvgStyle& style) {
  std::string path;
  for (const auto& ring : rings) {
    if (ring.size() >= 2) path += "M" + pointsText(ring) + "Z";
  }
  if (!path.empty()) body_ += "<path fill-rule=\"evenodd\" d=\"" + path + "\"" + attributes(style) + "/>\n";
}

void SvgPage::text(double x, double y, const std::string& text, double size, SvgAnchor anchor,
                   const std::string& colour, bool bold, double turn_degrees) {
  const char* anchors[] = {"start", "middle", "end"};
  body_ += "<text x=\"" + pixel(x) + "\" y=\"" + pixel(y) + "\" font-size=\"" + number(size) + "\" fill=\"" + colour +
           "\" text-anchor=\"" + anchors[static_cast<int>(anchor)] + "\"";
  if (bold) body_ += " font-weight=\"bold\"";
  if (turn_degrees != 0) {
    body_ += " transform=\"rotate(" + number(turn_degrees) + " " + pixel(x) + " " + pixel(y) + ")\"";
  }
  body_ += ">" + escaped(text) + "</text>\n";
}

int SvgPage::addClip(double x, double y, double width, double height) {
  body_ += "<clipPath id=\"clip" + std::to_string(++clips_) + "\"><rect x=\"" + pixel(x) + "\" y=\"" + pixel(y) +
           "\" width=\"" + pixel(width) + "\" height=\"" + pixel(height) + "\"/></clipPath>\n";
  return clips_;
}

void SvgPage::beginClip(int clip) { body_ += "<g clip-path=\"url(#clip" + std::to_string(clip) + ")\">\n"; }

void SvgPage::endClip() { body_ += "</g>\n"; }

std::string SvgPage::str() const {
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + number(width_) + " " + number(height_) +
         "\" width=\"" + number(width_) + "\" height=\"" + number(height_) +
         "\" font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\">\n"
         "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n" +
         body_ + "</svg>\n";
}

SvgAxes::SvgAxes(SvgPage* page, double x, double y, double width, double height)
    : page_(page), left_(x), top_(y), width_(width), height_(height), clip_(page->addClip(x, y, width, height)) {}

void SvgAxes::range(double x0, double x1, double y0, double y1, bool equal) {
  const auto widen = [](double* low, double* high, double by) {
    *low -= 0.5 * by;
    *high += 0.5 * by;
  };
  if (!(x1 > x0)) widen(&x0, &x1, 1.0);
  if (!(y1 > y0)) widen(&y0, &y1, 1.0);
  if (equal) {
    const double per_pixel = std::max((x1 - x0) / width_, (y1 - y0) / height_);
    widen(&x0, &x1, per_pixel * width_ - (x1 - x0));
    widen(&y0, &y1, per_pixel * height_ - (y1 - y0));
  }
  x0_ = x0, x1_ = x1, y0_ = y0, y1_ = y1;
}

Eigen::Vector2d SvgAxes::map(const Eigen::Vector2d& p) const {
  return {left_ + (p.x() - x0_) / (x1_ - x0_) * width_, top_ + (y1_ - p.y()) / (y1_ - y0_) * height_};
}

void SvgAxes::draw(const std::string& title, const std::string& x_label, const std::string& y_label) {
  const SvgStyle grid{"#e4e4e4", "none", 1.0, 1.0, ""};
  const double x_step = niceStep(x1_ - x0_, std::max(3, static_cast<int>(width_ / 90)));
  for (double x = std::ceil(x0_ / x_step) * x_step; x <= x1_ + 1e-9 * x_step; x += x_step) {
    const double at = map({x, y0_}).x();
    page_->line(at, top_, at, top_ + height_, grid);
    page_->text(at, top_ + height_ + 16, tickLabel(x, x_step), 11, SvgAnchor::kMiddle);
  }
  const double y_step = niceStep(y1_ - y0_, std::max(3, static_cast<int>(height_ / 45)));
  for (double y = std::ceil(y0_ / y_step) * y_step; y <= y1_ + 1e-9 * y_step; y += y_step) {
    const double at = map({x0_, y}).y();
    page_->line(left_, at, left_ + width_, at, grid);
    page_->text(left_ - 6, at + 4, tickLabel(y, y_step), 11, SvgAnchor::kEnd);
  }
  page_->rectangle(left_, top_, width_, height_, {"#888", "none", 1.0, 1.0, ""});
  page_->text(left_, top_ - 8, title, 14, SvgAnchor::kStart, "#222", true);
  page_->text(left_ + width_ / 2, top_ + height_ + 33, x_label, 12, SvgAnchor::kMiddle);
  page_->text(left_ - 48, top_ + height_ / 2, y_label, 12, SvgAnchor::kMiddle, "#333", false, -90);
}

void SvgAxes::polyline(const std::vector<Eigen::Vector2d>& points, const SvgStyle& style) {
  std::vector<Eigen::Vector2d> mapped;
  for (const Eigen::Vector2d& p : points) mapped.push_back(map(p));
  page_->beginClip(clip_);
  page_->polyline(mapped, style);
  page_->endClip();
}

void SvgAxes::polygon(const std::vector<std::vector<Eigen::Vector2d>>& rings, const SvgStyle& style) {
  std::vector<std::vector<Eigen::Vector2d>> mapped;
  for (const auto& ring : rings) {
    mapped.emplace_back();
    for (const Eigen::Vector2d& p : ring) mapped.back().push_back(map(p));
  }
  page_->beginClip(clip_);
  page_->polygon(mapped, style);
  page_->endClip();
}

double niceStep(double span, int count) {
  const double rough = span / std::max(1, count);
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= rough) return factor * power;
  }
  return 10.0 * power;
}

std::string colourScale(double s) {
  static constexpr std::array<std::array<double, 3>, 5> kStops = {
      {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {243, 200, 30}}};
  const double x = std::clamp(s, 0.0, 1.0) * (kStops.size() - 1);
  const std::size_t k = std::min<std::size_t>(static_cast<std::size_t>(x), kStops.size() - 2);
  int rgb[3];
  for (int c = 0; c < 3; ++c)
    rgb[c] = static_cast<int>(kStops[k][c] + (x - k) * (kStops[k + 1][c] - kStops[k][c]) + 0.5);
  return formatted("#%02x%02x%02x", rgb[0] & 255, rgb[1] & 255, rgb[2] & 255);
}

}  // namespace vip_slam
