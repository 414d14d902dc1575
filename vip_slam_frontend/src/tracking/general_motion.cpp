#include "vip_slam_frontend/tracking/general_motion.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <Eigen/LU>
#include <opencv2/calib3d.hpp>

#include "pair_errors.h"

namespace vip_slam {

namespace {

// The inlier threshold is taken as this many sigmas of one coordinate.
constexpr double kThresholdSigmas = 2.5;
// OpenCV's own thresholds are meant for pixels: scale normalised coordinates up to that size.
constexpr double kScale = 500.0;

Eigen::Matrix3d toEigen(const cv::Mat& m) {
  Eigen::Matrix3d result;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) result(r, c) = m.at<double>(r, c);
  }
  return result;
}

/// First-order distance of a pair from the epipolar constraint m'^T F m = 0.
double sampson2(const PointPair& pair, const Eigen::Matrix3d& F) {
  const Eigen::Vector3d a = pair.xy_previous.homogeneous(), b = pair.xy_current.homogeneous();
  const Eigen::Vector3d Fa = F * a, Ftb = F.transpose() * b;
  const double e = b.dot(Fa);
  return e * e / std::max(1e-300, Fa.head<2>().squaredNorm() + Ftb.head<2>().squaredNorm());
}

double transfer2(const PointPair& pair, const Eigen::Matrix3d& H) {
  const Eigen::Vector3d p = H * pair.xy_previous.homogeneous();
  if (std::abs(p.z()) < 1e-9) return 1e300;
  return (p.hnormalized() - pair.xy_current).squaredNorm();
}

/// GRIC: squared residuals, bounded, plus the price of a model of dimension d with k parameters in data of dimension 4.
double gric(const std::vector<double>& squared, double sigma, int d, int k) {
  const double n = static_cast<double>(squared.size());
  const double most = 2.0 * (4 - d);
  double sum = std::log(4.0) * d * n + std::log(4.0 * n) * k;
  for (double e2 : squared) sum += std::min(most, e2 / (sigma * sigma));
  return sum;
}

}  // namespace

GeneralMotion poseFromDepth(const std::vector<PointPair>& pairs, const SE3& predicted, const RansacOptions& options) {
  GeneralMotion result;
  std::vector<int> pool;
  for (int i = 0; i < static_cast<int>(pairs.size()); ++i) {
    if (pairs[i].depth_previous > 0) pool.push_back(i);
  }
  if (pool.size() < 8) return result;
  std::mt19937 random(options.seed);
  std::uniform_int_distribution<int> pick(0, static_cast<int>(pool.size()) - 1);
  const double limit2 = options.threshold * options.threshold;
  double best = 1e300;
  SE3 T_best;
  for (int k = 0; k < options.iterations; ++k) {
    std::vector<PointPair> sample;
    for (int i = 0; i < 4; ++i) sample.push_back(pairs[pool[pick(random)]]);
    SE3 T = predicted;
    if (!refinePose(sample, std::vector<char>(4, 1), 1e3, &T)) continue;
    double cost = 0;
    const Eigen::Matrix3d R = T.R();
    for (int i : pool) {
      const double e = reprojectionError(pairs[i], R, T.t());
      cost += std::min(limit2, e * e);
      if (cost >= best) break;
    }
    if (cost < best) {
      best = cost;
      T_best = T;
    }
  }
  if (best >= 1e300) return result;
  const auto classify = [&]() {
    const Eigen::Matrix3d R = T_best.R();
    result.inlier.assign(pairs.size(), 0);
    result.inliers = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      result.inlier[i] = pairError(pairs[i], R, T_best.t(), true) < options.threshold;
      result.inliers += result.inlier[i];
    }
  };
  classify();
  if (refinePose(pairs, result.inlier, 0.5 * options.threshold, &T_best)) classify();
  result.model = GeneralModel::kPose;
  result.T_current_previous = T_best;
  return result;
}

GeneralMotion fundamentalOrHomography(const std::vector<PointPair>& pairs, const RansacOptions& options) {
  GeneralMotion result;
  if (pairs.size() < 12) return result;
  std::vector<cv::Point2d> a, b;
  for (const PointPair& pair : pairs) {
    a.emplace_back(kScale * pair.xy_previous.x(), kScale * pair.xy_previous.y());
    b.emplace_back(kScale * pair.xy_current.x(), kScale * pair.xy_current.y());
  }
  const int iterations = 10 * options.iterations;  // samples of four to eight need more than those of two
#if CV_VERSION_MAJOR > 4 || (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 3)
  const cv::Mat F = cv::findFundamentalMat(a, b, cv::FM_RANSAC, kScale * options.threshold, 0.99, iterations);
#else  // at most 1000 iterations
  const cv::Mat F = cv::findFundamentalMat(a, b, cv::FM_RANSAC, kScale * options.threshold, 0.99);
#endif
  const cv::Mat H = cv::findHomography(a, b, cv::RANSAC, kScale * options.threshold, cv::noArray(), iterations, 0.99);
  const Eigen::Matrix3d S = Eigen::Vector3d(kScale, kScale, 1.0).asDiagonal();
  const double sigma = options.threshold / kThresholdSigmas;
  std::vector<double> errors_F, errors_H;
  double score_F = 1e300, score_H = 1e300;
  if (F.rows == 3 && F.cols == 3) {
    const Eigen::Matrix3d normalised = S * toEigen(F) * S;
    for (const PointPair& pair : pairs) errors_F.push_back(sampson2(pair, normalised));
    score_F = gric(errors_F, sigma, 3, 7);
  }
  if (H.rows == 3 && H.cols == 3) {
    const Eigen::Matrix3d normalised = S.inverse() * toEigen(H) * S;
    for (const PointPair& pair : pairs) errors_H.push_back(transfer2(pair, normalised));
    score_H = gric(errors_H, sigma, 2, 8);
  }
  if (errors_F.empty() && errors_H.empty()) return result;
  result.model = score_H <= score_F ? GeneralModel::kHomography : GeneralModel::kFundamental;
  for (double e2 : result.model == GeneralModel::kHomography ? errors_H : errors_F) {
    result.inlier.push_back(e2 < options.threshold * options.threshold);
    result.inliers += result.inlier.back();
  }
  return result;
}

}  // namespace vip_slam
