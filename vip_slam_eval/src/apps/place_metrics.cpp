// SPDX-License-Identifier: BSD-3-Clause
// rosrun vip_slam_eval place_metrics --map M.vsm --truth T.tum [--query Q.vsm --query-truth QT.tum]
// Evaluates the loops of a stored map (correct or wrong, revisits closed) and relocalisation of another session in it.
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <set>
#include <stdexcept>

#include <Eigen/Geometry>

#include "place_metrics/relocalisation_trials.h"
#include "place_metrics/true_poses.h"
#include "vip_slam_backend/map_io/map_file.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/trajectory/tum_io.h"
#include "vip_slam_core/util/command_line.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/options.h"
#include "vip_slam_ros/sensor_files.h"

namespace {

using namespace vip_slam;

constexpr double kRevisitMetres = 1.5;
constexpr double kWrongMetres = 0.3, kWrongAngle = 5 * kDegree;

/// A share in per cent; "-" when `all` is zero.
std::string percent(int part, int all) { return all > 0 ? formatted("%.1f %%", 100.0 * part / all) : "-"; }

TruePoses posesOf(const Map& map, const std::string& truth) {
  const TruePoses poses = truePoses(map, readTum(truth));
  if (poses.empty())
    throw std::runtime_error(truth + ": no pose at the time of any keyframe of the map, expected the same clock");
  return poses;
}

void judgeLoops(const StoredMap& stored, const TruePoses& truth) {
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
                static_cast<unsigned long>(loop.second), error.t().norm(), angle / kDegree, bad ? "  WRONG" : "");
  }
  std::printf("loops judged %d, wrong %d\n", judged, wrong);
}

/// A revisit is a keyframe at a place that was seen at least `seconds` before.
void judgeRevisits(const StoredMap& stored, const TruePoses& truth, double seconds) {
  const Map& map = stored.map;
  const auto stamp = [&map](KeyframeId id) { return map.keyframe(id).data->frame.t; };
  std::set<KeyframeId> closed;  // share landmarks with, or are looped to, a keyframe seen long before
  for (const auto& entry : truth) {
    for (const auto& neighbour : map.covisible(entry.first, 10))
      if (stamp(entry.first) - stamp(neighbour.first) >= seconds) closed.insert(entry.first);
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
      revisit |=
          stamp(entry.first) - stamp(other.first) >= seconds && samePlace(entry.second, other.second, kRevisitMetres);
    if (!revisit) continue;
    if (stamp(entry.first) - last > 3.0) endEpisode();
    open = true;
    last = stamp(entry.first);
    ++revisits;
    found += closed.count(entry.first) != 0;
    episode_found |= closed.count(entry.first) != 0;
  }
  endEpisode();
  std::printf("revisiting keyframes %d, tied to the old ones %d (%s)\n", revisits, found,
              percent(found, revisits).c_str());
  std::printf("revisits (runs of them) %d, closed %d (%s)\n", episodes, episodes_closed,
              percent(episodes_closed, episodes).c_str());
}

/// A query view counts as mapped when a keyframe of the map within 2 m and 30 degrees sees at least this share of it.
constexpr double kMappedOverlap = 0.5;
constexpr int kFewCorners = 30;
constexpr double kRightMetres = 0.03;

void judgeRelocalisation(const std::vector<RelocalisationTrial>& trials, bool list) {
  int mapped = 0, right = 0, textured = 0, textured_right = 0, found = 0, wrong = 0;
  std::vector<double> errors;
  for (const RelocalisationTrial& trial : trials) {
    const bool is_mapped = trial.view.overlap >= kMappedOverlap;
    const bool is_right = trial.found && trial.error <= kRightMetres;
    const bool is_wrong = trial.found && (trial.error > kWrongMetres || trial.angle > kWrongAngle);
    found += trial.found;
    wrong += is_wrong;
    mapped += is_mapped;
    right += is_mapped && is_right;
    textured += is_mapped && trial.view.corners >= kFewCorners;
    textured_right += is_mapped && trial.view.corners >= kFewCorners && is_right;
    if (trial.found) errors.push_back(trial.error);
    if (list && (is_mapped || trial.found))
      std::printf("trial at %5lu  t %.2f  overlap %.2f, %3d corners  %s after %.2f s  %.3f m%s  %s\n",
                  static_cast<unsigned long>(trial.first), trial.t, trial.view.overlap, trial.view.corners,
                  trial.found ? "found" : "missed", trial.seconds, trial.error, is_wrong ? "  WRONG" : "",
                  trial.reason.c_str());
  }
  std::sort(errors.begin(), errors.end());
  const std::string median = errors.empty() ? "-" : formatted("%.4f m", errors[errors.size() / 2]);
  std::printf("relocalisation: %zu trials, %d found, median error %s, wrong (> 0.3 m or 5 deg) %d\n", trials.size(),
              found, median.c_str(), wrong);
  std::printf("trials at mapped places %d, within 1 s and 3 cm %d (%s)\n", mapped, right,
              percent(right, mapped).c_str());
  std::printf("of these with %d corners of the map in view %d, within 1 s and 3 cm %d (%s)\n", kFewCorners, textured,
              textured_right, percent(textured_right, textured).c_str());
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
  line.option("sensor", sensor, "a shipped sensor or a sensor YAML file, with intrinsics; for relocalisation");
  line.option(
      "set", settings,
      "option of relocalisation, or min_seconds of a revisit, as key=value (`loop/` of the back end); repeatable");
  line.flag("list", list, "one line per keyframe at a mapped place or found");
  line.needs("query", "query-truth");
  line.needs("query-truth", "query");
  line.needs("sensor", "query");
  line.needs("query", "sensor");
  if (const auto status = line.parse(argc, argv)) return *status;
  try {
    vip_slam::LoopOptions options;
    vip_slam::setOptions(options, vip_slam::splitSettings(settings));
    const vip_slam::StoredMap stored = vip_slam::loadMapFile(map, vip_slam::ImuNoise());
    const auto poses = posesOf(stored.map, truth);
    judgeLoops(stored, poses);
    judgeRevisits(stored, poses, options.min_seconds);
    if (!query.empty()) {
      const vip_slam::StoredMap session = vip_slam::loadMapFile(query, vip_slam::ImuNoise());
      const auto session_poses = posesOf(session.map, query_truth);
      const vip_slam::SensorConfig config = vip_slam::loadSensorConfig(vip_slam::resolveSensor(sensor));
      // Intrinsics in a sensor file may be a template that the driver's replace: make sure that they match the maps.
      vip_slam::requireCamera(stored, config.camera, map);
      vip_slam::requireCamera(session, config.camera, query);
      judgeRelocalisation(vip_slam::relocalisationTrials(stored, poses, session, session_poses, config, options), list);
    }
  } catch (const std::exception& error) {
    std::cerr << "place_metrics: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
