// SPDX-License-Identifier: BSD-3-Clause
// The filter's update with features: selection of tracks, their rows, and their weights.
#include <algorithm>
#include <cmath>

#include "vip_slam_core/util/statistics.h"
#include "vip_slam_frontend/filter/feature_rows.h"
#include "vip_slam_frontend/filter/triangular_solve.h"
#include "vip_slam_frontend/filter/triangulation.h"
#include "vip_slam_frontend/filter/vio_filter.h"

namespace vip_slam {

namespace {

// Adapted factor on the depth noise up to which the sensor's noise model is used unchanged.
constexpr double kWorseThanModel = 1.1;
// Number of iterated updates, each linearised at the result of the one before: after the first, poses are right to a
// pixel.
constexpr int kPasses = 3;

/// Gives a monitor the median of the features' chi-squares per degree of freedom, and the number of rows.
void tell(NoiseMonitor* monitor, std::vector<double> chi2, int rows) {
  if (chi2.size() < 3) return;
  // The median of a chi-square per degree of freedom with the usual dozen of rows lies some 5 % below its mean.
  monitor->add(1.05 * upperMedian(std::move(chi2)), rows);
}

/// Stacks all features' rows sorted by their first non-zero column, which costs the triangularisation least.
void stackStaircase(const std::vector<FeatureRows>& features, int rows, Eigen::MatrixXd* H, Eigen::VectorXd* h) {
  struct Row {
    int column, feature, row;
  };
  std::vector<Row> order;
  order.reserve(rows);
  for (std::size_t f = 0; f < features.size(); ++f) {
    const Eigen::MatrixXd& from = features[f].H;
    for (int i = 0; i < from.rows(); ++i) {
      int column = 0;
      while (column < from.cols() && from(i, column) == 0.0) ++column;
      order.push_back({column, static_cast<int>(f), i});
    }
  }
  std::stable_sort(order.begin(), order.end(), [](const Row& a, const Row& b) { return a.column < b.column; });
  H->resize(rows, features.front().H.cols());
  h->resize(rows);
  for (int i = 0; i < rows; ++i) (*h)(i) = features[order[i].feature].r(order[i].row);
  for (int c = 0; c < H->cols(); ++c) {
    for (int i = 0; i < rows; ++i) (*H)(i, c) = features[order[i].feature].H(order[i].row, c);
  }
}

/// Huber's weight of the information of rows with this squared residual, in sigmas.
double huberWeight(double squared, double threshold) {
  return squared > threshold * threshold ? threshold / std::sqrt(squared) : 1.0;
}

}  // namespace

std::vector<VioFilter::Candidate> VioFilter::chooseCandidates(CloneId id, bool window_full, bool all) {
  std::vector<Candidate> candidates;
  const CloneId leaves = oldest().id;
  for (auto& entry : tracks_) {
    const auto& observations = entry.second.observations;
    const bool lost = observations.back().clone != id;
    const bool leaving = window_full && observations.front().clone == leaves;
    if ((lost || leaving || all) && observations.size() >= 2) candidates.push_back({&entry.second, lost});
  }
  // Long tracks are the most informative. Ties keep the order of ids, so that two runs agree.
  std::stable_sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.track->observations.size() > b.track->observations.size();
  });
  return candidates;
}

double VioFilter::ownNoise(const Triangulation& point) const {
  const int dof = point.pixel_rows - 3;
  if (!options_.own_noise || dof <= 0 || point.pixel_chi2 < gate_.threshold(dof)) return 1.0;
  return point.pixel_chi2 / dof;
}

double VioFilter::beyondState(const FeatureRows& feature) const {
  const int n = static_cast<int>(feature.r.size());
  if (n == 0) return 1.0;
  const double distance = testInnovation(filter_.R(), feature.H, feature.r).distance;
  return distance < gate_.threshold(n) ? 1.0 : distance / n;
}

double VioFilter::openPixels() const {
  const WindowState& window = filter_.window();
  const double variance = covariance().block<3, 3>(6, 6).diagonal().maxCoeff();
  const double seconds = window.clones.back().t - oldest().t;
  return std::sqrt(std::max(0.0, variance)) * seconds * focal_;
}

double VioFilter::depthNoiseScale() const {
  // Depth errors are correlated between images: a smaller scatter than the model's does not mean a smaller error.
  return depth_noise_.sigma() > kWorseThanModel ? depth_noise_.sigma() : 1.0;
}

