// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/optimisation/depth_curve_fit.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include "curve_equations.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

constexpr double kBendSigma = 0.002;     // m, prior of an entry against the line between its neighbours
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
    equations->H.diagonal().array() += 1.0 / (kDepthOffSigma * kDepthOffSigma);
    equations->g += value_ / (kDepthOffSigma * kDepthOffSigma);
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

/// Entries without offset and scale, their sigmas, and their information from the readings alone.
struct CurveEstimate {
  VectorXd value, sigma, information;
};

CurveEstimate estimateCurve(const std::vector<const MapKeyframe*>& keyframes, const PlaneSet& planes,
                            const DepthNoise& noise) {
  const int entries = curveEntries(noise);
  CurveFit fit(entries, noise);
  for (int round = 0; round < kFitRounds; ++round) fit.round(keyframes, planes);
  return {fit.value(), fit.sigma(), fit.information().cwiseMax(0)};
}

/// Removes the offset and scale that explain the readings best.
void straighten(const VectorXd& information, VectorXd* value) {
  Eigen::MatrixX2d lines(value->size(), 2);
  for (Eigen::Index i = 0; i < value->size(); ++i) lines.row(i) << 1.0, double(i) * DepthCurve::kStep;
  const Eigen::Matrix2Xd weighted = lines.transpose() * information.asDiagonal();
  *value -= lines * (weighted * lines).ldlt().solve(weighted * *value);
}

}  // namespace

std::optional<DepthCurve> fitDepthCurve(const Map& map, const DepthNoise& noise) {
  const std::vector<const MapKeyframe*> keyframes = newestKeyframesOnPlanes(map);
  if (2 * int(keyframes.size()) < kGroups) return std::nullopt;
  const PlaneSet planes = allPlanes(map);
  CurveEstimate found = estimateCurve(keyframes, planes, noise);
  straighten(found.information, &found.value);
  // Surfaces that are not exactly planar distort the curve as well, but each plane differently.
  const auto [first, second] = halves(keyframes, planes);
  VectorXd apart = 0.5 * (estimateCurve(keyframes, first, noise).value - estimateCurve(keyframes, second, noise).value);
  straighten(found.information, &apart);
  const auto weighted = [&found](const VectorXd& v) { return v.cwiseAbs2().dot(found.information); };
  const double squares = weighted(found.value);
  if (!isLearnt(std::sqrt(squares), std::sqrt(weighted(found.sigma) + weighted(apart)))) return std::nullopt;

  // Shrink entries with little information towards zero, which is the best guess where there are no readings.
  DepthCurve curve;
  const double usual = squares / found.information.sum();
  for (Eigen::Index i = 0; i < found.value.size(); ++i) {
    const double said = found.information(i) * usual;
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
