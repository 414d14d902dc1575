// SPDX-License-Identifier: BSD-3-Clause
#include "system_structure.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace vip_slam {
namespace {

class Hash {
 public:
  void add(std::int64_t v) {
    value_ ^= static_cast<std::uint64_t>(v) + 0x9e3779b97f4a7c15ull + (value_ << 6) + (value_ >> 2);
    value_ *= 0xff51afd7ed558ccdull;
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0x2545f4914f6cdd1dull;
};

// Pairs of nodes requested by factors, unique, in ascending order of (second, first); and the pair of every request.
struct Requests {
  std::vector<std::pair<int, int>> wanted;  // first < second
  std::vector<int> pair_of;

  // Buckets and marks instead of sorting, since requests far outnumber the pairs.
  std::vector<std::pair<int, int>> unite(int nodes) {
    std::vector<int> begin(nodes + 1, 0), at(wanted.size()), last(nodes, -1), index(nodes, 0);
    for (const auto& w : wanted) ++begin[w.second + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<int> next(begin.begin(), begin.end() - 1);
    for (std::size_t r = 0; r < wanted.size(); ++r) at[next[wanted[r].second]++] = static_cast<int>(r);
    std::vector<std::pair<int, int>> pairs;
    pair_of.resize(wanted.size());
    for (const int r : at) {
      const auto& w = wanted[r];
      if (last[w.first] != w.second) {
        last[w.first] = w.second;
        index[w.first] = static_cast<int>(pairs.size());
        pairs.push_back(w);
      }
      pair_of[r] = index[w.first];
    }
    return pairs;
  }
};

}  // namespace

// Another structure with the same 64-bit hash would be mistaken for this one; the probability of 5e-20 per problem is
// accepted.
std::uint64_t SystemStructure::signature(const BaProblem& problem) const {
  Hash hash;
  hash.add(problem.frames.size());
  for (const BaFrame& f : problem.frames) hash.add(f.fixed * 2 + f.motion);
  hash.add(problem.points.size());
  for (const BaPoint& p : problem.points) hash.add(p.count);
  for (const BaObservation& o : problem.observations) hash.add(o.frame);
  hash.add(problem.planes.size());
  for (const BaImu& f : problem.imu) hash.add(f.i), hash.add(f.j);
  hash.add(-1);
  for (const BaHomography& f : problem.homographies) hash.add(f.i), hash.add(f.j), hash.add(f.plane);
  hash.add(-2);
  for (const BaHomographyPair& f : problem.homography_pairs) hash.add(f.i), hash.add(f.j), hash.add(f.plane);
  hash.add(-3);
  for (const BaPointToPlane& f : problem.point_to_plane) hash.add(f.frame), hash.add(f.plane);
  hash.add(-4);
  for (const BaPlaneSample& f : problem.plane_samples) hash.add(f.frame), hash.add(f.plane);
  hash.add(-5);
  for (const BaRelativePose& f : problem.relative_poses) hash.add(f.i), hash.add(f.j);
  return hash.value();
}

void SystemStructure::orderPoints(const BaProblem& problem) {
  const int points = static_cast<int>(problem.points.size());
  const int frames = static_cast<int>(problem.frames.size());
  std::vector<int> oldest(points, 0), begin(frames + 1, 0);
  for (int p = 0; p < points; ++p) {
    const BaPoint& point = problem.points[p];
    oldest[p] = problem.observations[point.first].frame;
    for (int o = point.first; o < point.first + point.count; ++o)
      oldest[p] = std::min(oldest[p], problem.observations[o].frame);
    ++begin[oldest[p] + 1];
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  point_at.resize(points);
  for (int p = 0; p < points; ++p) point_at[begin[oldest[p]]++] = p;

  std::vector<std::int64_t> rank(frames), views;  // a view: its rank, then its index
  for (int f = 0; f < frames; ++f)
    rank[f] = (pose_node[f] < 0 ? 0 : std::int64_t{1} + cholesky.position(pose_node[f])) << 32;
  const std::size_t count = problem.observations.size();
  sorted.clear();
  sorted.reserve(count);
  std::vector<int> position;  // in the elimination order, of each view; -1: a constant
  position.reserve(count);
  first.assign(1, 0);
  first.reserve(points + 1);
  for (const int p : point_at) {
    const BaPoint& point = problem.points[p];
    views.clear();
    for (int o = point.first; o < point.first + point.count; ++o)
      views.push_back(rank[problem.observations[o].frame] + o);
    std::sort(views.begin(), views.end());
    for (const std::int64_t v : views) {
      sorted.push_back(static_cast<int>(v & 0xffffffff));
      position.push_back(static_cast<int>(v >> 32) - 1);
    }
    first.push_back(static_cast<int>(sorted.size()));
  }
  splitElimination(position);
}

void SystemStructure::splitElimination(const std::vector<int>& position) {
  // A view costs one block for itself and one for each view that is eliminated before it.
  const int points = static_cast<int>(point_at.size());
  std::vector<std::int64_t> work(cholesky.nodes(), 0);
  std::int64_t total = 0;
  for (int p = 0; p < points; ++p) {
    int blocks = 0;
    for (int o = first[p]; o < first[p + 1]; ++o) {
      if (position[o] < 0) continue;
      work[position[o]] += ++blocks;
      total += blocks;
    }
  }
  range_begin[0].assign(first.begin(), first.end() - 1);
  range_begin[kRanges].assign(first.begin() + 1, first.end());
  std::int64_t sum = 0;
  for (int range = 1, begin = 0; range < kRanges; ++range) {
    for (; begin < cholesky.nodes() && kRanges * sum < range * total; ++begin) sum += work[begin];
    range_begin[range] = range_begin[range - 1];
    for (int p = 0; p < points; ++p)
      for (int& o = range_begin[range][p]; o < first[p + 1] && position[o] < begin;) ++o;
  }
  part_begin[0] = 0;
  part_begin[kPointParts] = points;
  for (int part = 1; part < kPointParts; ++part) {
    const int observations = static_cast<int>(sorted.size() * part / kPointParts);
    part_begin[part] = static_cast<int>(std::lower_bound(first.begin(), first.end(), observations) - first.begin());
  }
}

bool SystemStructure::update(const BaProblem& problem) {
  const std::uint64_t now = signature(problem);
  if (valid_ && now == signature_) return false;
  valid_ = false;
  const int frames = static_cast<int>(problem.frames.size());
  std::vector<int> sizes;
  pose_node.assign(frames, -1);
  motion_node.assign(frames, -1);
  plane_node.assign(problem.planes.size(), -1);
  for (int f = 0; f < frames; ++f)
    if (!problem.frames[f].fixed) pose_node[f] = static_cast<int>(sizes.size()), sizes.push_back(6);
  const int poses = static_cast<int>(sizes.size());
  for (int f = 0; f < frames; ++f)
    if (!problem.frames[f].fixed && problem.frames[f].motion)
      motion_node[f] = static_cast<int>(sizes.size()), sizes.push_back(9);
  for (std::size_t p = 0; p < problem.planes.size(); ++p)
    plane_node[p] = static_cast<int>(sizes.size()), sizes.push_back(3);

  // Pairs of poses are collected in a table, the few others as requests.
  std::vector<char> linked(static_cast<std::size_t>(poses) * poses, 0);
  Requests requests;
  const auto link = [&](int a, int b) {
    if (a < 0 || b < 0) return;
    if (a > b) std::swap(a, b);
    if (b < poses)
      linked[static_cast<std::size_t>(a) * poses + b] = 1;
    else
      requests.wanted.emplace_back(a, b);
  };
  std::vector<int> seen;
  for (const BaPoint& p : problem.points) {
    seen.clear();
    for (int o = p.first; o < p.first + p.count; ++o) {
      const int node = pose_node[problem.observations[o].frame];
      if (node >= 0) seen.push_back(node);
    }
    std::sort(seen.begin(), seen.end());
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (i > 0 && seen[i] == seen[i - 1])
        throw std::invalid_argument("bundle adjustment: a point is seen twice by one frame");
      char* row = linked.data() + static_cast<std::size_t>(seen[i]) * poses;
      for (std::size_t j = i + 1; j < seen.size(); ++j) row[seen[j]] = 1;
    }
  }
  for (const BaImu& f : problem.imu) {
    const int nodes[4] = {pose_node[f.i], motion_node[f.i], pose_node[f.j], motion_node[f.j]};
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < a; ++b) link(nodes[a], nodes[b]);
  }
  const auto linkTriple = [&](int i, int j, int plane) {
    link(pose_node[j], pose_node[i]);
    link(plane_node[plane], pose_node[i]);
    link(plane_node[plane], pose_node[j]);
  };
  for (const BaHomography& f : problem.homographies) linkTriple(f.i, f.j, f.plane);
  for (const BaHomographyPair& f : problem.homography_pairs) linkTriple(f.i, f.j, f.plane);
  for (const BaPointToPlane& f : problem.point_to_plane) link(plane_node[f.plane], pose_node[f.frame]);
  for (const BaPlaneSample& f : problem.plane_samples) link(plane_node[f.plane], pose_node[f.frame]);
  for (const BaRelativePose& f : problem.relative_poses) link(pose_node[f.j], pose_node[f.i]);
  std::vector<std::pair<int, int>> pairs = requests.unite(static_cast<int>(sizes.size()));
  const std::size_t others = pairs.size();
  for (int a = 0; a < poses; ++a)
    for (int b = a + 1; b < poses; ++b)
      if (linked[static_cast<std::size_t>(a) * poses + b]) pairs.emplace_back(a, b);
  cholesky.analyze(sizes, pairs);
  if (cholesky.valueCount() > std::numeric_limits<std::uint32_t>::max())
    throw std::invalid_argument("bundle adjustment: the reduced system is too large");

