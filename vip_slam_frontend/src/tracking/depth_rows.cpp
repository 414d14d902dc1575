#include "vip_slam_frontend/tracking/depth_rows.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {

namespace {

// Neighbours whose depths differ by more than this share belong to two surfaces.
constexpr float kOneSurface = 0.05f;
// A surface that is farther than this from where it was expected moved otherwise: look again.
constexpr float kElsewhere = 0.02f;

/// Inverse depth is affine over a plane. 0 where nothing was read.
float depthAt(const cv::Mat& depth, float u, float v) {
  const int c = static_cast<int>(std::floor(u)), r = static_cast<int>(std::floor(v));
  if (c < 0 || r < 0 || c + 1 >= depth.cols || r + 1 >= depth.rows) {
    const int near_c = static_cast<int>(std::lround(u)), near_r = static_cast<int>(std::lround(v));
    const bool inside = near_c >= 0 && near_r >= 0 && near_c < depth.cols && near_r < depth.rows;
    const float z = inside ? depth.at<float>(near_r, near_c) : 0.f;
    return z > 0 ? z : 0.f;
  }
  const float *upper = depth.ptr<float>(r) + c, *lower = depth.ptr<float>(r + 1) + c;
  const float a = u - static_cast<float>(c), b = v - static_cast<float>(r);
  const float least = std::min({upper[0], upper[1], lower[0], lower[1]});
  const float most = std::max({upper[0], upper[1], lower[0], lower[1]});
  if (least > 0 && most - least < kOneSurface * least) {
    return 1.f / ((1 - b) * ((1 - a) / upper[0] + a / upper[1]) + b * ((1 - a) / lower[0] + a / lower[1]));
  }
  const float z = (b < 0.5f ? upper : lower)[a < 0.5f ? 0 : 1];
  return z > 0 ? z : 0.f;
}

}  // namespace

DepthRows::DepthRows(std::shared_ptr<const CameraModel> camera) : camera_(std::move(camera)) {
  rays_.reserve(static_cast<std::size_t>(camera_->width()) * static_cast<std::size_t>(camera_->height()));
  for (int v = 0; v < camera_->height(); ++v) {
    for (int u = 0; u < camera_->width(); ++u) {
      Eigen::Vector2d xy;
      Eigen::Matrix2d J;
      camera_->undistort(Eigen::Vector2d(u, v), &xy);
      camera_->distort(xy, &J);
      const Eigen::Matrix2f j = J.cast<float>();
      rays_.push_back({static_cast<float>(xy.x()), static_cast<float>(xy.y()), j(0, 0), j(0, 1), j(1, 0), j(1, 1)});
    }
  }
}

cv::Mat DepthRows::atStamp(const cv::Mat& depth, const RowPoses& rows) const {
  CV_Assert(depth.type() == CV_32FC1 && depth.cols == camera_->width() && depth.rows == camera_->height());
  std::vector<Eigen::Matrix3f> R(static_cast<std::size_t>(depth.rows));
  std::vector<Eigen::Vector3f> t(R.size());
  for (std::size_t r = 0; r < R.size(); ++r) {
    Eigen::Matrix3d R_row;
    Eigen::Vector3d t_row;
    rows.at((static_cast<double>(r) + 0.5) / depth.rows, &R_row, &t_row);
    R[r] = R_row.cast<float>();
    t[r] = t_row.cast<float>();
  }
  cv::Mat result(depth.size(), CV_32FC1);
  const Ray* ray = rays_.data();
  for (int v = 0; v < depth.rows; ++v) {
    float* out = result.ptr<float>(v);
    // Neighbours move alike: each begins where the one to the left was found.
    float expected = 2.f, row_offset = 0.f;
    for (int u = 0; u < depth.cols; ++u, ++ray) {
      float z = 0;
      for (int turn = 0; turn < 2; ++turn) {
        const int from = std::clamp(static_cast<int>(std::lround(static_cast<float>(v) + row_offset)), 0, depth.rows - 1);
        const Eigen::Matrix3f& R_row = R[static_cast<std::size_t>(from)];
        const Eigen::Vector3f& t_row = t[static_cast<std::size_t>(from)];
        const Eigen::Vector3f q = R_row.transpose() * (Eigen::Vector3f(ray->x, ray->y, 1.f) * expected - t_row);
        const float x = q.x() / q.z(), y = q.y() / q.z(), dx = x - ray->x, dy = y - ray->y;
        row_offset = ray->vx * dx + ray->vy * dy;
        const float read = depthAt(depth, static_cast<float>(u) + ray->ux * dx + ray->uy * dy,
                                   static_cast<float>(v) + row_offset);
        if (!(read > 0)) {
          z = 0;
          break;
        }
        z = read * (R_row(2, 0) * x + R_row(2, 1) * y + R_row(2, 2)) + t_row.z();
        const bool found = std::abs(z - expected) < kElsewhere * expected;
        expected = std::max(z, 0.05f);
        if (found) break;
      }
      out[u] = z;
    }
  }
  return result;
}

}  // namespace vip_slam
