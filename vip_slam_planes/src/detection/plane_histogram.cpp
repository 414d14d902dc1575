// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_planes/detection/plane_histogram.h"

#include <algorithm>
#include <cmath>

namespace vip_slam {

PlaneHistogram::PlaneHistogram(double height_bin, double distance_bin, double angle_bin_deg)
    : height_bin_(height_bin),
      distance_bin_(distance_bin),
      angles_(std::max(8, static_cast<int>(std::lround(360.0 / angle_bin_deg)))) {
  angle_bin_ = 2 * M_PI / angles_;
}

void PlaneHistogram::clear() {
  bins_.clear();
  index_.clear();
  votes_.clear();
}

std::uint64_t PlaneHistogram::key(int space, int angle, int distance) {
  return (std::uint64_t(space) << 56) | (std::uint64_t(std::uint32_t(angle) & 0xffffffu) << 32) |
         std::uint64_t(std::uint32_t(distance));
}

std::size_t PlaneHistogram::binAt(int space, int angle, int distance) {
  const std::uint64_t k = key(space, angle, distance);
  const auto it = index_.find(k);
  if (it != index_.end()) return it->second;
  Bin fresh{space, angle, distance, 0, 0, {}, {}};
  const std::size_t own = bins_.size();
  index_.emplace(k, own);
  const int reach = space == 2 ? 1 : 0;
  for (int a = -reach; a <= reach; ++a) {
    for (int d = -1; d <= 1; ++d) {
      const auto other = index_.find(key(space, reach ? (angle + a + angles_) % angles_ : 0, distance + d));
      if (other == index_.end()) continue;
      fresh.near.push_back(other->second);
      if (other->second == own) continue;
      fresh.neighbourhood += bins_[other->second].area;
      bins_[other->second].near.push_back(own);
    }
  }
  bins_.push_back(std::move(fresh));
  return own;
}

void PlaneHistogram::add(int space, int angle, int distance, double area, int index) {
  const std::size_t at = binAt(space, angle, distance);
  for (std::size_t k : bins_[at].near) bins_[k].neighbourhood += area;
  bins_[at].area += area;
  bins_[at].members.push_back(index);
  if (votes_.size() <= std::size_t(index)) votes_.resize(index + 1);
  votes_[index] = {at, area};
}

void PlaneHistogram::addHorizontal(const Eigen::Vector3d& n, const Eigen::Vector3d& p, double area, int index) {
  add(n.z() > 0 ? 0 : 1, 0, static_cast<int>(std::floor(p.z() / height_bin_)), area, index);
}

void PlaneHistogram::addVertical(const Eigen::Vector3d& n, const Eigen::Vector3d& p, double area, int index) {
  const double length = std::hypot(n.x(), n.y());
  const double d = -(n.x() * p.x() + n.y() * p.y()) / length;
  const int angle = static_cast<int>(std::floor(std::atan2(n.y(), n.x()) / angle_bin_ + angles_)) % angles_;
  add(2, angle, static_cast<int>(std::floor(d / distance_bin_)), area, index);
}

PlaneHistogram::Peak PlaneHistogram::peak() {
  const auto highest = std::max_element(bins_.begin(), bins_.end(),
                                        [](const Bin& a, const Bin& b) { return a.neighbourhood < b.neighbourhood; });
  Peak peak;
  if (highest == bins_.end()) return peak;
  for (std::size_t k : highest->near) {
    peak.members.insert(peak.members.end(), bins_[k].members.begin(), bins_[k].members.end());
  }
  if (peak.members.empty()) return peak;
  peak.area = highest->neighbourhood;
  std::sort(peak.members.begin(), peak.members.end());
  return peak;
}

void PlaneHistogram::remove(int index) {
  if (std::size_t(index) >= votes_.size() || votes_[index].bin == kNoBin) return;
  Bin& own = bins_[votes_[index].bin];
  const double area = votes_[index].area;
  for (std::size_t k : own.near) bins_[k].neighbourhood -= area;
  own.area -= area;
  own.members.erase(std::find(own.members.begin(), own.members.end(), index));
  votes_[index] = Vote();
}

}  // namespace vip_slam
