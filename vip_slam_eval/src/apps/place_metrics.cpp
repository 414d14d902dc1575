// rosrun vip_slam_eval place_metrics --map M.vsm --truth T.tum [--query Q.vsm --query-truth QT.tum]
// Judges loops (right or wrong, revisits closed) of a stored map, and relocalisation of another session in it.
#include <cstdio>
#include <iostream>
#include <set>

#include <Eigen/Geometry>

#include "vip_slam_backend/loop/loop_closer.h"
#include "vip_slam_backend/map_io/map_file.h"
#include "vip_slam_backend/relocalisation/relocaliser.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/trajectory/tum_io.h"
#include "vip_slam_core/util/command_line.h"
#include "vip_slam_core/util/options.h"

namespace {

using namespace vip_slam;

constexpr double kRevisitSeconds = 30, kRevisitMetres = 2, kRevisitAngle = 30 * M_PI / 180;
constexpr double kWrongMetres = 0.3, kWrongAngle = 5 * M_PI / 180;

/// Keyframes with their true poses; those outside the truth are left out.
std::map<KeyframeId, SE3> truePoses(const Map& map, const Trajectory& truth) {
  std::map<KeyframeId, SE3> poses;
  for (const auto& entry : map.keyframes()) {
    const TrackedFrame& frame = entry.second.data->frame;
    SE3 T;
    if (poseAt(truth, frame.t + frame.time_offset, &T)) poses[entry.first] = T;
  }
  return poses;
}

bool samePlace(const SE3& a, const SE3& b) {
  return (a.t() - b.t()).norm() <= kRevisitMetres && a.rotation().angularDistance(b.rotation()) <= kRevisitAngle;
}

void judgeLoops(const StoredMap& stored, const std::map<KeyframeId, SE3>& truth) {
  int wrong = 0, judged = 0;
  for (const auto& loop : stored.loops) {
    if (!truth.count(loop.first) || !truth.count(loop.second)) continue;
    ++judged;
    const SE3 found =
        stored.map.keyframe(loop.second).state.T_W_I.inverse() * stored.map.keyframe(loop.first).state.T_W_I;
    const SE3 error = (truth.at(loop.second).inverse() * truth.at(loop.first)).inverse() * found;
    const double angle = Eigen::AngleAxisd(error.rotation()).angle();
    const bool bad = error.t().norm() > kWrongMetres || angle > kWrongAngle;
    wrong += bad;
    std::printf("loop %5lu -> %5lu  error %.3f m %.2f deg%s\n", static_cast<unsigned long>(loop.first),
                static_cast<unsigned long>(loop.second), error.t().norm(), angle * 180 / M_PI, bad ? "  WRONG" : "");
  }
  std::printf("loops judged %d, wrong %d\n", judged, wrong);
}

void judgeRevisits(const StoredMap& stored, const std::map<KeyframeId, SE3>& truth) {
  const Map& map = stored.map;
  const auto stamp = [&map](KeyframeId id) { return map.keyframe(id).data->frame.t; };
  std::set<KeyframeId> closed;  // share landmarks with, or are looped to, a keyframe seen long before
  for (const auto& entry : truth) {
    for (const auto& neighbour : map.covisible(entry.first, 10))
      if (stamp(entry.first) - stamp(neighbour.first) >= kRevisitSeconds) closed.insert(entry.first);
  }
  for (const auto& loop : stored.loops) closed.insert(loop.first);
  int revisits = 0, found = 0, episodes = 0, episodes_closed = 0;
  bool open = false, episode_found = false;
  double last = -1e9;
  const auto endEpisode = [&] {
    if (open) {
      ++episodes;
      episodes_closed += episode_found;
    }
    open = episode_found = false;
  };
  for (const auto& entry : truth) {
    bool revisit = false;
    for (const auto& other : truth)
      if (stamp(entry.first) - stamp(other.first) >= kRevisitSeconds && samePlace(entry.second, other.second))
        revisit = true;
    if (!revisit) continue;
    if (stamp(entry.first) - last > 3.0) endEpisode();
    open = true;
    last = stamp(entry.first);
    ++revisits;
    found += closed.count(entry.first) != 0;
    episode_found |= closed.count(entry.first) != 0;
  }
  endEpisode();
  std::printf("revisiting keyframes %d, tied to the old ones %d (%.0f %%)\n", revisits, found,
              revisits ? 100.0 * found / revisits : 100.0);
  std::printf("revisits (runs of them) %d, closed %d (%.0f %%)\n", episodes, episodes_closed,
              episodes ? 100.0 * episodes_closed / episodes : 100.0);
}

/// The map's frame in the frame of the truth: yaw and position, least squares over keyframes.
SE3 alignMap(const Map& map, const std::map<KeyframeId, SE3>& truth) {
  Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = a;
  for (const auto& entry : truth) {
    a += map.keyframe(entry.first).state.T_W_I.t();
    b += entry.second.t();
  }
  a /= static_cast<double>(truth.size());
  b /= static_cast<double>(truth.size());
  double sine = 0, cosine = 0;
  for (const auto& entry : truth) {
    const Eigen::Vector3d p = map.keyframe(entry.first).state.T_W_I.t() - a, q = entry.second.t() - b;
    cosine += p.x() * q.x() + p.y() * q.y();
    sine += p.x() * q.y() - p.y() * q.x();
  }
  const Eigen::Quaterniond R(Eigen::AngleAxisd(std::atan2(sine, cosine), Eigen::Vector3d::UnitZ()));
  return SE3(R, b - R * a);
}

void judgeRelocalisation(const StoredMap& stored, const std::map<KeyframeId, SE3>& truth, const StoredMap& query,
                         const Trajectory& query_truth, const SensorConfig& sensor, const LoopOptions& options,
                         bool list) {
  LoopCloser places(options, makeCamera(sensor.camera));
  places.rebuild(stored.map, stored.loops);
  const Relocaliser relocaliser(options.relocalisation);
  const SE3 T_truth_map = alignMap(stored.map, truth);
  const auto poses = truePoses(query.map, query_truth);
  struct Try {
    KeyframeId id;
    double t, error;
    bool mapped, found, right;
    std::string reason;
    int inliers;
    SE3 T_W_I;
  };
  std::vector<Try> tries;
  std::vector<double> errors;
  for (const auto& entry : poses) {
    Try attempt{entry.first, query.map.keyframe(entry.first).data->frame.t, 0, false, false, false, "", 0, SE3()};
    for (const auto& other : truth) attempt.mapped |= samePlace(entry.second, other.second);
    const auto found =
        relocaliser.relocalise(stored.map, places, *query.map.keyframe(entry.first).data, {}, &attempt.reason);
    if (found) {
      attempt.error = ((T_truth_map * found->T_W_I).t() - entry.second.t()).norm();
      attempt.found = true;
      attempt.inliers = found->inliers;
      attempt.T_W_I = found->T_W_I;
      attempt.right = attempt.error <= 0.03;
      errors.push_back(attempt.error);
      attempt.reason = std::to_string(found->inliers) + " inliers with " + std::to_string(found->match);
    }
    if (list && (attempt.mapped || attempt.found))
      std::printf("query %5lu  t %.2f  %s  %s  %.3f m  %s\n", static_cast<unsigned long>(attempt.id), attempt.t,
                  attempt.mapped ? "mapped" : "unmapped", attempt.found ? "found" : "missed", attempt.error,
                  attempt.reason.c_str());
    tries.push_back(attempt);
  }
  // Each keyframe at a mapped place begins a trial; the first answer that the system would believe counts.
  int trials = 0, right = 0, wrong = 0, wrong_believed = 0;
  for (std::size_t k = 0; k < tries.size(); ++k) {
    PlaceAgreement agreement;
    for (std::size_t j = k; j < tries.size() && tries[j].t <= tries[k].t + 1.0; ++j) {
      if (!tries[j].found) continue;
      const bool agrees = agreement.add(query.map.keyframe(tries[j].id).data->frame, tries[j].T_W_I);
      if (!agrees && tries[j].inliers < options.relocalisation.sure_inliers) continue;
      right += tries[k].mapped && tries[j].right;
      wrong_believed += tries[j].error > kWrongMetres;
      break;
    }
    trials += tries[k].mapped;
  }
  for (const double e : errors) wrong += e > kWrongMetres;
  std::sort(errors.begin(), errors.end());
  const double median = errors.empty() ? 0 : errors[errors.size() / 2];
  std::printf("relocalisation: %zu keyframes tried, %zu found, median error %.4f m, wrong (> 0.3 m) %d, believed %d\n",
              tries.size(), errors.size(), median, wrong, wrong_believed);
  std::printf("trials at mapped places %d, within 1 s and 3 cm %d (%.1f %%)\n", trials, right,
              trials ? 100.0 * right / trials : 100.0);
}

}  // namespace

