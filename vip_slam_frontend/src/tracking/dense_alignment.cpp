// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/dense_alignment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <opencv2/imgproc.hpp>

#include "vip_slam_core/util/statistics.h"
#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam::frontend {

namespace {

constexpr std::array<int, 3> kWidths{40, 80, 160};  // px, of the levels
constexpr std::array<int, 3> kIterations{12, 8, 5};
constexpr double kLeastGrey = 2.0;  // one sigma of grey values: quantisation
// One sigma of the turn between two images, rad: keeps directions that the images leave open near the start, as
// kUsualMotion does for the displacement.
constexpr double kTurn = 0.2;
// Where less than this share of the pixels has depth, all show the rotation as those at infinity do. Otherwise they
// take no part: those of a near surface would turn a displacement into a turn.
constexpr double kFewWithDepth = 0.1;
constexpr double kConverged = 1e-4;    // rad and m, of a step
constexpr double kLargestGrey = 60.0;  // difference of grey values that counts
// Depth that differs by more belongs to another surface, sigmas; so does what a window of depth spans, as a share of
// it.
constexpr double kOtherSurface = 10.0, kSteepest = 0.15;
// The many pixels share errors: of depth by surfaces, of grey values by the lens, by light that moves with the camera
// and by blur. Each counts as if it had this many times its sigma.
constexpr double kSharedDepth = 4.0, kSharedGrey = 5.0;

/// Bilinear value and gradient; false outside.
bool lookUp(const cv::Mat& image, double u, double v, double* value, Eigen::RowVector2d* gradient) {
  const int x = static_cast<int>(std::floor(u)), y = static_cast<int>(std::floor(v));
  if (x < 0 || y < 0 || x + 1 >= image.cols || y + 1 >= image.rows) return false;
  const float *a = image.ptr<float>(y) + x, *b = image.ptr<float>(y + 1) + x;
  const double du = u - x, dv = v - y;
  const double top = a[0] + du * (a[1] - a[0]), bottom = b[0] + du * (b[1] - b[0]);
  *value = top + dv * (bottom - top);
  *gradient << (1 - dv) * (a[1] - a[0]) + dv * (b[1] - b[0]), bottom - top;
  return true;
}

/// Gradient of the depth image per pixel by least squares over a window; NaN where readings are missing or belong to
/// several surfaces. Differences of neighbours would be mostly noise, which looks like information on the motion.
cv::Mat depthSlopes(const cv::Mat& depth, const DepthNoise& noise, int reach) {
  const int side = 2 * reach + 1;
  cv::Mat across(1, side, CV_32F), ones = cv::Mat::ones(side, 1, CV_32F);
  for (int k = 0; k < side; ++k) across.at<float>(k) = static_cast<float>(k - reach);
  const double squares = side * cv::norm(across, cv::NORM_L2SQR);
  cv::Mat slope[2], slopes, least, largest;
  cv::sepFilter2D(depth, slope[0], CV_32F, across, ones.t(), {-1, -1}, 0, cv::BORDER_CONSTANT);
  cv::sepFilter2D(depth, slope[1], CV_32F, ones.t(), across, {-1, -1}, 0, cv::BORDER_CONSTANT);
  cv::merge(slope, 2, slopes);
  slopes /= squares;
  const cv::Mat window = cv::Mat::ones(side, side, CV_8U);
  // Outside of the image there is no reading.
  cv::erode(depth, least, window, {-1, -1}, 1, cv::BORDER_CONSTANT, cv::Scalar::all(0));
  cv::dilate(depth, largest, window);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      const float z = depth.at<float>(v, u), low = least.at<float>(v, u), high = largest.at<float>(v, u);
      const bool whole = noise.inRange(low) && noise.inRange(high) && std::max(high - z, z - low) < kSteepest * z;
      if (!whole) slopes.at<cv::Vec2f>(v, u) = cv::Vec2f::all(std::nanf(""));
    }
  }
  return slopes;
}

double huberWeight(double standardised) {
  const double e = std::abs(standardised);
  return e > 1.345 ? 1.345 / e : 1.0;
}

}  // namespace

/// Sums of the normal equations.
struct DenseAlignment::Normal {
  Matrix6d A = Matrix6d::Zero();  ///< upper triangle
  Vector6d b = Vector6d::Zero();

