#include "vip_slam_backend/optimisation/depth_curve_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <map>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

namespace vip_slam {
namespace {

constexpr int kKeyframes = 200;  // the newest ones
constexpr int kLeastKeyframes = 15;
constexpr double kFarthest = 12.0;         // m
constexpr double kEntrySigma = 0.01;       // m, of an entry before anything is known
constexpr double kBendSigma = 0.002;       // m, of an entry against the line between its neighbours
constexpr double kPlaneInformation = 1e2;  // 1/m^2, so that a plane of one point has a place
constexpr double kOutlier = 3.0;           // sigmas, of a loss that forgets what is far off
constexpr double kUneven = 4.0;            // times the usual squared residual: what passes for one plane may be several
constexpr int kRounds = 3;                 // of the weights
constexpr double kKnownSigma = 0.001;      // m: entries below it decide
constexpr int kLeastKnown = 6;             // entries
// Of the root mean square of the entries, what is worth the trouble, m, and how many sigmas; and how far the two
// halves of the planes have to agree.
constexpr double kWorthwhile = 5e-4, kSure = 4.0, kLeastCorrelation = 0.5;

constexpr float kWorthTelling = 0.002f;  // m

using Eigen::MatrixXd;
using Eigen::VectorXd;

using PlaneSet = std::map<PlaneId, const Plane*>;

/// Normal equations of the entries after the planes' elimination, about the entries' present value.
class CurveFit {
 public:
  explicit CurveFit(int entries)
      : entries_(entries), value_(VectorXd::Zero(entries)), H_(MatrixXd::Zero(entries, entries)) {}

  /// One round of Gauss-Newton with the weights of the present value.
  void round(const std::vector<const MapKeyframe*>& keyframes, const PlaneSet& planes) {
    H_.setZero();
    g_ = VectorXd::Zero(entries_);
    std::map<PlaneId, PlaneSystem> systems;
    for (const MapKeyframe* kf : keyframes) {
      const SE3 T_W_C = kf->T_W_C();
      const Eigen::Matrix3d R = T_W_C.R();
      for (const auto& [id, observation] : kf->planes) {
        const auto plane = planes.find(id);
        if (plane == planes.end()) continue;
        PlaneSystem& system = systems.try_emplace(id, entries_).first->second;
        const Plane& surface = *plane->second;
        const Eigen::Vector3d u = surface.n.unitOrthogonal(), v = surface.n.cross(u);
        for (const PlanePoint& point : observation.points) add(point, R, T_W_C.t(), surface, u, v, &system);
      }
    }
    const double usual = usualMisfit(systems);
    double squares = 0, points = 0;
    for (auto& [id, system] : systems) {
      const double trust = std::pow(std::min(1.0, kUneven * usual / std::max(1e-12, system.misfit())), 2);
      squares += trust * system.squares;
      points += trust * system.points;
      system.H.diagonal().array() += kPlaneInformation;
      const Eigen::LDLT<Eigen::Matrix3d> ldlt(system.H);
      H_ += trust * (system.own - system.cross * ldlt.solve(system.cross.transpose()));
      g_ += trust * (system.g_own - system.cross * ldlt.solve(system.g));
    }
    information_ = H_.diagonal();
    addPriors();
    const Eigen::LDLT<MatrixXd> ldlt(H_);
    value_ -= ldlt.solve(g_);
    sigma_ = ldlt.solve(MatrixXd::Identity(entries_, entries_)).diagonal().cwiseMax(0).cwiseSqrt();
    // The points' sigmas allow for errors that all of a keyframe have in common; this is about how they scatter.
    const double scatter = std::max(1e-12, squares / std::max(1.0, points));
    sigma_ *= std::sqrt(scatter);
    information_ /= scatter;
  }

  const VectorXd& value() const { return value_; }
  const VectorXd& sigma() const { return sigma_; }
  const VectorXd& information() const { return information_; }  ///< of each entry, without what is assumed of it

