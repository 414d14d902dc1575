// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/plane_benchmark/plane_picture.h"

#include <cmath>
#include <string>

#include <opencv2/imgproc.hpp>

#include "vip_slam_eval/metrics/polygon_overlap.h"

namespace vip_slam {
namespace {

/// A plane, prepared for look-up by pixel ray.
struct Layer {
  Plane plane_C;
  Plane plane;
  FlatRegion region;
};

cv::Vec3b colourOf(const PlaneEstimate& plane) {
  if (plane.kind == PlaneKind::kHorizontal) {
    const int grey = 150 + int(plane.id * 37 % 5) * 22;
    return cv::Vec3b(grey, grey, grey);
  }
  const cv::Mat hsv(1, 1, CV_8UC3, cv::Scalar(double(plane.id * 67 % 180), 220, 255));
  cv::Mat bgr;
  cv::cvtColor(hsv, bgr, cv::COLOR_HSV2BGR);
  return bgr.at<cv::Vec3b>(0, 0);
}

/// Index of the plane whose area the ray hits first (where depth is known, one at that depth), -1: none.
int planeAt(const std::vector<Layer>& layers, const Eigen::Vector2d& xy, float measured, const SE3& T_map_C,
            const PlanePictureOptions& options) {
  const Eigen::Vector3d ray(xy.x(), xy.y(), 1.0);
  int best = -1;
  double nearest = 1e9;
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const double facing = layers[k].plane_C.n.dot(ray);
    if (facing > -1e-3) continue;  // from behind, or edge on
    const double z = -layers[k].plane_C.d / facing;
    if (z < 0.05 || z > nearest) continue;
    if (measured > 0 && std::abs(z - measured) > options.tolerance + 0.02 * measured) continue;
    if (!layers[k].region.contains(planeCoordinates(layers[k].plane, T_map_C * (z * ray)))) continue;
    nearest = z;
    best = static_cast<int>(k);
  }
  return best;
}

/// Dark borders between areas, and each plane's id in the middle of its area.
void annotate(const cv::Mat& index, const std::vector<PlaneEstimate>& planes, cv::Mat* picture) {
  for (int v = 0; v + 1 < index.rows; ++v) {
    for (int u = 0; u + 1 < index.cols; ++u) {
      const int k = index.at<int>(v, u);
      if (k != index.at<int>(v, u + 1) || k != index.at<int>(v + 1, u)) picture->at<cv::Vec3b>(v, u) = {0, 0, 0};
    }
  }
  for (std::size_t k = 0; k < planes.size(); ++k) {
    const cv::Mat mask = index == static_cast<int>(k);
    cv::Mat labels, statistics, centres;
    const int parts = cv::connectedComponentsWithStats(mask, labels, statistics, centres);
    int largest = 0;
    for (int i = 1; i < parts; ++i) {
      if (!largest || statistics.at<int>(i, cv::CC_STAT_AREA) > statistics.at<int>(largest, cv::CC_STAT_AREA))
        largest = i;
    }
    if (!largest || statistics.at<int>(largest, cv::CC_STAT_AREA) < 150) continue;
    const std::string text = std::to_string(planes[k].id);
    const cv::Point at(int(centres.at<double>(largest, 0)) - 8, int(centres.at<double>(largest, 1)) + 5);
    cv::putText(*picture, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.5, {0, 0, 0}, 3, cv::LINE_AA);
    cv::putText(*picture, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.5, {255, 255, 255}, 1, cv::LINE_AA);
  }
}

}  // namespace

cv::Mat drawPlanes(const cv::Mat& gray, const cv::Mat& depth, const CameraModel& camera, const SE3& T_map_C,
                   const std::vector<PlaneEstimate>& planes, const PlanePictureOptions& options) {
  std::vector<Layer> layers;
  for (const PlaneEstimate& plane : planes) {
    layers.push_back(
        {transformPlane(T_map_C.inverse(), plane.plane), plane.plane, FlatRegion(plane.polygons, plane.plane)});
  }
  const bool aligned = depth.size() == gray.size();  // else it has no reading for a pixel of the picture
  cv::Mat picture, index(gray.size(), CV_32SC1, cv::Scalar(-1));
  cv::cvtColor(gray, picture, cv::COLOR_GRAY2BGR);
  for (int v = 0; v < gray.rows; ++v) {
    for (int u = 0; u < gray.cols; ++u) {
      Eigen::Vector2d xy;
      if (!camera.undistort({double(u), double(v)}, &xy)) continue;
      const float z = aligned ? depth.at<float>(v, u) : 0.0f;
      const int k = planeAt(layers, xy, z, T_map_C, options);
      if (k < 0) continue;
      index.at<int>(v, u) = k;
      const cv::Vec3b colour = colourOf(planes[k]);
      cv::Vec3b& pixel = picture.at<cv::Vec3b>(v, u);
      for (int c = 0; c < 3; ++c) {
        pixel[c] = cv::saturate_cast<uchar>((1 - options.opacity) * pixel[c] + options.opacity * colour[c]);
      }
    }
  }
  annotate(index, planes, &picture);
  return picture;
}

}  // namespace vip_slam