  /// Residual e in sigmas of a point `turned` by R and moved, and its derivative by the point's position. One at
  /// infinity does not move.
  void add(double e, const Eigen::Vector3d& turned, const Eigen::Vector3d& by_point, double weight, bool moves = true) {
    Vector6d J;
    J << turned.cross(by_point), moves ? by_point : Eigen::Vector3d(Eigen::Vector3d::Zero());
    A.selfadjointView<Eigen::Upper>().rankUpdate(J, weight);
    b += weight * e * J;
  }
};

DenseAlignment::DenseAlignment(std::shared_ptr<const CameraModel> camera, const DepthNoise& noise)
    : camera_(std::move(camera)), noise_(noise) {
  for (const int width : kWidths) {
    const cv::Size size(width, std::max(1, camera_->height() * width / camera_->width()));
    std::vector<Eigen::Vector2d> rays;
    rays.reserve(static_cast<std::size_t>(size.area()));
    const double scale = static_cast<double>(camera_->width()) / width;
    for (int v = 0; v < size.height; ++v) {
      for (int u = 0; u < size.width; ++u) {
        Eigen::Vector2d xy;
        if (!camera_->undistort({scale * (u + 0.5) - 0.5, scale * (v + 0.5) - 0.5}, &xy)) xy.setConstant(std::nan(""));
        rays.push_back(xy);
      }
    }
    sizes_.push_back(size);
    rays_.push_back(std::move(rays));
  }
}

std::vector<DenseAlignment::Level> DenseAlignment::pyramid(const cv::Mat& gray, const cv::Mat& depth) const {
  std::vector<Level> levels;
  for (const cv::Size& size : sizes_) {
    Level level;
    cv::Mat small;
    cv::resize(gray, small, size, 0, 0, cv::INTER_AREA);
    small.convertTo(level.gray, CV_32F);
    // Readings are taken, not averaged: a mean over an edge is no surface.
    if (!depth.empty()) cv::resize(depth, level.depth, size, 0, 0, cv::INTER_NEAREST);
    if (!depth.empty()) level.slopes = depthSlopes(level.depth, noise_, size.width / kWidths[0]);
    levels.push_back(level);
  }
  return levels;
}

void DenseAlignment::compareDepth(const Level& to, const Eigen::Vector3d& turned, const Eigen::Vector3d& t,
                                  double depth_share, Normal* normal) const {
  const Eigen::Vector3d p = turned + t;
  Eigen::Vector2d uv;
  Eigen::Matrix<double, 2, 3> J_project;
  if (!camera_->project(p, &uv, &J_project)) return;
  const double scale = static_cast<double>(camera_->width()) / to.depth.cols;
  uv = ((uv.array() + 0.5) / scale - 0.5).matrix();
  const int u = static_cast<int>(std::lround(uv.x())), v = static_cast<int>(std::lround(uv.y()));
  if (u < 0 || v < 0 || u >= to.depth.cols || v >= to.depth.rows) return;
  const cv::Vec2f& slopes = to.slopes.at<cv::Vec2f>(v, u);
  if (!std::isfinite(slopes[0])) return;
  const Eigen::RowVector2d slope(slopes[0], slopes[1]);
  const double there = to.depth.at<float>(v, u) + slope * (uv - Eigen::Vector2d(u, v));
  const double sigma = kSharedDepth * std::hypot(noise_.sigma(p.z()), noise_.bias_floor), e = (there - p.z()) / sigma;
  if (std::abs(e) > kOtherSurface) return;
  Eigen::Vector3d by_point = (depth_share / (scale * sigma)) * (slope * J_project).transpose();
  by_point.z() -= depth_share / sigma;
  normal->add(e, turned, by_point, huberWeight(e));
}