 private:
  /// What a plane's points say of the entries, of the plane's normal (two angles) and distance, and what ties them.
  struct PlaneSystem {
    explicit PlaneSystem(int entries)
        : own(MatrixXd::Zero(entries, entries)), cross(MatrixXd::Zero(entries, 3)), g_own(VectorXd::Zero(entries)) {}
    double misfit() const { return squares / std::max(1.0, points); }
    MatrixXd own, cross;
    VectorXd g_own;
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    double squares = 0, points = 0;  ///< of residuals in sigmas
  };

  /// The median over all points.
  static double usualMisfit(const std::map<PlaneId, PlaneSystem>& systems) {
    std::vector<std::pair<double, double>> list;
    double all = 0, sum = 0;
    for (const auto& [id, system] : systems) {
      list.emplace_back(system.misfit(), system.points);
      all += system.points;
    }
    std::sort(list.begin(), list.end());
    for (const auto& [misfit, points] : list) {
      sum += points;
      if (2 * sum >= all) return misfit;
    }
    return 1.0;
  }

  /// `u`, `v`: along the plane.
  void add(const PlanePoint& point, const Eigen::Matrix3d& R, const Eigen::Vector3d& t, const Plane& plane,
           const Eigen::Vector3d& u, const Eigen::Vector3d& v, PlaneSystem* system) const {
    const double z = point.p_C.z(), k = z / DepthCurve::kStep;
    const int i = static_cast<int>(k);
    if (!(z > 0) || i + 1 >= entries_) return;
    const double share = k - i, shares[2] = {1 - share, share};
    const Eigen::Vector3d ray = R * point.p_C.cast<double>() / z;
    const Eigen::Vector3d p_W = ray * (z + shares[0] * value_(i) + shares[1] * value_(i + 1)) + t;
    const double residual = plane.n.dot(p_W) + plane.d, along = plane.n.dot(ray);
    const double sigma = point.sigma, ratio = residual / (kOutlier * sigma);
    const double weight = 1.0 / (sigma * sigma * (1 + ratio * ratio) * (1 + ratio * ratio));
    const Eigen::Vector3d J(u.dot(p_W), v.dot(p_W), 1.0);
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b) system->own(i + a, i + b) += weight * along * along * shares[a] * shares[b];
      system->g_own(i + a) += weight * along * shares[a] * residual;
      system->cross.row(i + a) += weight * along * shares[a] * J.transpose();
    }
    system->H += weight * J * J.transpose();
    system->g += weight * residual * J;
    if (std::abs(ratio) > 1) return;
    system->squares += residual * residual / (sigma * sigma);
    ++system->points;
  }

  void addPriors() {
    H_.diagonal().array() += 1.0 / (kEntrySigma * kEntrySigma);
    g_ += value_ / (kEntrySigma * kEntrySigma);
    const Eigen::Vector3d bend = Eigen::Vector3d(-0.5, 1.0, -0.5) / kBendSigma;
    for (int i = 0; i + 2 < entries_; ++i) {
      H_.block<3, 3>(i, i) += bend * bend.transpose();
      g_.segment<3>(i) += bend * bend.dot(value_.segment<3>(i));
    }
  }

  int entries_;
  VectorXd value_, sigma_, g_, information_;
  MatrixXd H_;
};

/// Entries without what offset and scale explain, and which of them are known.
struct CurveEstimate {
  VectorXd value, sigma, information;
  std::vector<int> known;
};

CurveEstimate estimateCurve(const std::vector<const MapKeyframe*>& keyframes, const PlaneSet& planes, int entries) {
  CurveFit fit(entries);
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
  if (int(estimate.known.size()) < kLeastKnown) return {};
  const Eigen::Vector2d straight = A.ldlt().solve(b);
  for (int i = 0; i < entries; ++i) estimate.value(i) -= straight.dot(line(i));
  if (!estimate.value.allFinite()) return {};
  return estimate;
}

