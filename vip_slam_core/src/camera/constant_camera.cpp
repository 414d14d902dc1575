// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_core/camera/constant_camera.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

#include "vip_slam_core/util/size_text.h"

namespace vip_slam {
namespace {

void check(const cv::Mat& image, const CameraIntrinsics& from, const CameraIntrinsics& to) {
  for (const CameraIntrinsics* camera : {&from, &to}) {
    const std::string wrong = camera->validate();
    if (!wrong.empty()) throw std::invalid_argument("camera: " + wrong);
    if (camera->model != DistortionModel::kNone)
      throw std::invalid_argument("camera: has distortion, expected a pinhole without");
  }
  if (image.cols != from.width || image.rows != from.height)
    throw std::invalid_argument("image of " + sizeText(image.size()) + ", its camera is of " +
                                sizeText({from.width, from.height}));
}

/// Pixel of `from` at pixel 0 of `to`, and pixels of `from` per pixel of `to`.
struct Axis {
  double offset, scale;
  Axis(double f_from, double c_from, double f_to, double c_to)
      : offset(c_from - c_to * f_from / f_to), scale(f_from / f_to) {}
};

}  // namespace

cv::Mat warpColor(const cv::Mat& image, const CameraIntrinsics& from, const CameraIntrinsics& to) {
  check(image, from, to);
  // Where it shrinks, first to the whole number of pixels nearest to the wanted scale, with averaging; what is left is
  // a shift and less than a pixel over the width.
  cv::Mat source = image;
  CameraIntrinsics middle = from;
  const int width = static_cast<int>(std::lround(from.width * to.fx / from.fx));
  const int height = static_cast<int>(std::lround(from.height * to.fy / from.fy));
  if (width < from.width && height < from.height && width > 0 && height > 0) {
    middle = from.scaled(width, height);
    cv::resize(image, source, {width, height}, 0, 0, cv::INTER_AREA);
  }
  const Axis x(middle.fx, middle.cx, to.fx, to.cx), y(middle.fy, middle.cy, to.fy, to.cy);
  constexpr double kNothing = 1e-3;  // pixels
  const bool same_size = middle.width == to.width && middle.height == to.height;
  if (same_size && std::abs(x.offset) < kNothing && std::abs(y.offset) < kNothing &&
      std::abs(x.scale - 1) * to.width < kNothing && std::abs(y.scale - 1) * to.height < kNothing)
    return source.data == image.data ? image.clone() : source;
  const cv::Matx23d map(x.scale, 0, x.offset, 0, y.scale, y.offset);
  cv::Mat out;
  cv::warpAffine(source, out, map, {to.width, to.height}, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                 cv::BORDER_REPLICATE);
  return out;
}

cv::Mat warpDepth(const cv::Mat& depth, const CameraIntrinsics& from, const CameraIntrinsics& to) {
  if (depth.type() != CV_16UC1 && depth.type() != CV_32FC1)
    throw std::invalid_argument("depth image: expected 16UC1 or 32FC1");
  check(depth, from, to);
  const Axis x(from.fx, from.cx, to.fx, to.cx), y(from.fy, from.cy, to.fy, to.cy);
  std::vector<int> columns(to.width);
  for (int u = 0; u < to.width; ++u) {
    const double source = std::round(x.offset + x.scale * u);
    columns[u] = source >= 0 && source < from.width ? static_cast<int>(source) : -1;
  }
  cv::Mat out = cv::Mat::zeros(to.height, to.width, depth.type());
  const std::size_t bytes = depth.elemSize();
  for (int v = 0; v < to.height; ++v) {
    const double row = std::round(y.offset + y.scale * v);
    if (!(row >= 0 && row < from.height)) continue;
    const uchar* source = depth.ptr(static_cast<int>(row));
    uchar* target = out.ptr(v);
    for (int u = 0; u < to.width; ++u)
      if (columns[u] >= 0) std::copy_n(source + columns[u] * bytes, bytes, target + u * bytes);
  }
  return out;
}

}  // namespace vip_slam