DenseAlignment::Fit DenseAlignment::align(const Level& from, const Level& to, int level, const SE3& start,
                                          double depth_share, int iterations) const {
  const std::vector<Eigen::Vector2d>& rays = rays_[static_cast<std::size_t>(level)];
  const double scale = static_cast<double>(camera_->width()) / from.gray.cols;
  // The finest level only sharpens: no more pixels than the one before has.
  const int stride = std::max(1, from.gray.cols / kWidths[1]);
  const bool far = from.depth.empty() || cv::countNonZero(from.depth) < kFewWithDepth * from.gray.total();
  Fit fit;
  fit.T_current_previous = start;
  // Common change of brightness, which is exposure and no motion, and one sigma of what is left, by the pass before.
  double shift = 0, grey = kLeastGrey;
  std::vector<float> differences;
  for (int iteration = -1; iteration <= iterations; ++iteration) {
    const bool only_grey = iteration < 0;  // the first pass
    differences.clear();
    Normal normal;
    double cost = 0;
    const Eigen::Matrix3d R = fit.T_current_previous.R();
    const Eigen::Vector3d t = fit.T_current_previous.t();
    // The motion until the depth image was read.
    const Eigen::Matrix3d R_depth = R * expSO3(Eigen::Vector3d((depth_share - 1) * logSO3(R)));
    const Eigen::Vector3d t_depth = depth_share * t;
    for (int v = 0; v < from.gray.rows; v += stride) {
      for (int u = 0; u < from.gray.cols; u += stride) {
        const Eigen::Vector2d& ray = rays[static_cast<std::size_t>(v * from.gray.cols + u)];
        if (!std::isfinite(ray.x())) continue;
        const float reading = from.depth.empty() ? 0.0f : from.depth.at<float>(v, u);
        const bool near = noise_.inRange(reading);
        if (!near && !far) continue;
        const double z = near ? reading : 1.0;
        const Eigen::Vector3d point(z * ray.x(), z * ray.y(), z), turned = R * point;
        const Eigen::Vector3d p = near ? Eigen::Vector3d(turned + t) : turned;
        Eigen::Vector2d uv;
        Eigen::Matrix<double, 2, 3> J_project;
        if (!camera_->project(p, &uv, &J_project)) continue;
        uv = ((uv.array() + 0.5) / scale - 0.5).matrix();
        double seen;
        Eigen::RowVector2d gradient;
        if (!lookUp(to.gray, uv.x(), uv.y(), &seen, &gradient)) continue;
        const double difference = seen - from.gray.at<float>(v, u), left = difference - shift;
        differences.push_back(static_cast<float>(difference));
        if (only_grey) continue;
        cost += std::min(std::abs(left), kLargestGrey);
        const double sigma = kSharedGrey * grey;
        const Eigen::Vector3d by_point = (gradient * J_project).transpose() / (scale * sigma);
        normal.add(left / sigma, turned, by_point, huberWeight(left / grey), near);
        if (near && !to.depth.empty()) compareDepth(to, R_depth * point, t_depth, depth_share, &normal);
      }
    }
    fit.used = static_cast<int>(differences.size());
    if (fit.used < kEnough) return fit;
    shift = upperMedian(differences);
    for (float& difference : differences) difference = std::abs(difference - static_cast<float>(shift));
    grey = std::max(kLeastGrey, 1.4826 * upperMedian(differences));
    if (only_grey) continue;
    fit.cost = cost / fit.used;
    fit.information = normal.A.selfadjointView<Eigen::Upper>();
    fit.information.diagonal().head<3>().array() += 1.0 / (kTurn * kTurn);
    fit.information.diagonal().tail<3>().array() += 1.0 / (kUsualMotion * kUsualMotion);
    if (iteration == iterations) break;
    const Vector6d step = fit.information.ldlt().solve(-normal.b);
    if (!step.allFinite()) break;
    const Eigen::Matrix3d turn = expSO3(Eigen::Vector3d(step.head<3>()));
    fit.T_current_previous = SE3(Eigen::Matrix3d(turn * R), t + step.tail<3>());
    if (step.cwiseAbs().maxCoeff() < kConverged) iteration = iterations - 1;
  }
  return fit;
}

std::optional<AlignedMotion> DenseAlignment::motion(const cv::Mat& gray_previous, const cv::Mat& depth_previous,
                                                    const cv::Mat& gray, const cv::Mat& depth, double depth_share,
                                                    const SE3& guess) const {
  if (gray_previous.empty() || gray.empty()) return std::nullopt;
  const std::vector<Level> then = pyramid(gray_previous, depth_previous), now = pyramid(gray, depth);
  Fit best;
  best.cost = std::numeric_limits<double>::infinity();
  for (const SE3& start : {guess, SE3()}) {
    const Fit fit = align(then[0], now[0], 0, start, depth_share, kIterations[0]);
    if (fit.used >= kEnough && fit.cost < best.cost) best = fit;
  }
  if (!std::isfinite(best.cost)) return std::nullopt;
  for (std::size_t level = 1; level < now.size(); ++level) {
    best = align(then[level], now[level], static_cast<int>(level), best.T_current_previous, depth_share,
                 kIterations[level]);
  }
  if (best.used < kEnough || !best.T_current_previous.isFinite()) return std::nullopt;
  // From the turn on the left to boxplus' on the right.
  Matrix6d J = Matrix6d::Identity();
  J.topLeftCorner<3, 3>() = best.T_current_previous.R().transpose();
  return AlignedMotion{best.T_current_previous, J * best.information.inverse() * J.transpose()};
}

}  // namespace vip_slam::frontend