/// Two sets with about as many points each.
std::pair<PlaneSet, PlaneSet> halves(const std::vector<const MapKeyframe*>& keyframes, const PlaneSet& planes) {
  std::map<PlaneId, std::size_t> points;
  for (const MapKeyframe* kf : keyframes)
    for (const auto& [id, observation] : kf->planes) points[id] += observation.points.size();
  std::vector<std::pair<std::size_t, PlaneId>> order;
  for (const auto& [id, plane] : planes) order.emplace_back(points[id], id);
  std::sort(order.rbegin(), order.rend());
  std::pair<PlaneSet, PlaneSet> both;
  std::size_t first = 0, second = 0;
  for (const auto& [n, id] : order) {
    (first <= second ? both.first : both.second).emplace(id, planes.at(id));
    (first <= second ? first : second) += n;
  }
  return both;
}

/// Of what two estimates say about the entries that both know, besides offset and scale, which differ with where each
/// has its points.
double correlation(const CurveEstimate& a, const CurveEstimate& b) {
  std::vector<int> common;
  std::set_intersection(a.known.begin(), a.known.end(), b.known.begin(), b.known.end(), std::back_inserter(common));
  const auto n = static_cast<Eigen::Index>(common.size());
  if (n < kLeastKnown) return 0.0;
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

std::vector<const MapKeyframe*> newestOfSession(const Map& map) {
  std::vector<const MapKeyframe*> list;
  for (auto it = map.keyframes().rbegin(); it != map.keyframes().rend() && int(list.size()) < kKeyframes; ++it) {
    if (!it->second.stored && !it->second.planes.empty()) list.push_back(&it->second);
  }
  return list;
}

}  // namespace

std::optional<DepthCurve> fitDepthCurve(const Map& map, const DepthNoise& noise) {
  const std::vector<const MapKeyframe*> keyframes = newestOfSession(map);
  if (int(keyframes.size()) < kLeastKeyframes) return std::nullopt;
  PlaneSet planes;
  for (const auto& [id, plane] : map.planes()) planes.emplace(id, &plane.estimate.plane);
  const int entries = 2 + static_cast<int>(std::ceil(std::min(noise.max_range, kFarthest) / DepthCurve::kStep));
  const CurveEstimate found = estimateCurve(keyframes, planes, entries);
  if (found.known.empty()) return std::nullopt;
  double squares = 0, ratios = 0;
  for (const int i : found.known) {
    squares += found.value(i) * found.value(i);
    ratios += std::pow(found.value(i) / found.sigma(i), 2);
  }
  const auto n = static_cast<double>(found.known.size());
  if (squares < n * kWorthwhile * kWorthwhile || ratios < n * kSure * kSure) return std::nullopt;
  // Surfaces that pass for one plane bend the curve as well, but each plane its own way.
  const auto [first, second] = halves(keyframes, planes);
  const double agree = correlation(estimateCurve(keyframes, first, entries), estimateCurve(keyframes, second, entries));
  if (agree < kLeastCorrelation) return std::nullopt;

  // Where few points were read, the less of it the fewer they are; next to nothing is the best guess beyond all.
  DepthCurve curve;
  for (int i = 0; i < entries; ++i) {
    const double said = std::max(0.0, found.information(i)) * squares / n;
    curve.added.push_back(static_cast<float>(found.value(i) * said / (1 + said)));
  }
  return curve;
}

std::string depthCurveDifference(const DepthCurve& found) {
  float most = 0;
  for (const float added : found.added) most = std::max(most, std::abs(added));
  if (most < kWorthTelling) return "";
  char words[200];
  std::snprintf(words, sizeof words,
                "depth is off by up to %.1f mm, at some distances too long and at others too short, which is corrected "
                "for; depth/curve in the sensor's configuration can have it from the start",
                1e3 * double(most));
  return words;
}

}  // namespace vip_slam
