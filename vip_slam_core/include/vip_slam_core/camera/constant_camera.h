// SPDX-License-Identifier: BSD-3-Clause
// Images of a camera whose focal length changes from image to image (autofocus), as a camera with one constant K sees
// them: nothing behind has to know. The same step makes them smaller. Pinhole to pinhole, without distortion: a scale
// and a shift.
#pragma once

#include <opencv2/core.hpp>

#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {

/// `image` (8-bit, any channels), taken with `from`, as `to` sees it. Averages over pixels where it shrinks; beyond the
/// border the nearest pixel goes on, since an edge that breathes with the focus would be tracked. Equal cameras up to
/// their size: a plain resize. Throws std::invalid_argument when a camera is unusable, has distortion, or `image` is
/// not of the size of `from`.
cv::Mat warpColor(const cv::Mat& image, const CameraIntrinsics& from, const CameraIntrinsics& to);

/// The same of a depth image (16UC1 or 32FC1, 0 = invalid): the nearest reading, never a mixture of two; 0 beyond the
/// border. Depth along the optical axis is the same in both.
cv::Mat warpDepth(const cv::Mat& depth, const CameraIntrinsics& from, const CameraIntrinsics& to);

}  // namespace vip_slam
