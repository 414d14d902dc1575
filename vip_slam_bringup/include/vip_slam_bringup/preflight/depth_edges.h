// SPDX-License-Identifier: BSD-3-Clause
// Registered depth whose pixels are not those of the colour image: some drivers align it to the colour camera without
// its lens. Where depth jumps, the image usually has an edge too; the two places where that can be differ by the
// lens's distortion.
#pragma once

#include <memory>

#include <opencv2/core.hpp>

#include "vip_slam_bringup/preflight/recording.h"
#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {

class DepthEdges {
 public:
  /// `colour`: the camera of the colour image, with its distortion.
  explicit DepthEdges(const CameraIntrinsics& colour);

  /// `grey`: 8UC1; `depth`: 32FC1 metres as published, at the same time. Images of another size are left out.
  void add(const cv::Mat& grey, const cv::Mat& depth);
  const DepthEdgeRecord& record() const { return record_; }

 private:
  cv::Mat distorted_;  ///< 32FC2: where a pixel of the camera without lens lies in the image; NaN where it hardly moves
  bool moves_ = false;  ///< whether any pixel does
  DepthEdgeRecord record_;
};

}  // namespace vip_slam
