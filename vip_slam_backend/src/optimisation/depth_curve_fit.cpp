// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/optimisation/depth_curve_fit.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include <Eigen/Cholesky>

#include "curve_equations.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr double kEntrySigma = 0.01;   // m, prior of an entry
constexpr double kBendSigma = 0.002;   // m, prior of an entry against the line between its neighbours
constexpr int kRounds = 3;             // of reweighting
constexpr double kKnownSigma = 0.001;  // m: entries with a smaller sigma count as known
constexpr int kMinKnown = 6;           // entries
// The root mean square of the known entries must exceed so many m and so many sigmas. Once there is a curve the camera
// is known to have one, and what it lacks may lie at few distances, those that were not seen before: less will do.
struct Significance {
  double size, sigmas;
};
constexpr Significance kFirstCurve{5e-4, 4.0}, kRefinement{3e-4, 2.0};
// The curves from two halves of the planes must have at least this correlation.
constexpr double kMinCorrelation = 0.5;

constexpr float kWorthTelling = 0.002f;  // m

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Gauss-Newton on the entries.
class CurveFit {
 public:
  CurveFit(int entries, const DepthNoise& noise) : entries_(entries), noise_(noise), value_(VectorXd::Zero(entries)) {}

  /// One Gauss-Newton step with the weights of the present value.
  void round(const std::vector<const MapKeyframe*>& keyframes, const PlaneSet& planes) {
    CurveEquations equations = curveEquations(keyframes, planes, value_, noise_);
    information_ = equations.H.diagonal() / equations.scatter;
    addPriors(&equations);
    const Eigen::LDLT<MatrixXd> ldlt(equations.H);
    value_ -= ldlt.solve(equations.g);
    sigma_ = ldlt.solve(MatrixXd::Identity(entries_, entries_)).diagonal().cwiseMax(0).cwiseSqrt();
    sigma_ *= std::sqrt(equations.scatter);
  }

  const VectorXd& value() const { return value_; }
  const VectorXd& sigma() const { return sigma_; }
  const VectorXd& information() const { return information_; }  ///< of each entry, without its priors

 private:
  void addPriors(CurveEquations* equations) const {
    equations->H.diagonal().array() += 1.0 / (kEntrySigma * kEntrySigma);
    equations->g += value_ / (kEntrySigma * kEntrySigma);
    const Eigen::Vector3d bend = Eigen::Vector3d(-0.5, 1.0, -0.5) / kBendSigma;
    for (int i = 0; i + 2 < entries_; ++i) {
      equations->H.block<3, 3>(i, i) += bend * bend.transpose();
      equations->g.segment<3>(i) += bend * bend.dot(value_.segment<3>(i));
    }
  }

  int entries_;
  const DepthNoise& noise_;
  VectorXd value_, sigma_, information_;
};

/// Entries after removing the best offset and scale, and the indices of the known ones.
struct CurveEstimate {
  VectorXd value, sigma, information;
  std::vector<int> known;
};

CurveEstimate estimateCurve(const std::vector<const MapKeyframe*>& keyframes, const PlaneSet& planes,
                            const DepthNoise& noise) {
  const int entries = curveEntries(noise);
  CurveFit fit(entries, noise);
  for (int round = 0; round < kRounds; ++round) fit.round(keyframes, planes);
  CurveEstimate estimate{fit.value(), fit.sigma(), fit.information(), {}};
  Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  const auto line = [](int i) { return Eigen::Vector2d(1.0, i * DepthCurve::kStep); };
  for (int i = 0; i < entries; ++i) {
    if (!(fit.sigma()(i) < kKnownSigma)) continue;
    estimate.known.push_back(i);
    A += fit.information()(i) * line(i) * line(i).transpose();
    b += fit.information()(i) * fit.value()(i) * line(i);
  }
  if (int(estimate.known.size()) < kMinKnown) return {};
  const Eigen::Vector2d straight = A.ldlt().solve(b);
  for (int i = 0; i < entries; ++i) estimate.value(i) -= straight.dot(line(i));
  if (!estimate.value.allFinite()) return {};
  return estimate;
}

/// Correlation of two estimates over the entries known to both, without offset and scale, which depend on the distances
/// of each estimate's points.
double correlation(const CurveEstimate& a, const CurveEstimate& b) {
  std::vector<int> common;
  std::set_intersection(a.known.begin(), a.known.end(), b.known.begin(), b.known.end(), std::back_inserter(common));
  const auto n = static_cast<Eigen::Index>(common.size());
  if (n < kMinKnown) return 0.0;
  Eigen::MatrixX2d lines(n, 2), values(n, 2);
  for (Eigen::Index k = 0; k < n; ++k) {
    const int i = common[static_cast<std::size_t>(k)];
    lines.row(k) << 1.0, i * DepthCurve::kStep;
    values.row(k) << a.value(i), b.value(i);
  }
  values -= (lines * (lines.transpose() * lines).ldlt().solve(lines.transpose() * values)).eval();
  const double product = values.col(0).norm() * values.col(1).norm();
  return product > 0 ? values.col(0).dot(values.col(1)) / product : 0.0;
}

}  // namespace

std::optional<DepthCurve> fitDepthCurve(const Map& map, const DepthNoise& noise, bool refine) {
  const std::vector<const MapKeyframe*> keyframes = newestKeyframesOnPlanes(map);
  if (int(keyframes.size()) < kMinCurveKeyframes) return std::nullopt;
  const PlaneSet planes = allPlanes(map);
  const CurveEstimate found = estimateCurve(keyframes, planes, noise);
  if (found.known.empty()) return std::nullopt;
  double squares = 0, ratios = 0;
  for (const int i : found.known) {
    squares += found.value(i) * found.value(i);
    ratios += std::pow(found.value(i) / found.sigma(i), 2);
  }
  const auto n = static_cast<double>(found.known.size());
  const Significance& least = refine ? kRefinement : kFirstCurve;
  if (squares < n * least.size * least.size || ratios < n * least.sigmas * least.sigmas) return std::nullopt;
  // Surfaces that are not exactly planar distort the curve as well, but each plane differently.
  const auto [first, second] = halves(keyframes, planes);
  const double agree = correlation(estimateCurve(keyframes, first, noise), estimateCurve(keyframes, second, noise));
  if (agree < kMinCorrelation) return std::nullopt;

  // Shrink entries with little information towards zero, which is the best guess where there are no readings.
  DepthCurve curve;
  for (Eigen::Index i = 0; i < found.value.size(); ++i) {
    const double said = std::max(0.0, found.information(i)) * squares / n;
    curve.added.push_back(static_cast<float>(found.value(i) * said / (1 + said)));
  }
  return curve;
}

std::string depthCurveDifference(const DepthCurve& found) {
  float most = 0;
  for (const float added : found.added) most = std::max(most, std::abs(added));
  if (most < kWorthTelling) return "";
  return formatted(
      "depth is off by up to %.1f mm, at some distances too long and at others too short, which is corrected "
      "for; depth/curve in the sensor's configuration can have it from the start",
      1e3 * double(most));
}

}  // namespace vip_slam
