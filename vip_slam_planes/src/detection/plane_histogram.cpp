#include "vip_slam_planes/detection/plane_histogram.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {

PlaneHistogram::PlaneHistogram(double distance_bin, double angle_bin_deg)
    : distance_bin_(distance_bin), angles_(std::max(8, static_cast<int>(std::lround(360.0 / angle_bin_deg)))) {
  angle_bin_ = 2 * M_PI / angles_;
}

void PlaneHistogram::clear() {
  bins_.clear();
  votes_.clear();
  vote_of_.clear();
}

std::uint64_t PlaneHistogram::key(int space, int angle, int distance) {
  return (std::uint64_t(space) << 56) | (std::uint64_t(std::uint32_t(angle) & 0xffffffu) << 32) |
         std::uint64_t(std::uint32_t(distance));
}

void PlaneHistogram::add(const Vote& vote, int index) {
  bins_[key(vote.space, vote.angle, vote.distance)] += vote.area;
  vote_of_[index] = votes_.size();
  votes_.emplace_back(index, vote);
}

void PlaneHistogram::addHorizontal(const Eigen::Vector3d& n, const Eigen::Vector3d& p, double area, int index) {
  add({n.z() > 0 ? 0 : 1, 0, static_cast<int>(std::floor(p.z() / distance_bin_)), area}, index);
}

void PlaneHistogram::addVertical(const Eigen::Vector3d& n, const Eigen::Vector3d& p, double area, int index) {
  const double length = std::hypot(n.x(), n.y());
  const double d = -(n.x() * p.x() + n.y() * p.y()) / length;
  const int angle = static_cast<int>(std::floor(std::atan2(n.y(), n.x()) / angle_bin_ + angles_)) % angles_;
  add({2, angle, static_cast<int>(std::floor(d / distance_bin_)), area}, index);
}

template <class F>
void PlaneHistogram::forNeighbours(int space, int angle, int distance, F f) const {
  const int reach = space == 2 ? 1 : 0;
  for (int a = -reach; a <= reach; ++a) {
    for (int d = -1; d <= 1; ++d) f(space == 2 ? (angle + a + angles_) % angles_ : 0, distance + d);
  }
}

PlaneHistogram::Peak PlaneHistogram::peak() const {
  // Scanned in the order of the votes, not of the hash table, so that ties break the same way everywhere.
  Peak best;
  const Vote* at = nullptr;
  std::unordered_map<std::uint64_t, bool> seen;
  for (const auto& [index, vote] : votes_) {
    if (vote.area <= 0 || !seen.emplace(key(vote.space, vote.angle, vote.distance), true).second) continue;
    double sum = 0;
    forNeighbours(vote.space, vote.angle, vote.distance, [&](int a, int d) {
      const auto it = bins_.find(key(vote.space, a, d));
      if (it != bins_.end()) sum += it->second;
    });
    if (sum > best.area) {
      best.area = sum;
      at = &vote;
    }
  }
  if (!at) return best;
  for (const auto& [index, vote] : votes_) {
    if (vote.area <= 0 || vote.space != at->space) continue;
    bool near = false;
    forNeighbours(at->space, at->angle, at->distance,
                  [&](int a, int d) { near = near || (a == vote.angle && d == vote.distance); });
    if (near) best.members.push_back(index);
  }
  return best;
}

void PlaneHistogram::remove(int index) {
  const auto it = vote_of_.find(index);
  if (it == vote_of_.end()) return;
  Vote& vote = votes_[it->second].second;
  bins_[key(vote.space, vote.angle, vote.distance)] -= vote.area;
  vote.area = 0;
  vote_of_.erase(it);
}

}  // namespace vip_slam