  std::vector<int> frame_of(poses);
  for (int f = 0; f < frames; ++f)
    if (pose_node[f] >= 0) frame_of[pose_node[f]] = f;
  pair_offset.assign(static_cast<std::size_t>(frames) * frames, 0);
  for (std::size_t k = others; k < pairs.size(); ++k) {
    int earlier = pairs[k].first, later = pairs[k].second;
    if (cholesky.position(earlier) > cholesky.position(later)) std::swap(earlier, later);
    pair_offset[static_cast<std::size_t>(frame_of[earlier]) * frames + frame_of[later]] =
        static_cast<std::uint32_t>(cholesky.pairOffset(k));
  }

  // The places must be requested in the same order as the links above.
  std::size_t request = 0;
  const auto placeOf = [&](int row, int column) {
    BlockPlace place;
    if (row < 0 || column < 0) return place;
    place.transposed = cholesky.position(row) < cholesky.position(column);
    if (row < poses && column < poses) {
      const int later = place.transposed ? column : row, earlier = place.transposed ? row : column;
      place.offset = pair_offset[static_cast<std::size_t>(frame_of[earlier]) * frames + frame_of[later]];
    } else {
      place.offset = static_cast<std::int64_t>(cholesky.pairOffset(requests.pair_of[request++]));
    }
    return place;
  };
  imu.assign(problem.imu.size(), {});
  for (std::size_t k = 0; k < imu.size(); ++k) {
    const BaImu& f = problem.imu[k];
    const int nodes[4] = {pose_node[f.i], motion_node[f.i], pose_node[f.j], motion_node[f.j]};
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < a; ++b) imu[k].place[a][b] = placeOf(nodes[a], nodes[b]);
  }
  const auto placeTriple = [&](int i, int j, int plane) {
    TriplePlaces places;  // filled one by one: the order of the calls matters
    places.ji = placeOf(pose_node[j], pose_node[i]);
    places.pi = placeOf(plane_node[plane], pose_node[i]);
    places.pj = placeOf(plane_node[plane], pose_node[j]);
    return places;
  };
  homographies.clear();
  for (const BaHomography& f : problem.homographies) homographies.push_back(placeTriple(f.i, f.j, f.plane));
  homography_pairs.clear();
  for (const BaHomographyPair& f : problem.homography_pairs) homography_pairs.push_back(placeTriple(f.i, f.j, f.plane));
  point_to_plane.clear();
  for (const BaPointToPlane& f : problem.point_to_plane)
    point_to_plane.push_back(placeOf(plane_node[f.plane], pose_node[f.frame]));
  plane_samples.clear();
  for (const BaPlaneSample& f : problem.plane_samples)
    plane_samples.push_back(placeOf(plane_node[f.plane], pose_node[f.frame]));

  relative_poses.clear();
  for (const BaRelativePose& f : problem.relative_poses)
    relative_poses.push_back(placeOf(pose_node[f.j], pose_node[f.i]));

  orderPoints(problem);
  signature_ = now;
  valid_ = true;
  return true;
}

}  // namespace vip_slam