int main(int argc, char** argv) {
  vip_slam::CommandLine line("place_metrics", "Judges loops and relocalisation of stored maps against ground truth.");
  std::string map, truth, query, query_truth, sensor;
  std::vector<std::string> settings;
  bool list = false;
  line.option("map", map, "map.vsm of a run");
  line.required("map");
  line.option("truth", truth, "true trajectory of that run, TUM");
  line.required("truth");
  line.option("query", query, "map.vsm of another session in the same place");
  line.option("query-truth", query_truth, "its true trajectory, TUM");
  line.option("sensor", sensor, "sensor YAML with intrinsics, for relocalisation");
  line.option("set", settings, "option of relocalisation as key=value (`loop/` of the back end); repeatable");
  line.flag("list", list, "one line per keyframe at a mapped place or found");
  line.needs("query", "query-truth");
  line.needs("query", "sensor");
  if (const auto status = line.parse(argc, argv)) return *status;
  try {
    vip_slam::LoopOptions options;
    std::vector<std::pair<std::string, std::string>> values;
    for (const std::string& setting : settings) {
      const auto equals = std::min(setting.find('='), setting.size() - 1);
      values.emplace_back(setting.substr(0, equals), setting.substr(equals + 1));
    }
    vip_slam::setOptions(options, values);
    const vip_slam::StoredMap stored = vip_slam::loadMapFile(map, vip_slam::ImuNoise());
    const auto poses = truePoses(stored.map, vip_slam::readTum(truth));
    judgeLoops(stored, poses);
    judgeRevisits(stored, poses);
    if (!query.empty())
      judgeRelocalisation(stored, poses, vip_slam::loadMapFile(query, vip_slam::ImuNoise()),
                          vip_slam::readTum(query_truth), vip_slam::loadSensorConfig(sensor), options, list);
  } catch (const std::exception& error) {
    std::cerr << "place_metrics: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
