// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/stereo/stereo_depth.h"

#include <stdexcept>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "vip_slam_bringup/stereo/disparity_refinement.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/size_text.h"

namespace vip_slam {

struct StereoDepth::Maps {
  cv::Mat left_x, left_y, right_x, right_y;
};

namespace {

constexpr double kLeastBaseline = 1e-3;  // m

cv::Mat cameraMatrix(const CameraIntrinsics& c) {
  return (cv::Mat_<double>(3, 3) << c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1);
}

cv::Mat toCv(const Eigen::Matrix3d& m) {
  cv::Mat out(3, 3, CV_64F);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) out.at<double>(r, c) = m(r, c);
  return out;
}

cv::Mat distortionOf(const CameraIntrinsics& c) {
  const std::size_t least = c.model == DistortionModel::kEquidistant ? 4 : 5;
  cv::Mat out = cv::Mat::zeros(1, static_cast<int>(std::max(least, c.distortion.size())), CV_64F);
  if (c.model != DistortionModel::kNone)
    for (std::size_t i = 0; i < c.distortion.size(); ++i) out.at<double>(0, static_cast<int>(i)) = c.distortion[i];
  return out;
}

}  // namespace

StereoDepth::StereoDepth(const StereoCalibration& calibration, const StereoDepthOptions& options)
    : maps_(new Maps), options_(options), size_(calibration.left.width, calibration.left.height) {
  const CameraIntrinsics &left = calibration.left, &right = calibration.right;
  for (const auto* camera : {&left, &right}) {
    const std::string wrong = camera->validate();
    if (!wrong.empty()) throw std::invalid_argument("stereo calibration: " + wrong);
  }
  if (left.width != right.width || left.height != right.height)
    throw std::invalid_argument("stereo calibration: left is " + sizeText(size_) + ", right is " +
                                sizeText({right.width, right.height}) + ", expected equal sizes");
  if (left.model != right.model &&
      (left.model == DistortionModel::kEquidistant || right.model == DistortionModel::kEquidistant))
    throw std::invalid_argument("stereo calibration: left is " + distortionModelName(left.model) + ", right is " +
                                distortionModelName(right.model) + ", expected the same lens model");
  const SE3 T_right_left = calibration.T_left_right().inverse();
  const double apart = T_right_left.t().norm(), to_the_left = T_right_left.t().x();
  if (apart < kLeastBaseline)
    throw std::invalid_argument(
        formatted("stereo calibration: the two cameras are %g mm apart, expected at least %g mm", 1e3 * apart,
                  1e3 * kLeastBaseline));
  if (to_the_left > 0)
    throw std::invalid_argument(formatted(
        "stereo calibration: the right camera lies %.1f mm left of the left one; swap them", 1e3 * to_the_left));

  const cv::Mat K_left = cameraMatrix(left), K_right = cameraMatrix(right);
  const cv::Mat D_left = distortionOf(left), D_right = distortionOf(right);
  const cv::Mat R = toCv(T_right_left.R());
  const cv::Mat t = (cv::Mat_<double>(3, 1) << T_right_left.t().x(), T_right_left.t().y(), T_right_left.t().z());
  cv::Mat R1, R2, P1, P2, Q;
  if (left.model == DistortionModel::kEquidistant) {
    cv::fisheye::stereoRectify(K_left, D_left, K_right, D_right, size_, R, t, R1, R2, P1, P2, Q,
                               cv::CALIB_ZERO_DISPARITY, size_, 0.0, 1.0);
    cv::fisheye::initUndistortRectifyMap(K_left, D_left, R1, P1, size_, CV_32FC1, maps_->left_x, maps_->left_y);
    cv::fisheye::initUndistortRectifyMap(K_right, D_right, R2, P2, size_, CV_32FC1, maps_->right_x, maps_->right_y);
  } else {
    cv::stereoRectify(K_left, D_left, K_right, D_right, size_, R, t, R1, R2, P1, P2, Q, cv::CALIB_ZERO_DISPARITY, 0.0);
    cv::initUndistortRectifyMap(K_left, D_left, R1, P1, size_, CV_32FC1, maps_->left_x, maps_->left_y);
    cv::initUndistortRectifyMap(K_right, D_right, R2, P2, size_, CV_32FC1, maps_->right_x, maps_->right_y);
  }
  rectified_.width = size_.width;
  rectified_.height = size_.height;
  rectified_.fx = P1.at<double>(0, 0);
  rectified_.fy = P1.at<double>(1, 1);
  rectified_.cx = P1.at<double>(0, 2);
  rectified_.cy = P1.at<double>(1, 2);
  baseline_ = -P2.at<double>(0, 3) / P2.at<double>(0, 0);

  Eigen::Matrix3d R_rectified_left;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) R_rectified_left(r, c) = R1.at<double>(r, c);
  T_left_rectified_ = SE3(Eigen::Matrix3d(R_rectified_left.transpose()), Eigen::Vector3d::Zero());
  T_imu_rectified_ = calibration.T_imu_left * T_left_rectified_;
}

StereoDepth::~StereoDepth() = default;

StereoDepthFrame StereoDepth::compute(const cv::Mat& left, const cv::Mat& right) const {
  for (const cv::Mat* image : {&left, &right}) {
    if (image->type() != CV_8UC1)
      throw std::invalid_argument("stereo pair: an image is " + cv::typeToString(image->type()) +
                                  ", expected 8-bit grey");
    if (image->size() != size_)
      throw std::invalid_argument("stereo pair: an image is " + sizeText(image->size()) + ", calibrated for " +
                                  sizeText(size_));
  }
  StereoDepthFrame out;
  cv::Mat right_rectified;
  cv::remap(left, out.gray, maps_->left_x, maps_->left_y, cv::INTER_LINEAR);
  cv::remap(right, right_rectified, maps_->right_x, maps_->right_y, cv::INTER_LINEAR);

  const int disparities = (options_.num_disparities + 15) / 16 * 16;
  const int block = options_.block_size | 1;
  // The matcher keeps buffers between calls, so each call has its own: compute() is const and may run in parallel.
  // The smoothness weights are OpenCV's recommendation for one channel.
  const auto matcher = cv::StereoSGBM::create(0, disparities, block, 8 * block * block, 32 * block * block,
                                              options_.left_right_difference, 31, options_.uniqueness,
                                              options_.speckle_size, 2, cv::StereoSGBM::MODE_SGBM_3WAY);
  cv::Mat disparity;
  matcher->compute(out.gray, right_rectified, disparity);
  if (options_.refinement_window > 1)
    refineDisparity(out.gray, right_rectified, options_.refinement_window, &disparity);

  out.depth = cv::Mat::zeros(size_, CV_32FC1);
  const float numerator = static_cast<float>(16.0 * rectified_.fx * baseline_);  // disparity is in sixteenths
  const float nearest = static_cast<float>(options_.min_depth), farthest = static_cast<float>(options_.max_depth);
  for (int v = 0; v < size_.height; ++v) {
    const short* d = disparity.ptr<short>(v);
    float* z = out.depth.ptr<float>(v);
    for (int u = 0; u < size_.width; ++u) {
      if (d[u] <= 0) continue;
      const float depth = numerator / d[u];
      if (depth >= nearest && depth <= farthest) z[u] = depth;
    }
  }
  return out;
}

}  // namespace vip_slam
