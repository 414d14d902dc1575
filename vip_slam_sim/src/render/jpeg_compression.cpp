// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/render/jpeg_compression.h"

#include <vector>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace vip_slam {

void JpegCompression::apply(cv::Mat* rgb) const {
  if (quality_ <= 0) return;
  cv::Mat bgr;
  cv::cvtColor(*rgb, bgr, cv::COLOR_RGB2BGR);
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", bgr, bytes, {cv::IMWRITE_JPEG_QUALITY, quality_});
  cv::cvtColor(cv::imdecode(bytes, cv::IMREAD_COLOR), *rgb, cv::COLOR_BGR2RGB);
}

}  // namespace vip_slam
