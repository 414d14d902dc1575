// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/preflight/image_rotation.h"

#include <algorithm>

#include <Eigen/SVD>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/statistics.h"

namespace vip_slam {
namespace {

constexpr std::size_t kMinCorners = 15;
constexpr int kMaxColumns = 800;  // of the image in which corners are followed

/// Rotation with to ~ R from, by Kabsch with two rounds of trimming.
std::optional<Eigen::Matrix3d> alignBearings(const std::vector<Eigen::Vector3d>& from,
                                             const std::vector<Eigen::Vector3d>& to) {
  std::vector<bool> use(from.size(), true);
  Eigen::Matrix3d R;
  for (int round = 0; round < 3; ++round) {
    Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();
    std::size_t n = 0;
    for (std::size_t i = 0; i < from.size(); ++i) {
      if (!use[i]) continue;
      cross += to[i] * from[i].transpose();
      ++n;
    }
    if (n < kMinCorners) return std::nullopt;
    R = nearestRotation(cross);
    std::vector<double> errors;
    for (std::size_t i = 0; i < from.size(); ++i) errors.push_back((to[i] - R * from[i]).norm());
    const double limit = 2.5 * upperMedian(errors) + 1e-9;
    for (std::size_t i = 0; i < from.size(); ++i) use[i] = errors[i] <= limit;
  }
  return R;
}

/// Camera motion from 3D points of the first image and their projections in the second, in normalised coordinates:
/// RANSAC, then refinement with the tracks that agree within 2.5 times the median error of all. A fixed threshold would
/// keep tracks with errors of a pixel or two, and a few of those bias a least-squares fit by more than all the good
/// ones improve it. `pixel`: size of a pixel in these coordinates.
std::optional<SE3> motionByPnp(const std::vector<cv::Point3f>& points, const std::vector<cv::Point2f>& images,
                               double pixel) {
  const cv::Matx33d K = cv::Matx33d::eye();
  cv::Mat r, t, inliers;
  if (!cv::solvePnPRansac(points, images, K, cv::noArray(), r, t, false, 60, static_cast<float>(2.0 * pixel), 0.99,
                          inliers, cv::SOLVEPNP_EPNP) ||
      inliers.rows < static_cast<int>(kMinCorners))
    return std::nullopt;
  std::vector<cv::Point3f> good_points;
  std::vector<cv::Point2f> good_images;
  for (int i = 0; i < inliers.rows; ++i) {
    good_points.push_back(points[inliers.at<int>(i)]);
    good_images.push_back(images[inliers.at<int>(i)]);
  }
  for (int round = 0; round < 3; ++round) {
    cv::solvePnPRefineLM(good_points, good_images, K, cv::noArray(), r, t);
    std::vector<cv::Point2f> projected;
    cv::projectPoints(points, r, t, K, cv::noArray(), projected);
    std::vector<double> errors;
    for (std::size_t i = 0; i < points.size(); ++i) errors.push_back(cv::norm(projected[i] - images[i]));
    const double limit = std::max(2.5 * upperMedian(errors), 0.02 * pixel);
    good_points.clear();
    good_images.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (errors[i] > limit) continue;
      good_points.push_back(points[i]);
      good_images.push_back(images[i]);
    }
  }
  cv::solvePnPRefineLM(good_points, good_images, K, cv::noArray(), r, t);
  return SE3(expSO3(Eigen::Vector3d(r.at<double>(0), r.at<double>(1), r.at<double>(2))),
             {t.at<double>(0), t.at<double>(1), t.at<double>(2)});
}

}  // namespace

std::optional<PixelStep> ImageRotation::add(double t, const cv::Mat& image) {
  // A large image is followed in a smaller one: its corners are as exact as those of a small camera.
  const int shrink = (image.cols + kMaxColumns - 1) / kMaxColumns;
  cv::Mat gray = image;
  if (shrink > 1) cv::resize(image, gray, image.size() / shrink, 0, 0, cv::INTER_AREA);
  const Eigen::Vector2f times(float(image.cols) / float(gray.cols), float(image.rows) / float(gray.rows));
  const auto inImage = [&](const cv::Point2f& p) {
    return Eigen::Vector2f((p.x + 0.5f) * times.x() - 0.5f, (p.y + 0.5f) * times.y() - 0.5f);
  };
  PixelStep step{t_, t, {}};
  if (!gray_.empty() && t > t_ && t - t_ < 0.2) {
    cv::Mat mask;
    if (mask_.size() == image.size()) cv::resize(mask_, mask, gray.size(), 0, 0, cv::INTER_NEAREST);
    std::vector<cv::Point2f> before, after;
    cv::goodFeaturesToTrack(gray_, before, 150, 0.01, gray_.cols / 32.0, mask);
    std::vector<unsigned char> found;
    std::vector<float> error;
    if (before.size() >= kMinCorners)
      cv::calcOpticalFlowPyrLK(gray_, gray, before, after, found, error, cv::Size(21, 21), 4);
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (!found[i]) continue;
      const Eigen::Vector2f from = inImage(before[i]);
      const int u = cvRound(from.x()), v = cvRound(from.y());
      const bool inside = u >= 0 && v >= 0 && u < depth_.cols && v < depth_.rows;
      const float z = inside ? depth_.at<float>(v, u) : 0;
      step.tracks.push_back({from, inImage(after[i]), z >= 0.1f && z <= 20.f ? z : 0.f});
    }
  }
  t_ = t;
  gray_ = gray;
  depth_ = cv::Mat();
  if (step.tracks.size() < kMinCorners) return std::nullopt;
  return step;
}

std::optional<RotationStep> seenBy(const CameraModel& camera, const PixelStep& step) {
  std::vector<Eigen::Vector3d> from, to;
  std::vector<cv::Point3f> points;
  std::vector<cv::Point2f> images;
  RotationStep out{step.t0, step.t1, Eigen::Vector3d::Zero(), {}, {}};
  for (const PixelTrack& track : step.tracks) {
    Eigen::Vector2d a, b;
    if (!camera.undistort(track.from.cast<double>(), &a) || !camera.undistort(track.to.cast<double>(), &b)) continue;
    from.push_back(a.homogeneous().normalized());
    to.push_back(b.homogeneous().normalized());
    if (!(track.z > 0)) continue;
    points.emplace_back(a.x() * track.z, a.y() * track.z, track.z);
    images.emplace_back(b.x(), b.y());
    const auto rowOf = [&](float y) { return (y + 0.5f) / static_cast<float>(camera.height()) - 0.5f; };
    out.tracks.push_back(
        {{points.back().x, points.back().y, track.z}, b.cast<float>(), rowOf(track.from.y()), rowOf(track.to.y())});
  }
  std::optional<Eigen::Matrix3d> R_now_before;
  if (points.size() >= kMinCorners) out.T_now_before = motionByPnp(points, images, 1.0 / camera.focal());
  if (out.T_now_before) R_now_before = out.T_now_before->R();
  if (!R_now_before) R_now_before = alignBearings(from, to);
  if (!R_now_before) return std::nullopt;
  // For a camera rotating by w dt the scene rotates by -w dt.
  out.rate_C = logSO3(Eigen::Matrix3d(R_now_before->transpose())) / (step.t1 - step.t0);
  return out;
}

}  // namespace vip_slam
