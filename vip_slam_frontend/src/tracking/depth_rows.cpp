// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/tracking/depth_rows.h"

#include <algorithm>
#include <cmath>

#include "filter/packs.h"

namespace vip_slam {

namespace {

// Neighbours whose depths differ by more than this share belong to two surfaces.
constexpr float kOneSurface = 0.05f;

/// Interpolates 1/z, which is affine over a plane, in an image of inverse depths; 0 where there is no reading.
inline float inverseAt(const cv::Mat& inverse, float u, float v) {
  if (!(u > -0.5f && v > -0.5f && u < static_cast<float>(inverse.cols) - 0.5f &&
        v < static_cast<float>(inverse.rows) - 0.5f)) {
    return 0.f;
  }
  const int c = std::min(static_cast<int>(std::max(u, 0.f)), inverse.cols - 2);
  const int r = std::min(static_cast<int>(std::max(v, 0.f)), inverse.rows - 2);
  const float *upper = inverse.ptr<float>(r) + c, *lower = inverse.ptr<float>(r + 1) + c;
  const float a = u - static_cast<float>(c), b = v - static_cast<float>(r);
  const float least = std::min(std::min(upper[0], upper[1]), std::min(lower[0], lower[1]));
  const float most = std::max(std::max(upper[0], upper[1]), std::max(lower[0], lower[1]));
  if (least > 0 && most - least < kOneSurface * most) {
    return (1 - b) * ((1 - a) * upper[0] + a * upper[1]) + b * ((1 - a) * lower[0] + a * lower[1]);
  }
  return (b < 0.5f ? upper : lower)[a < 0.5f ? 0 : 1];
}

VIP_SLAM_VECTOR_CLONES
void invert(const float* depth, float* inverse, int n) {
  for (int i = 0; i < n; ++i) inverse[i] = depth[i] > 0 ? 1.f / depth[i] : 0.f;  // NaN as well
}

/// R and t of p_stamp = R p_row + t (R column by column), and their increments from this row to the next.
struct RowMotion {
  float R[9], t[3], dR[9], dt[3];
};

/// Rays of a row's pixels, see DepthRows::Rays.
struct RowRays {
  const float *x, *y, *ux, *uy, *vx, *vy;
};

/// A row of the result: expected depth, source pixels, and the map from z at the source to z at the stamp.
struct RowBuffers {
  RowBuffers(int n, float expected) : z(n, expected), offset(n, 0.f), u(n), v(n), gain(n), shift(n) {}
  std::vector<float> z, offset;          ///< expected depth, m, and offset to the source row, px
  std::vector<float> u, v, gain, shift;  ///< pixel; z_stamp = gain z_read + shift
};

/// Source pixels of begin .. end in row `row`, from the expected depth and offset, with the row's pose to first order.
VIP_SLAM_VECTOR_CLONES
void findSources(const RowRays& rays, const RowMotion& m, int row, int begin, int end, RowBuffers* b) {
  const float* __restrict x0 = rays.x, * __restrict y0 = rays.y, * __restrict ux = rays.ux, * __restrict uy = rays.uy, * __restrict vx = rays.vx, * __restrict vy = rays.vy;
  const float* __restrict z = b->z.data(), * __restrict offset = b->offset.data();
  float *__restrict u = b->u.data(), *__restrict v = b->v.data(), *__restrict gain = b->gain.data(),
        *__restrict shift = b->shift.data();
  for (int i = begin; i < end; ++i) {
    const float d = offset[i];
    const float px = x0[i] * z[i] - (m.t[0] + d * m.dt[0]), py = y0[i] * z[i] - (m.t[1] + d * m.dt[1]),
                pz = z[i] - (m.t[2] + d * m.dt[2]);
    const float qx = (m.R[0] + d * m.dR[0]) * px + (m.R[1] + d * m.dR[1]) * py + (m.R[2] + d * m.dR[2]) * pz;
    const float qy = (m.R[3] + d * m.dR[3]) * px + (m.R[4] + d * m.dR[4]) * py + (m.R[5] + d * m.dR[5]) * pz;
    const float qz = (m.R[6] + d * m.dR[6]) * px + (m.R[7] + d * m.dR[7]) * py + (m.R[8] + d * m.dR[8]) * pz;
    const float scale = 1.f / qz, x = qx * scale, y = qy * scale, dx = x - x0[i], dy = y - y0[i];
    u[i] = static_cast<float>(i) + ux[i] * dx + uy[i] * dy;
    v[i] = static_cast<float>(row) + vx[i] * dx + vy[i] * dy;
    gain[i] = (m.R[2] + d * m.dR[2]) * x + (m.R[5] + d * m.dR[5]) * y + (m.R[8] + d * m.dR[8]);
    shift[i] = m.t[2] + d * m.dt[2];
  }
}

std::vector<RowMotion> motionOfRows(const RowPoses& rows, int height) {
  std::vector<RowMotion> motions(static_cast<std::size_t>(height));
  Eigen::Matrix3d R, R_next;
  Eigen::Vector3d t, t_next;
  rows.at(0.5 / height, &R_next, &t_next);
  for (int r = 0; r < height; ++r) {
    R = R_next, t = t_next;
    rows.at((r + 1.5) / height, &R_next, &t_next);
    RowMotion& m = motions[static_cast<std::size_t>(r)];
    Eigen::Map<Eigen::Matrix3f>(m.R) = R.cast<float>();
    Eigen::Map<Eigen::Vector3f>(m.t) = t.cast<float>();
    Eigen::Map<Eigen::Matrix3f>(m.dR) = (R_next - R).cast<float>();
    Eigen::Map<Eigen::Vector3f>(m.dt) = (t_next - t).cast<float>();
  }
  return motions;
}

}  // namespace

DepthRows::DepthRows(std::shared_ptr<const CameraModel> camera) : camera_(std::move(camera)) {
  const std::size_t pixels = static_cast<std::size_t>(camera_->width()) * static_cast<std::size_t>(camera_->height());
  for (std::vector<float>* list : {&rays_.x, &rays_.y, &rays_.ux, &rays_.uy, &rays_.vx, &rays_.vy})
    list->reserve(pixels);
  for (int v = 0; v < camera_->height(); ++v) {
    for (int u = 0; u < camera_->width(); ++u) {
      Eigen::Vector2d xy;
      Eigen::Matrix2d J;
      camera_->undistort(Eigen::Vector2d(u, v), &xy);
      camera_->distort(xy, &J);
      rays_.x.push_back(static_cast<float>(xy.x()));
      rays_.y.push_back(static_cast<float>(xy.y()));
      rays_.ux.push_back(static_cast<float>(J(0, 0)));
      rays_.uy.push_back(static_cast<float>(J(0, 1)));
      rays_.vx.push_back(static_cast<float>(J(1, 0)));
      rays_.vy.push_back(static_cast<float>(J(1, 1)));
    }
  }
}

cv::Mat DepthRows::atStamp(const cv::Mat& depth, const RowPoses& rows) const {
  CV_Assert(depth.type() == CV_32FC1 && depth.cols == camera_->width() && depth.rows == camera_->height());
  const int n = depth.cols;
  cv::Mat inverse(depth.size(), CV_32FC1), result(depth.size(), CV_32FC1);
  for (int v = 0; v < depth.rows; ++v) invert(depth.ptr<float>(v), inverse.ptr<float>(v), n);
  const std::vector<RowMotion> motions = motionOfRows(rows, depth.rows);
  // Neighbours move alike: each pixel starts with depth and offset of the one above.
  // Until a depth was found the image's mean is expected.
  const auto usual = static_cast<float>(cv::mean(depth, inverse > 0)[0]);
  if (!(usual > 0)) return cv::Mat::zeros(depth.size(), CV_32FC1);
  RowBuffers b(n, usual);
  const float cols = static_cast<float>(depth.cols), height = static_cast<float>(depth.rows);
  for (int v = 0; v < depth.rows; ++v) {
    const std::size_t at = static_cast<std::size_t>(v) * n;
    const RowRays rays{&rays_.x[at], &rays_.y[at], &rays_.ux[at], &rays_.uy[at], &rays_.vx[at], &rays_.vy[at]};
    const RowMotion& motion = motions[static_cast<std::size_t>(v)];
    findSources(rays, motion, v, 0, n, &b);
    float* out = result.ptr<float>(v);
    for (int u = 0; u < n; ++u) {
      const auto read = [&] {
        const float found = inverseAt(inverse, b.u[u], b.v[u]);
        b.offset[u] = b.v[u] - static_cast<float>(v);
        return found > 0 ? b.gain[u] / found + b.shift[u] : 0.f;
      };
      float z = read();
      bool misled = !(z > 0) && !(b.u[u] >= 0 && b.v[u] >= 0 && b.u[u] < cols && b.v[u] < height);
      if (z > 0 && std::abs(z - b.z[u]) > kOneSurface * z) {  // another surface than expected
        b.z[u] = z;
        findSources(rays, motion, v, u, u + 1, &b);
        z = read();
        misled = !(z > 0);
      }
      if (z > 0) b.z[u] = z;
      if (misled) {
        // Misled by a speck close to the camera, whose source lies far away: the pixels below start afresh.
        b.z[u] = usual;
        b.offset[u] = 0;
      }
      out[u] = std::max(z, 0.f);
    }
  }
  return result;
}

}  // namespace vip_slam
