// SPDX-License-Identifier: BSD-3-Clause
// Folders of real RGB-D images with poses: 7-Scenes layout (frame-N.color.*, frame-N.depth.png, frame-N.pose.txt,
// camera-intrinsics.txt) or TUM layout (rgb.txt, depth.txt, groundtruth.txt).
// In the 7-Scenes layout intrinsics and poses are those of the depth camera, and the folder does not calibrate the
// colour camera, a separate one: it gets what was measured on that data set's frames.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/depth/depth_factor.h"
#include "vip_slam_core/trajectory/tum_io.h"

namespace vip_slam {

struct RgbdFrame {
  double t = 0;        ///< of the colour image, s
  double t_depth = 0;  ///< s
  std::string colour, depth;
};

struct RgbdFolder {
  std::vector<RgbdFrame> frames;
  Trajectory T_W_C;               ///< colour camera, in the folder's own world
  CameraIntrinsics camera;        ///< colour; width and height from the first image; focal lengths 0: not in the folder
  bool depth_registered = true;   ///< depth pixels belong to the colour camera
  CameraIntrinsics depth_camera;  ///< only when not registered
  SE3 T_color_depth;              ///< only when not registered; else identity
  double colour_readout = 0;      ///< s, of a rolling shutter, from first to last row; the stamp is the middle row's
  double depth_scale = 0.001;     ///< metres in one unit of the depth images
  std::optional<DepthFactor> depth_guess;  ///< how depth_scale was found, where it was neither given nor the layout's
};

/// Colour and depth images, by their ascending stamps in seconds, as pairs (index, index): each image once at most,
/// both in order, within `tolerance`, with the least sum of squared differences; a colour image that stays alone counts
/// like a pair at the tolerance.
std::vector<std::pair<std::size_t, std::size_t>> pairInOrder(const std::vector<double>& colour,
                                                             const std::vector<double>& depth, double tolerance);

/// `rate`: images per second where the folder has no stamps. `registered`: a folder in 7-Scenes layout whose depth was
/// registered to the colour camera. `depth_factor`: units per metre; 0: in 7-Scenes layout millimetres, in TUM layout
/// as the images tell. Throws std::runtime_error naming the file (and line).
RgbdFolder openRgbdFolder(const std::string& folder, double rate, bool registered = false, double depth_factor = 0);

/// RGB image and depth in 16UC1 millimetres (0 = invalid). Throws std::runtime_error naming the file.
void loadRgbdFrame(const RgbdFolder& folder, const RgbdFrame& frame, cv::Mat* rgb, cv::Mat* depth_mm);

/// Up direction in the folder's world, from floors and walls: the direction that depth image normals near the cameras'
/// mean up direction are parallel to and those near the horizon perpendicular to. Throws std::runtime_error when there
/// are too few such normals or the cameras' up directions disagree.
Eigen::Vector3d upFromDepth(const RgbdFolder& folder);

}  // namespace vip_slam
