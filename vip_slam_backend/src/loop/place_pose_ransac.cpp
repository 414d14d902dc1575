// SPDX-License-Identifier: BSD-3-Clause
// RANSAC with two points. With gravity known the pose has four degrees of freedom: yaw and position. Two rays levelled
// by R_G_B are given lengths (by depth, or for rays of one camera by the height difference and distance of the two map
// points), the horizontal direction between the two ends gives yaw, the rest position.
#include <algorithm>
#include <cmath>
#include <random>

#include "vip_slam_backend/loop/place_pose.h"

namespace vip_slam {
namespace {

struct Lengths {
  double a, b;
};

// Lengths of two rays so that (b fb - a fa) has height D.z and norm |D|: linear in height, quadratic in norm.
std::vector<Lengths> lengthsFromDifference(const Eigen::Vector3d& fa, const Eigen::Vector3d& fb,
                                           const Eigen::Vector3d& D) {
  std::vector<Lengths> result;
  // Eliminates the length of the steeper ray: solve with fb the steeper one, else swap.
  const bool swap = std::abs(fa.z()) > std::abs(fb.z());
  const Eigen::Vector3d& f = swap ? fb : fa;  // free length x
  const Eigen::Vector3d& g = swap ? fa : fb;  // length y = (x f.z + h) / g.z
  const double h = swap ? -D.z() : D.z();
  if (std::abs(g.z()) < 0.02 * g.norm()) return result;  // both rays are horizontal: heights give no constraint
  const Eigen::Vector3d u = g * (f.z() / g.z()) - f, w = g * (h / g.z());  // y g - x f = x u + w
  const double A = u.squaredNorm(), B = u.dot(w), C = w.squaredNorm() - D.squaredNorm();
  const double discriminant = B * B - A * C;
  if (A < 1e-12 || discriminant < 0) return result;
  for (const double sign : {-1.0, 1.0}) {
    const double x = (-B + sign * std::sqrt(discriminant)) / A, y = (x * f.z() + h) / g.z();
    if (x > 0.05 && y > 0.05) result.push_back(swap ? Lengths{y, x} : Lengths{x, y});
  }
  return result;
}

// ea, eb: the ends of the rays from the body's origin, in the axes of G.
bool poseFromPair(const Eigen::Vector3d& pa, const Eigen::Vector3d& pb, const Eigen::Vector3d& ea,
                  const Eigen::Vector3d& eb, const Eigen::Quaterniond& R_G_B, SE3* T_W_B) {
  const Eigen::Vector3d D = pb - pa, E = eb - ea;
  const double horizontal = D.head<2>().norm();
  if (horizontal < 0.05 || E.head<2>().norm() < 0.05) return false;  // yaw is not determined
  const double yaw = std::atan2(D.y(), D.x()) - std::atan2(E.y(), E.x());
  const Eigen::Quaterniond R_W_G(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  *T_W_B = SE3(R_W_G * R_G_B, 0.5 * (pa + pb) - R_W_G * (0.5 * (ea + eb)));
  return true;
}

}  // namespace

bool explains(const SE3& T_W_C, const PlaceMatch& match, double max_px, const PlacePoseOptions& options) {
  const Eigen::Vector3d p = T_W_C.rotation().conjugate() * (match.p_W - T_W_C.t());
  if (p.z() < 0.05) return false;
  const double limit = max_px * match.scale / options.focal;
  if ((p.head<2>() / p.z() - match.xy).squaredNorm() > limit * limit) return false;
  return match.depth <= 0 ||
         std::abs(p.z() - match.depth) <= options.depth_sigmas * match.depth_sigma + 0.02 + 0.01 * p.z();
}

CameraRig singleCamera() { return {SE3()}; }

PlacePose ransacPlacePose(const std::vector<PlaceMatch>& matches, const CameraRig& rig, const Eigen::Quaterniond& R_G_B,
                          const PlacePoseOptions& options) {
  PlacePose best;
  const std::size_t n = matches.size();
  if (n < 2) return best;
  std::vector<Eigen::Vector3d> eyes(rig.size()), rays(n);  // in the axes of G
  for (std::size_t c = 0; c < rig.size(); ++c) eyes[c] = R_G_B * rig[c].t();
  for (std::size_t k = 0; k < n; ++k)
    rays[k] = R_G_B * (rig[matches[k].camera].rotation() * Eigen::Vector3d(matches[k].xy.x(), matches[k].xy.y(), 1.0));

  std::mt19937_64 random(options.seed);
  std::vector<SE3> T_W_C(rig.size());
  std::size_t best_count = 0;
  int needed = options.iterations;
  for (int iteration = 0; iteration < needed; ++iteration) {
    const std::size_t a = random() % n, b = random() % n;
    if (a == b) continue;
    const PlaceMatch &ma = matches[a], &mb = matches[b];
    const Eigen::Vector3d &ea = eyes[ma.camera], &eb = eyes[mb.camera];
    const Eigen::Vector3d D = mb.p_W - ma.p_W;
    std::vector<Lengths> lengths;
    if (ma.depth > 0 && mb.depth > 0) {
      // Distance and height are independent of the pose: this rejects most wrong pairs.
      const Eigen::Vector3d E = eb + mb.depth * rays[b] - ea - ma.depth * rays[a];
      const double slack = options.depth_sigmas * (ma.depth_sigma + mb.depth_sigma) + 0.05;
      if (std::abs(E.norm() - D.norm()) > slack || std::abs(E.z() - D.z()) > slack) continue;
      lengths.push_back({ma.depth, mb.depth});
    } else if (ma.camera == mb.camera) {
      lengths = lengthsFromDifference(rays[a], rays[b], D);
    }
    for (const Lengths& l : lengths) {
      SE3 T_W_B;
      if (!poseFromPair(ma.p_W, mb.p_W, ea + l.a * rays[a], eb + l.b * rays[b], R_G_B, &T_W_B)) continue;
      for (std::size_t c = 0; c < rig.size(); ++c) T_W_C[c] = T_W_B * rig[c];
      std::vector<std::uint32_t> inliers;
      for (std::uint32_t k = 0; k < n; ++k)
        if (explains(T_W_C[matches[k].camera], matches[k], options.ransac_px, options)) inliers.push_back(k);
      if (inliers.size() <= best_count) continue;
      best_count = inliers.size();
      best.found = true;
      best.T_W_B = T_W_B;
      best.inliers = std::move(inliers);
      // Enough samples for a pair of inliers with 99.9 % probability, with a margin for their noise.
      const double w = static_cast<double>(best_count) / static_cast<double>(n);
      const double wanted = 3.0 * std::log(1e-3) / std::log(std::max(1e-9, 1.0 - w * w));
      needed = std::min(options.iterations, std::max(30, static_cast<int>(std::ceil(wanted))));
    }
  }
  return best;
}

}  // namespace vip_slam
