// SPDX-License-Identifier: BSD-3-Clause
#include "homography_hosts.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "vip_slam_backend/factors/homography.h"

namespace vip_slam {
namespace {

// A landmark and its view in a frame that could host it.
struct Candidate {
  int landmark = 0, view = 0;
};

void shareHosts(const LandmarkViews& views, const std::vector<int>& landmarks, const std::vector<char>& good,
                int frames, std::vector<int>* hosts) {
  std::vector<int> left(frames, 0), start(frames + 1, 0);  // landmarks still without host that a frame sees well
  for (const int l : landmarks)
    for (const LandmarkView* v = views.begin(l); v != views.end(l); ++v)
      if (good[views.first(l) + (v - views.begin(l))]) ++left[v->frame];
  for (int f = 0; f < frames; ++f) start[f + 1] = start[f] + left[f];
  std::vector<Candidate> candidates(start.back());
  std::vector<int> next(start.begin(), start.end() - 1);
  for (const int l : landmarks)
    for (const LandmarkView* v = views.begin(l); v != views.end(l); ++v) {
      const int view = static_cast<int>(v - views.begin(l));
      if (good[views.first(l) + view]) candidates[next[v->frame]++] = {l, view};
    }
  std::priority_queue<std::pair<int, int>> queue;
  for (int f = 0; f < frames; ++f)
    if (left[f] > 0) queue.emplace(left[f], f);
  while (!queue.empty()) {
    const auto [count, frame] = queue.top();
    queue.pop();
    if (count != left[frame]) {  // outdated: other hosts took some of its landmarks
      if (left[frame] > 0) queue.emplace(left[frame], frame);
      continue;
    }
    for (int c = start[frame]; c < start[frame + 1]; ++c) {
      const int l = candidates[c].landmark;
      if ((*hosts)[l] >= 0) continue;
      (*hosts)[l] = candidates[c].view;
      for (const LandmarkView* v = views.begin(l); v != views.end(l); ++v)
        if (good[views.first(l) + (v - views.begin(l))]) --left[v->frame];
    }
  }
}

// A plane as one frame sees it: normal in the camera's axes and distance of the camera.
struct SeenPlane {
  Eigen::Vector3d n_C = Eigen::Vector3d::Zero();
  double distance = 0;
  bool known = false;
};

// Removes the first and the last third of a track's views from its possible hosts.
void leaveMiddle(const LandmarkViews& views, int landmark, std::vector<char>* good) {
  const int first = views.first(landmark), end = first + static_cast<int>(views.end(landmark) - views.begin(landmark));
  const int count = static_cast<int>(std::count(good->begin() + first, good->begin() + end, 1));
  const int outside = (count - 1) / 3;
  for (int v = first, k = 0; v < end; ++v) {
    if (!(*good)[v]) continue;
    if (k < outside || k >= count - outside) (*good)[v] = 0;
    ++k;
  }
}

}  // namespace

std::vector<int> chooseHosts(const LandmarkViews& views, const std::vector<int>& plane,
                             const std::vector<BaPlane>& planes, const std::vector<FrameGeometry>& geometry,
                             bool shared, bool middle) {
  std::vector<int> hosts(views.size(), -1);
  std::vector<char> good(views.viewCount(), 0);
  std::vector<int> on_plane;
  std::vector<SeenPlane> seen(planes.size() * geometry.size());
  for (int l = 0; l < views.size(); ++l) {
    if (plane[l] < 0) continue;
    on_plane.push_back(l);
    for (const LandmarkView* v = views.begin(l); v != views.end(l); ++v) {
      const int view = static_cast<int>(v - views.begin(l));
      SeenPlane& plane_seen = seen[plane[l] * geometry.size() + v->frame];
      if (!plane_seen.known) {
        const FrameGeometry& g = geometry[v->frame];
        const Plane& p = planes[plane[l]].plane;
        plane_seen = {g.R_C_W * p.n, p.signedDistance(g.t_W_C), true};
      }
      if (!v->own_track || !mayHost(plane_seen.n_C, plane_seen.distance, v->xy.cast<double>())) continue;
      good[views.first(l) + view] = 1;
      if (hosts[l] < 0 && !shared) hosts[l] = view;
    }
    if (shared && middle) leaveMiddle(views, l, &good);
  }
  if (shared) shareHosts(views, on_plane, good, static_cast<int>(geometry.size()), &hosts);
  return hosts;
}

}  // namespace vip_slam
