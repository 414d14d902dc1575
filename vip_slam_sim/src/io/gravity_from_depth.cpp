// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <stdexcept>

#include <Eigen/Eigenvalues>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_sim/io/rgbd_folder.h"

namespace vip_slam {
namespace {

constexpr int kNeighbour = 8;          ///< px from a point to its normal's neighbours: wide, as depth is quantised
constexpr double kMinAgreement = 0.8;  ///< minimum length of the mean of the images' up directions
constexpr std::size_t kFewestNormals = 500;

/// Normals of locally flat patches, in the folder's world.
void collectNormals(const RgbdFolder& folder, const RgbdFrame& frame, const SE3& T_W_D,
                    std::vector<Eigen::Vector3d>* out) {
  cv::Mat rgb, depth;
  loadRgbdFrame(folder, frame, &rgb, &depth);
  const CameraIntrinsics& c = folder.depth_registered ? folder.camera : folder.depth_camera;
  const auto point = [&](int u, int v) {
    const double z = 0.001 * depth.at<std::uint16_t>(v, u);
    return Eigen::Vector3d((u - c.cx) / c.fx * z, (v - c.cy) / c.fy * z, z);
  };
  for (int v = kNeighbour; v < depth.rows - kNeighbour; v += 6)
    for (int u = kNeighbour; u < depth.cols - kNeighbour; u += 6) {
      const Eigen::Vector3d m = point(u, v), l = point(u - kNeighbour, v), r = point(u + kNeighbour, v),
                            t = point(u, v - kNeighbour), b = point(u, v + kNeighbour);
      if (m.z() < 0.4 || m.z() > 4 || l.z() == 0 || r.z() == 0 || t.z() == 0 || b.z() == 0) continue;
      const double bend = 0.004 * m.z() * m.z() + 0.002;
      if ((0.5 * (l + r) - m).norm() > bend || (0.5 * (t + b) - m).norm() > bend) continue;
      out->push_back(T_W_D.rotation() * (r - l).cross(b - t).normalized());
    }
}

}  // namespace

Eigen::Vector3d upFromDepth(const RgbdFolder& folder) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> normals;
  std::size_t posed = 0;
  for (std::size_t i = 0; i < folder.frames.size(); ++i) {
    SE3 T_W_C;
    if (!poseAt(folder.T_W_C, folder.frames[i].t, &T_W_C)) continue;
    up += T_W_C.rotation() * Eigen::Vector3d(0, -1, 0);
    ++posed;
    if (i % 8 == 0) collectNormals(folder, folder.frames[i], T_W_C * folder.T_color_depth, &normals);
  }
  // Cameras that roll or look at the floor give no reliable up direction: a wall could be mistaken for the floor.
  const double agreement = posed == 0 ? 1.0 : up.norm() / static_cast<double>(posed);
  if (agreement < kMinAgreement)
    throw std::runtime_error(
        formatted("gravity: the %zu images with a pose do not agree on which side is up; give --up X Y Z (their mean "
                  "up has length "
                  "%.2f, expected at least %g)",
                  posed, agreement, kMinAgreement));
  up.normalize();
  // Cameras are only roughly level: narrow the cone of accepted normals in steps. Floor normals (parallel to up) and,
  // once the cone is below 20 degrees, wall normals (perpendicular to it) contribute.
  std::size_t used = 0;
  for (const double degrees : {35.0, 25.0, 15.0, 10.0, 7.0, 5.0, 5.0, 5.0}) {
    const double c = std::cos(degrees * kDegree), s = std::sin(degrees * kDegree);
    Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
    used = 0;
    for (const Eigen::Vector3d& n : normals) {
      const double d = std::abs(n.dot(up));
      if (d > c) M += n * n.transpose(), ++used;
      if (d < s && degrees < 20) M -= n * n.transpose(), ++used;
    }
    if (used < kFewestNormals)
      throw std::runtime_error(
          formatted("gravity: %zu floor and wall points in the depth images, expected at least %zu; give --up X Y Z",
                    used, kFewestNormals));
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(M);
    const Eigen::Vector3d next = eigen.eigenvectors().col(2);
    up = next.dot(up) < 0 ? Eigen::Vector3d(-next) : next;
  }
  return up;
}

}  // namespace vip_slam
