// The filter's update with features: which tracks, their rows, how far each may be believed.
#include <algorithm>
#include <cmath>

#include "vip_slam_frontend/filter/feature_rows.h"
#include "vip_slam_frontend/filter/triangular_solve.h"
#include "vip_slam_frontend/filter/triangulation.h"
#include "vip_slam_frontend/filter/vio_filter.h"

namespace vip_slam {

namespace {

// Up to here a sensor is as good as its model says.
constexpr double kWorseThanModel = 1.1;

/// Tells a monitor the median of what the features left over per degree of freedom, and the rows behind it.
void tell(NoiseMonitor* monitor, std::vector<double>& chi2, int rows) {
  if (chi2.size() < 3) return;
  // The median of a chi-square per degree of freedom with the usual dozen of rows lies some 5 % below its mean.
  std::nth_element(chi2.begin(), chi2.begin() + chi2.size() / 2, chi2.end());
  monitor->add(1.05 * chi2[chi2.size() / 2], rows);
}

/// All features' rows, those that begin further right below: what the triangularisation likes best.
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
  const CloneId oldest = filter_.window().clones.front().id;
  for (auto& entry : tracks_) {
    const auto& observations = entry.second.observations;
    const bool lost = observations.back().clone != id;
    const bool leaving = window_full && observations.front().clone == oldest;
    if ((lost || leaving || all) && observations.size() >= 2) candidates.push_back({&entry.second, lost});
  }
  // Long tracks say most. Ties go by id, so that two runs agree.
  std::stable_sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.track->observations.size() > b.track->observations.size();
  });
  return candidates;
}

double VioFilter::ownNoise(const Triangulation& point) const {
  const int dof = point.pixel_rows - 3;
  if (!options_.own_noise || dof <= 0 || point.pixel_chi2 < explained_.threshold(dof)) return 1.0;
  return point.pixel_chi2 / dof;
}

double VioFilter::depthScale() const {
  // Errors of a depth camera last longer than those between images: what scatters less is not more exact.
  return depth_noise_.sigma() > kWorseThanModel ? depth_noise_.sigma() : 1.0;
}

void VioFilter::updateWithFeatures(const std::vector<Candidate>& candidates, bool after_step, StepReport* report) {
  const WindowState& window = filter_.window();
  MeasurementNoise noise;
  noise.sigma_xy = noise_.sigma() / focal_;
  noise.depth_inflation = options_.depth_inflation * depthScale();
  noise.use_depth = options_.use_depth;

  std::vector<FeatureRows> accepted;
  std::vector<double> chi2, depth_chi2;
  int rows = 0, chi2_rows = 0, depth_rows = 0;
  for (const Candidate& candidate : candidates) {
    if (static_cast<int>(accepted.size()) >= options_.max_update_features) break;
    ++report->features_tried;
    const auto& observations = candidate.track->observations;
    const Triangulation point = triangulate(window, observations, noise);
    if (!point.ok) continue;
    MeasurementNoise row_noise = noise;
    // Points seen from poses that are wrong together leave residuals that are none of their own.
    row_noise.sigma_xy *= options_.pixel_inflation * (after_step ? 1.0 : ownNoise(point));
    FeatureRows feature = featureRows(window, observations, point.p_W, row_noise);
    const int dof = static_cast<int>(feature.r.size());
    if (dof == 0) continue;
    if (point.pixel_rows >= 10) {
      chi2.push_back(point.pixel_chi2 / (point.pixel_rows - 3));
      chi2_rows += point.pixel_rows - 3;
    }
    if (point.depth_rows >= 5) {
      const double scale = depthScale() / depth_noise_.sigma();  // of what they were whitened by
      depth_chi2.push_back(scale * scale * point.depth_chi2 / (point.depth_rows - 1));
      depth_rows += point.depth_rows - 1;
    }
    const Innovation innovation = testInnovation(filter_.R(), feature.H, feature.r);
    if (!(innovation.distance < gate_.threshold(dof))) {
      ++report->features_gated;
      continue;
    }
    // A patch that creeps along with the motion (two edges at different depths that meet) explains all its residuals by
    // another motion: among two dozen rows that passes any gate, but it pulls at the few directions of the state that
    // the feature measures.
    const double weight = huberWeight(innovation.distance / dof, options_.huber) *
                          huberWeight(innovation.pull / innovation.expected_pull, options_.pull_huber);
    if (weight < 1) {
      feature.H *= std::sqrt(weight);
      feature.r *= std::sqrt(weight);
    }
    rows += dof;
    accepted.push_back(std::move(feature));
  }
  tell(&noise_, chi2, chi2_rows);
  tell(&depth_noise_, depth_chi2, depth_rows);
  if (rows == 0) return;
  Eigen::MatrixXd H;
  Eigen::VectorXd h;
  stackStaircase(accepted, rows, &H, &h);
  const UpdateResult result = filter_.update(H, h);
  report->features_used = static_cast<int>(accepted.size());
  report->rows = rows;
  report->nis = result.nis;
  report->healthy = report->healthy && result.ok;
}

}  // namespace vip_slam
