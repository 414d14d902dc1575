#include "vip_slam_frontend/tracking/dense_alignment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <opencv2/imgproc.hpp>

#include "vip_slam_core/util/statistics.h"

namespace vip_slam::frontend {

namespace {

constexpr std::array<int, 3> kWidths{40, 80, 160};  // px, of the levels
constexpr std::array<int, 3> kIterations{12, 8, 5};
// One sigma of the motion between two images, rad and m: keeps directions that the images leave open near the start.
constexpr double kTurn = 0.2, kStep = 0.1;
// A pixel without depth shows the rotation as a far one does, m.
constexpr double kFar = 20.0;
// Fewest pixels of the coarsest level that must agree, and the smallest (quantisation) and largest difference
// of grey values that counts.
constexpr int kFewest = 100;
constexpr double kLeastGrey = 2.0, kLargestGrey = 60.0;
// Depth that differs by more belongs to another surface, sigmas. Its errors are shared by surfaces: the many readings
// count as if each had this many times its sigma.
constexpr double kOtherSurface = 10.0, kSharedDepth = 4.0;

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

double huberWeight(double standardised) {
  const double e = std::abs(standardised);
  return e > 1.345 ? 1.345 / e : 1.0;
}

struct Residual {
  double grey = 0;
  Vector6d J_grey;
  double depth = 0;  ///< standardised; NaN: none
  Vector6d J_depth;
};

}  // namespace

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
    levels.push_back(level);
  }
  return levels;
}

DenseAlignment::Fit DenseAlignment::align(const Level& from, const Level& to, int level, const SE3& start,
                                          int iterations) const {
  const std::vector<Eigen::Vector2d>& rays = rays_[static_cast<std::size_t>(level)];
  const double scale = static_cast<double>(camera_->width()) / from.gray.cols;
  Fit fit;
  fit.T_current_previous = start;
  std::vector<Residual> residuals;
  for (int iteration = 0; iteration <= iterations; ++iteration) {
    residuals.clear();
    std::vector<double> sizes;
    const Eigen::Matrix3d R = fit.T_current_previous.R();
    const Eigen::Vector3d t = fit.T_current_previous.t();
    for (int v = 0; v < from.gray.rows; ++v) {
      for (int u = 0; u < from.gray.cols; ++u) {
        const Eigen::Vector2d& ray = rays[static_cast<std::size_t>(v * from.gray.cols + u)];
        if (!std::isfinite(ray.x())) continue;
        const float reading = from.depth.empty() ? 0.0f : from.depth.at<float>(v, u);
        const bool near = noise_.inRange(reading);
        const Eigen::Vector3d turned = R * ray.homogeneous() * (near ? reading : kFar);
        const Eigen::Vector3d p = near ? Eigen::Vector3d(turned + t) : turned;
        Eigen::Vector2d uv;
        Eigen::Matrix<double, 2, 3> J_project;
        if (p.z() < 0.05 || !camera_->project(p, &uv, &J_project)) continue;
        uv = ((uv.array() + 0.5) / scale - 0.5).matrix();
        Residual r;
        double seen;
        Eigen::RowVector2d gradient;
        if (!lookUp(to.gray, uv.x(), uv.y(), &seen, &gradient)) continue;
        Eigen::Matrix<double, 3, 6> J_p = Eigen::Matrix<double, 3, 6>::Zero();
        J_p.leftCols<3>() = -hat(turned);
        if (near) J_p.rightCols<3>().setIdentity();
        const Eigen::Matrix<double, 2, 6> J_uv = J_project * J_p / scale;
        r.grey = seen - from.gray.at<float>(v, u);
        r.J_grey = (gradient * J_uv).transpose();
        r.depth = std::nan("");
        if (near && !to.depth.empty()) {
          const float z = to.depth.at<float>(std::clamp(static_cast<int>(std::lround(uv.y())), 0, to.depth.rows - 1),
                                             std::clamp(static_cast<int>(std::lround(uv.x())), 0, to.depth.cols - 1));
          double there;
          Eigen::RowVector2d slope;
          const double sigma = kSharedDepth * std::hypot(noise_.sigma(p.z()), noise_.bias_floor);
          if (noise_.inRange(z) && std::abs(z - p.z()) < kOtherSurface * sigma &&
              lookUp(to.depth, uv.x(), uv.y(), &there, &slope) && std::abs(there - z) < kOtherSurface * sigma) {
            r.depth = (there - p.z()) / sigma;
            r.J_depth = ((slope * J_uv - J_p.row(2)) / sigma).transpose();
          }
        }
        sizes.push_back(r.grey);
        residuals.push_back(r);
      }
    }
    fit.used = static_cast<int>(residuals.size());
    if (fit.used < kFewest) return fit;
    // Exposure: the common change of brightness is no motion.
    const double shift = upperMedian(sizes);
    for (double& size : sizes) size = std::abs(size - shift);
    const double grey = std::max(kLeastGrey, 1.4826 * upperMedian(std::move(sizes)));
    Matrix6d A = Matrix6d::Zero();
    Vector6d b = Vector6d::Zero();
    double cost = 0;
    for (const Residual& r : residuals) {
      const double e = (r.grey - shift) / grey, w = huberWeight(e);
      A.noalias() += (w / (grey * grey)) * r.J_grey * r.J_grey.transpose();
      b -= (w * e / grey) * r.J_grey;
      cost += std::min(std::abs(r.grey - shift), kLargestGrey);
      if (!std::isfinite(r.depth)) continue;
      const double wd = huberWeight(r.depth);
      A.noalias() += wd * r.J_depth * r.J_depth.transpose();
      b -= wd * r.depth * r.J_depth;
    }
    fit.cost = cost / fit.used;
    if (iteration == iterations) break;
    A.diagonal().head<3>().array() += 1.0 / (kTurn * kTurn);
    A.diagonal().tail<3>().array() += 1.0 / (kStep * kStep);
    const Vector6d step = A.ldlt().solve(b);
    if (!step.allFinite()) break;
    const Eigen::Matrix3d turn = expSO3(Eigen::Vector3d(step.head<3>()));
    fit.T_current_previous = SE3(Eigen::Matrix3d(turn * R), t + step.tail<3>());
    if (step.head<3>().norm() < 1e-5 && step.tail<3>().norm() < 1e-5) iteration = iterations - 1;
  }
  return fit;
}

std::optional<SE3> DenseAlignment::motion(const cv::Mat& gray_previous, const cv::Mat& depth_previous,
                                          const cv::Mat& gray, const cv::Mat& depth, const SE3& guess) const {
  if (gray_previous.empty() || gray.empty()) return std::nullopt;
  const std::vector<Level> then = pyramid(gray_previous, depth_previous), now = pyramid(gray, depth);
  Fit best;
  best.cost = std::numeric_limits<double>::infinity();
  for (const SE3& start : {guess, SE3()}) {
    const Fit fit = align(then[0], now[0], 0, start, kIterations[0]);
    if (fit.used >= kFewest && fit.cost < best.cost) best = fit;
  }
  if (!std::isfinite(best.cost)) return std::nullopt;
  for (std::size_t level = 1; level < now.size(); ++level) {
    best = align(then[level], now[level], static_cast<int>(level), best.T_current_previous, kIterations[level]);
  }
  if (best.used < kFewest || !best.T_current_previous.isFinite()) return std::nullopt;
  return best.T_current_previous;
}

}  // namespace vip_slam::frontend