VioFilter::FeatureBatch VioFilter::judgeFeatures(const std::vector<Candidate>& candidates, const WindowState& window,
                                                 const Eigen::VectorXd& moved, OwnNoise own_noise) const {
  MeasurementNoise noise;
  noise.sigma_xy = noise_.sigma() / focal_;
  noise.depth_inflation = options_.depth_inflation * depthNoiseScale();
  FeatureBatch batch;
  for (const Candidate& candidate : candidates) {
    if (static_cast<int>(batch.accepted.size()) >= options_.max_update_features) break;
    ++batch.tried;
    const auto& observations = candidate.track->observations;
    const Triangulation point = triangulate(window, observations, noise);
    if (!point.ok) continue;
    double own = own_noise == OwnNoise::kNone ? 1.0 : ownNoise(point);
    if (own > 1) {
      batch.nearest_noisy = std::min(batch.nearest_noisy, 1.0 / point.inverse_depth);
      if (own_noise == OwnNoise::kBeyondState) {
        MeasurementNoise common = noise;
        common.sigma_xy *= options_.pixel_inflation;
        own = std::min(own, beyondState(featureRows(window, observations, point.p_W, common)));
      }
    }
    MeasurementNoise row_noise = noise;
    row_noise.sigma_xy *= options_.pixel_inflation * own;
    FeatureRows feature = featureRows(window, observations, point.p_W, row_noise);
    const int dof = static_cast<int>(feature.r.size());
    if (dof == 0) continue;
    if (point.pixel_rows >= 10) {
      batch.chi2.push_back(point.pixel_chi2 / (point.pixel_rows - 3));
      batch.chi2_rows += point.pixel_rows - 3;
    }
    if (point.depth_rows >= 5) {
      const double scale = depthNoiseScale() / depth_noise_.sigma();  // from the whitening used to the monitor's sigma
      batch.depth_chi2.push_back(scale * scale * point.depth_chi2 / (point.depth_rows - 1));
      batch.depth_rows += point.depth_rows - 1;
    }
    feature.r += feature.H * moved;
    const Innovation innovation = testInnovation(filter_.R(), feature.H, feature.r);
    if (!(innovation.distance < gate_.threshold(dof))) {
      ++batch.gated;
      continue;
    }
    // A patch that slides with the motion (crossing edges at different depths) looks like another motion: spread over
    // two dozen rows that passes any gate, but it biases the few directions of the state that the feature measures.
    const double weight = huberWeight(innovation.distance / dof, kHuberSigmas) *
                          huberWeight(innovation.pull / innovation.expected_pull, options_.pull_huber);
    if (weight < 1) {
      feature.H *= std::sqrt(weight);
      feature.r *= std::sqrt(weight);
    }
    batch.rows += dof;
    batch.accepted.push_back(std::move(feature));
  }
  return batch;
}

UpdateResult VioFilter::apply(FeatureBatch& batch) {
  if (batch.rows == 0) return {};
  Eigen::MatrixXd H;
  Eigen::VectorXd h;
  stackStaircase(batch.accepted, batch.rows, &H, &h);
  return filter_.update(H, h);
}

UpdateResult VioFilter::updateRelinearised(const std::vector<Candidate>& candidates, FeatureBatch* batch) {
  const SquareRootFilter prior = filter_;
  WindowState at = prior.window();
  UpdateResult result;
  result.delta = Eigen::VectorXd::Zero(at.dimension());
  for (int pass = 0; pass < kPasses; ++pass) {
    const Eigen::VectorXd moved = result.delta;
    filter_ = prior;
    *batch = judgeFeatures(candidates, at, moved, pass == 0 ? OwnNoise::kBeyondState : OwnNoise::kResiduals);
    result = apply(*batch);
    if (!result.ok) break;
    filter_.relinearise();
    at = filter_.window();
  }
  // Rows of before have other first estimates: together they say more of the scale than there is.
  motion_unmeasured_ = nav().t;
  return result;
}

void VioFilter::updateWithFeatures(const std::vector<Candidate>& candidates, bool after_step, StepReport* report) {
  const Eigen::VectorXd here = Eigen::VectorXd::Zero(filter_.window().dimension());
  // After a velocity step the poses themselves are wrong: the residuals are not the features' own noise.
  FeatureBatch batch =
      judgeFeatures(candidates, filter_.window(), here, after_step ? OwnNoise::kNone : OwnNoise::kResiduals);
  // The covariance is asked for only when some feature has noise of its own, which is rare.
  // Beyond the noise, residuals at the present poses are mainly due to the velocity, as when points come back after a
  // stretch on the IMU alone.
  const bool open =
      std::isfinite(batch.nearest_noisy) && openPixels() > kGateSigmas * options_.sigma_px * batch.nearest_noisy;
  const UpdateResult result = open ? updateRelinearised(candidates, &batch) : apply(batch);
  tell(&noise_, std::move(batch.chi2), batch.chi2_rows);
  tell(&depth_noise_, std::move(batch.depth_chi2), batch.depth_rows);
  report->features_tried = batch.tried;
  report->features_gated = batch.gated;
  if (batch.rows == 0) return;
  report->features_used = static_cast<int>(batch.accepted.size());
  report->rows = batch.rows;
  report->nis = result.nis;
  report->healthy = report->healthy && result.ok;
}

}  // namespace vip_slam
