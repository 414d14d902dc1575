#include "system_structure.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <unordered_map>

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

}  // namespace

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
  for (const BaPlanePoint& f : problem.plane_points) hash.add(f.frame), hash.add(f.plane);
  hash.add(-5);
  for (const BaMotionPrior& f : problem.motion_priors) hash.add(f.frame);
  return hash.value();
}

void SystemStructure::orderPoints(const BaProblem& problem) {
  const int points = static_cast<int>(problem.points.size());
  std::vector<int> oldest(points, 0);
  for (int p = 0; p < points; ++p) {
    const BaPoint& point = problem.points[p];
    for (int o = point.first; o < point.first + point.count; ++o) {
      const int frame = problem.observations[o].frame;
      oldest[p] = o == point.first ? frame : std::min(oldest[p], frame);
    }
  }
  point_at.resize(points);
  std::iota(point_at.begin(), point_at.end(), 0);
  std::stable_sort(point_at.begin(), point_at.end(), [&](int a, int b) { return oldest[a] < oldest[b]; });

  const auto rank = [&](int o) {
    const int node = pose_node[problem.observations[o].frame];
    return node < 0 ? -1 : cholesky.position(node);
  };
  sorted.clear();
  first.assign(1, 0);
  for (const int p : point_at) {
    const BaPoint& point = problem.points[p];
    for (int o = point.first; o < point.first + point.count; ++o) sorted.push_back(o);
    std::stable_sort(sorted.begin() + first.back(), sorted.end(), [&](int a, int b) { return rank(a) < rank(b); });
    first.push_back(static_cast<int>(sorted.size()));
  }
}

void SystemStructure::splitElimination(const BaProblem& problem) {
  // A view costs one block for itself and each that is eliminated before it.
  std::vector<std::int64_t> work(cholesky.nodes(), 0);
  std::int64_t total = 0;
  for (std::size_t p = 0; p < problem.points.size(); ++p) {
    int blocks = 0;
    for (int o = first[p]; o < first[p + 1]; ++o) {
      const int node = pose_node[problem.observations[sorted[o]].frame];
      if (node < 0) continue;
      work[cholesky.position(node)] += ++blocks;
      total += blocks;
    }
  }
  half_position = 0;
  for (std::int64_t sum = 0; half_position < cholesky.nodes() && 2 * sum < total; ++half_position)
    sum += work[half_position];
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

  // Pairs: poses among each other in a bit table, the few others in a list.
  std::vector<char> linked(static_cast<std::size_t>(poses) * poses, 0);
  std::vector<std::pair<int, int>> pairs;
  const auto link = [&](int a, int b) {
    if (a < 0 || b < 0 || a == b) return;
    if (a > b) std::swap(a, b);
    if (b < poses)
      linked[static_cast<std::size_t>(a) * poses + b] = 1;
    else
      pairs.emplace_back(a, b);
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
    link(pose_node[i], pose_node[j]);
    link(pose_node[i], plane_node[plane]);
    link(pose_node[j], plane_node[plane]);
  };
  for (const BaHomography& f : problem.homographies) linkTriple(f.i, f.j, f.plane);
  for (const BaHomographyPair& f : problem.homography_pairs) linkTriple(f.i, f.j, f.plane);
  for (const BaPointToPlane& f : problem.point_to_plane) link(pose_node[f.frame], plane_node[f.plane]);
  for (const BaPlanePoint& f : problem.plane_points) link(pose_node[f.frame], plane_node[f.plane]);
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
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
  std::vector<std::pair<std::pair<int, int>, std::size_t>> other_offsets;
  for (std::size_t k = 0; k < others; ++k) other_offsets.push_back({pairs[k], cholesky.pairOffset(k)});

  const auto placeOf = [&](int row, int column) {
    BlockPlace place;
    if (row < 0 || column < 0) return place;
    place.transposed = cholesky.position(row) < cholesky.position(column);
    if (row < poses && column < poses) {
      const int later = place.transposed ? column : row, earlier = place.transposed ? row : column;
      place.offset = pair_offset[static_cast<std::size_t>(frame_of[earlier]) * frames + frame_of[later]];
    } else {
      const std::pair<int, int> key(std::min(row, column), std::max(row, column));
      const auto it = std::lower_bound(other_offsets.begin(), other_offsets.end(), key,
                                       [](const auto& entry, const auto& k) { return entry.first < k; });
      place.offset = static_cast<std::int64_t>(it->second);
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
    return TriplePlaces{placeOf(pose_node[j], pose_node[i]), placeOf(plane_node[plane], pose_node[i]),
                        placeOf(plane_node[plane], pose_node[j])};
  };
  homographies.clear();
  for (const BaHomography& f : problem.homographies) homographies.push_back(placeTriple(f.i, f.j, f.plane));
  homography_pairs.clear();
  for (const BaHomographyPair& f : problem.homography_pairs) homography_pairs.push_back(placeTriple(f.i, f.j, f.plane));
  point_to_plane.clear();
  for (const BaPointToPlane& f : problem.point_to_plane)
    point_to_plane.push_back(placeOf(plane_node[f.plane], pose_node[f.frame]));
  plane_points.clear();
  for (const BaPlanePoint& f : problem.plane_points)
    plane_points.push_back(placeOf(plane_node[f.plane], pose_node[f.frame]));

  orderPoints(problem);
  splitElimination(problem);
  signature_ = now;
  valid_ = true;
  return true;
}

}  // namespace vip_slam
