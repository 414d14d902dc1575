// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_frontend/filter/calibration_evidence.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "vip_slam_frontend/filter/drift_monitor.h"
#include "vip_slam_frontend/filter/gating.h"

namespace vip_slam::frontend {
namespace {

constexpr double kSure = 3.0;      // sigmas between the adopted value and the estimate
constexpr double kNothing = 1e-6;  // share of the prior's information, below which data say nothing

}  // namespace

Likelihood Likelihood::of(const Eigen::VectorXd& value, const Eigen::MatrixXd& covariance) {
  const Eigen::MatrixXd information =
      covariance.llt().solve(Eigen::MatrixXd::Identity(covariance.rows(), covariance.cols()));
  return {information, information * value};
}

void Likelihood::add(const Likelihood& other) {
  information += other.information;
  weighted += other.weighted;
}

void Likelihood::marginalise(int k, const Estimate& prior) {
  const double of_prior = 1 / (prior.sigma * prior.sigma), own = information(k, k) + of_prior;
  const Eigen::VectorXd shared = information.col(k);
  weighted -= shared * ((weighted(k) + of_prior * prior.value) / own);
  information -= shared * shared.transpose() / own;
  information.row(k).setZero();
  information.col(k).setZero();
  weighted(k) = 0;
}

CalibrationEvidence::CalibrationEvidence(const std::vector<Estimate>& prior)
    : prior_(prior),
      prior_likelihood_(Likelihood::none(static_cast<int>(prior.size()))),
      adopted_(prior.size()),
      length_(kStretch) {
  for (std::size_t k = 0; k < prior.size(); ++k) {
    adopted_(k) = prior[k].value;
    prior_likelihood_.information(k, k) = 1 / (prior[k].sigma * prior[k].sigma);
    prior_likelihood_.weighted(k) = prior[k].value * prior_likelihood_.information(k, k);
  }
  estimate();
}

void CalibrationEvidence::couple(int j, int k, double sigma) {
  Eigen::VectorXd row = Eigen::VectorXd::Zero(adopted_.size());
  row(j) = 1 / sigma;
  row(k) = -1 / sigma;
  prior_likelihood_.information += row * row.transpose();
  prior_likelihood_.weighted += row * ((prior_[j].value - prior_[k].value) / sigma);
  estimate();
}

double CalibrationEvidence::sigmaOfAdopted(int k) const { return std::hypot(sigma_(k), found_(k) - adopted_(k)); }

Estimate CalibrationEvidence::held(int k) const {
  return {adopted_(k), std::min(kHeld * prior_[k].sigma, sigmaOfAdopted(k))};
}

double CalibrationEvidence::varianceBeyondHeld(int k) const {
  const double all = sigmaOfAdopted(k), kept = held(k).sigma;
  return std::max(0.0, all * all - kept * kept);
}

void CalibrationEvidence::add(double t, const Likelihood& step) {
  // A filter that has failed says nothing; it is started again.
  if (!step.information.allFinite() || !step.weighted.allFinite()) return;
  if (stretches_.empty() || !(std::abs(t - begin_) < length_)) {
    // Enough remain when every two become one.
    if (stretches_.size() == 2 * kEnough) {
      for (std::size_t k = 0; k < kEnough; ++k) {
        stretches_[k] = stretches_[2 * k];
        stretches_[k].add(stretches_[2 * k + 1]);
      }
      stretches_.resize(kEnough);
      length_ *= 2;
    }
    stretches_.push_back(Likelihood::none(static_cast<int>(prior_.size())));
    begin_ = t;
  }
  stretches_.back().add(step);
  estimate();
}

void CalibrationEvidence::estimate() {
  // In units of the priors' sigmas.
  const int n = static_cast<int>(prior_.size());
  Eigen::VectorXd unit(n), centre(n);
  for (int k = 0; k < n; ++k) {
    unit(k) = prior_[k].sigma;
    centre(k) = prior_[k].value;
  }
  const auto scaled = [&unit](const Eigen::MatrixXd& information) {
    return Eigen::MatrixXd(unit.asDiagonal() * information * unit.asDiagonal());
  };
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd weighted = Eigen::VectorXd::Zero(n);
  for (const Likelihood& s : stretches_) {
    information += scaled(s.information);
    weighted += unit.cwiseProduct(s.weighted - s.information * centre);
  }
  // The root of the sum, information = root root^T, and its inverse where data say something.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(information);
  const Eigen::MatrixXd root = axes.eigenvectors() * axes.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
  const Eigen::MatrixXd whiten =
      axes.eigenvectors() * axes.eigenvalues().cwiseMax(kNothing).cwiseSqrt().cwiseInverse().asDiagonal();  // root^-T
  const Eigen::VectorXd alone = whiten * (whiten.transpose() * weighted);
  // Scatter of the stretches' scores in units of what it should be, and the usual scatter of one stretch. Each score is
  // taken at the estimate by all others.
  const Eigen::MatrixXd prior = scaled(prior_likelihood_.information);
  const Eigen::MatrixXd all = Eigen::MatrixXd::Identity(n, n) + whiten.transpose() * prior * whiten;
  Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(n, n);
  for (const Likelihood& s : stretches_) {
    const Eigen::VectorXd score =
        whiten.transpose() * unit.cwiseProduct(s.weighted - s.information * (centre + unit.cwiseProduct(alone)));
    const Eigen::MatrixXd share = whiten.transpose() * scaled(s.information) * whiten;
    const Eigen::VectorXd apart = all * (all - share).llt().solve(score);
    scatter += apart * apart.transpose() + kUsualScatter * share * share;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> wider(scatter);
  const Eigen::MatrixXd directions = root * wider.eigenvectors();
  const Eigen::MatrixXd robust =
      directions * wider.eigenvalues().cwiseMax(1.0).cwiseInverse().asDiagonal() * directions.transpose();
  const Eigen::VectorXd prior_weighted =
      unit.cwiseProduct(prior_likelihood_.weighted - prior_likelihood_.information * centre);
  const Eigen::LLT<Eigen::MatrixXd> sum(robust + prior);
  found_ = centre + unit.cwiseProduct(sum.solve(robust * alone + prior_weighted));
  const Eigen::MatrixXd covariance = sum.solve(Eigen::MatrixXd::Identity(n, n));
  sigma_ = unit.cwiseProduct(covariance.diagonal().cwiseSqrt());
  Eigen::ArrayXd variance = Eigen::ArrayXd::Zero(n), squares = Eigen::ArrayXd::Zero(n);
  for (const Likelihood& s : stretches_) {
    const Eigen::ArrayXd of_stretch = (covariance * scaled(s.information) * covariance).diagonal();
    variance += of_stretch;
    squares += of_stretch.square();
  }
  degrees_ = (squares > 0).select(variance.square() / squares, 1.0).max(1.0);
}

double CalibrationEvidence::sureSigmas(int k) const {
  // About as improbable by Student's distribution as kSure by the normal one.
  return std::sqrt(degrees_(k) * std::expm1(kSure * kSure / degrees_(k)));
}

bool CalibrationEvidence::contradicts(int k) const {
  return std::abs(found_(k) - prior_[k].value) > std::max(kGateSigmas * prior_[k].sigma, sureSigmas(k) * sigma_(k));
}

bool CalibrationEvidence::adopt() {
  const Eigen::VectorXd before = adopted_;
  for (int k = 0; k < adopted_.size(); ++k) {
    // Further from the prior something else is wrong, a unit or another sensor, and nothing is adopted.
    if (!(std::abs(found_(k) - prior_[k].value) < kGateSigmas * prior_[k].sigma)) {
      adopted_(k) = prior_[k].value;
      continue;
    }
    const double apart = std::abs(found_(k) - adopted_(k));
    const bool adopted = adopted_(k) != prior_[k].value;
    // The filter's sigma of a number that is held allows for a small difference.
    if (!adopted && apart < kHeld * prior_[k].sigma) continue;
    if (apart > (adopted ? 1.0 : sureSigmas(k)) * sigma_(k)) adopted_(k) = found_(k);
  }
  return adopted_ != before;
}

void CalibrationEvidence::restart(int k, double sigma) {
  for (Likelihood& stretch : stretches_) stretch.marginalise(k, prior_[k]);
  const double more = 1 / (sigma * sigma) - 1 / (prior_[k].sigma * prior_[k].sigma);
  prior_likelihood_.information(k, k) += more;
  prior_likelihood_.weighted(k) += more * prior_[k].value;
  prior_[k].sigma = sigma;
  adopted_(k) = prior_[k].value;
  estimate();
}

}  // namespace vip_slam::frontend
