// SPDX-License-Identifier: BSD-3-Clause
// ORB descriptors at given pixels, and further ORB corners for keyframes. Rotation by the intensity centroid.
#pragma once

#include <vector>

#include <opencv2/features2d.hpp>

#include "vip_slam_core/types/feature.h"

namespace vip_slam {

class OrbExtractor {
 public:
  explicit OrbExtractor(int corners);

  /// Fills angle and descriptor (level 0) of features whose pixel is set.
  void describe(const cv::Mat& gray, std::vector<Feature>* features) const;
  /// Up to the constructor's number of multi-scale ORB corners, spread evenly, with pixel, octave, angle and
  /// descriptor; id is kNoLandmark. Corners within `distance` px of `occupied` are left out, and
  /// those where `mask` is zero (empty: none).
  std::vector<Feature> extract(const cv::Mat& gray, const std::vector<cv::Point2f>& occupied, double distance,
                               const cv::Mat& mask = cv::Mat()) const;

 private:
  int corners_;
  cv::Ptr<cv::ORB> describer_, detector_;
};

}  // namespace vip_slam
