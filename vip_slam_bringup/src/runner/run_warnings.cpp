// SPDX-License-Identifier: BSD-3-Clause
// Warnings for the user after a successful run.
#include <algorithm>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "vip_slam_backend/optimisation/inertial_scale.h"
#include "vip_slam_bringup/runner/run_output.h"
#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

bool posed(const StateChange& change) { return hasPose(change.status.state); }

/// Warning about a late first pose.
std::string lateStart(const Pipeline& pipeline) {
  constexpr double kSoon = 3.0;  // s; standing for a second, or two tries in motion
  const std::vector<StateChange>& states = pipeline.states();
  const auto first = std::find_if(states.begin(), states.end(), posed);
  if (states.empty() || first == states.begin()) return "";
  const bool never = first == states.end();
  const double seconds = never ? pipeline.duration() : first->t - states.front().t;
  if (seconds < kSoon) return "";
  const std::string late = never ? formatted("there is no pose at all in %.1f s", seconds)
                                 : formatted("the first pose comes late, %.1f s after the first image", seconds);
  const TrackingStatus& before = std::prev(first)->status;
  const bool waits = before.state == TrackingState::kWaiting;  // for data, whatever the sensor does
  return late + ": " + before.reason +
         (waits ? "" : "; standing still for a second, in view of some texture, starts at once");
}

}  // namespace

std::string missingPoses(const Pipeline& pipeline) {
  constexpr double kMoment = 1.0;  // s
  const std::vector<StateChange>& states = pipeline.states();
  const auto first = std::find_if(states.begin(), states.end(), posed);
  if (first == states.end()) return "";
  const double begin = states.front().t, end = begin + pipeline.duration();
  double longest = 0, missing = 0;
  const StateChange* worst = nullptr;
  for (auto it = first; it != states.end(); ++it) {
    if (posed(*it)) continue;
    // A clock that ran back ends a stretch without saying how long it was.
    const double seconds = std::max(0.0, (std::next(it) == states.end() ? end : std::next(it)->t) - it->t);
    missing += seconds;
    if (seconds > longest) longest = seconds, worst = &*it;
  }
  if (!worst || missing < kMoment) return "";
  return formatted(
      "%.1f of %.1f s have no pose, the longest stretch begins %.1f s after the first image and lasts %.1f s: %s",
      missing, pipeline.duration(), worst->t - begin, longest, worst->status.reason.c_str());
}

std::string otherStates(const std::vector<StateChange>& states) {
  constexpr double kFew = 0.02;
  const auto first = std::find_if(states.begin(), states.end(), posed);
  std::map<TrackingState, std::size_t> images;
  std::size_t all = 0;
  const StateChange* worst = nullptr;
  for (auto it = first; it != states.end(); ++it) {
    all += it->images;
    if (it->status.state == TrackingState::kTracking) continue;
    images[it->status.state] += it->images;
    if (!worst || it->images > worst->images) worst = &*it;
  }
  std::size_t others = 0;
  std::string names;
  for (const auto& [state, count] : images) {
    others += count;
    names += formatted("%s%s %.1f %%", names.empty() ? "" : ", ", trackingStateName(state),
                       100.0 * double(count) / double(all));
  }
  if (double(others) <= kFew * double(all)) return "";
  return formatted(
      "%zu of %zu images after the first pose are not TRACKING: %s; the longest stretch begins %.1f s after "
      "the first image (%s: %s)",
      others, all, names.c_str(), worst->t - states.front().t, trackingStateName(worst->status.state),
      worst->status.reason.c_str());
}

std::vector<std::string> runWarnings(const Pipeline& pipeline, const BagReader& reader) {
  std::vector<std::string> all = reader.warnings();
  const FrontEndCounters& c = pipeline.frontEnd().counters();
  if (c.imu_gaps > 0)
    all.push_back(
        formatted("%zu gaps of the IMU above %g s (frontend/recovery/max_imu_gap); in those of five times "
                  "as long images and depth carry the pose",
                  static_cast<std::size_t>(c.imu_gaps), pipeline.options().frontend.recovery.max_imu_gap));
  if (c.imu_spikes > 0)
    all.push_back(
        std::to_string(c.imu_spikes) +
        " single samples of the IMU were far off their neighbours and were replaced by them: errors on its bus?");
  if (c.imu_faults > 0)
    all.push_back(
        std::to_string(c.imu_faults) + " of " + std::to_string(c.images) +
        " images show a motion that the IMU contradicts, and were tracked without it: shocks, shaking, saturation, or "
        "axes, signs, units or T_imu_cam that are wrong? check_bag tells");
  if (c.repeated_image > 0)
    all.push_back(std::to_string(c.repeated_image) + " of " + std::to_string(c.images) +
                  " images repeat the pixels of the one before under a new stamp and are left out: a camera slower "
                  "than its topic, or frozen?");
  if (c.repeated_depth > 0)
    all.push_back(std::to_string(c.repeated_depth) + " of " + std::to_string(c.images) +
                  " depth images repeat the one before and are left out: has the depth camera frozen?");
  if (c.depth_unit_changes > 0)
    all.push_back(
        formatted("all readings of depth changed by one factor at once, %zu times: the unit of depth was set "
                  "anew while recording. It was followed (by a factor of %.3f at the end), the unit at the "
                  "start is taken for the right one",
                  static_cast<std::size_t>(c.depth_unit_changes), c.depth_unit));
  if (c.missing_reading > 0)
    all.push_back(
        formatted("depth of exactly %.3f m stands apart from the surfaces around it: taken for \"no reading\", "
                  "which should be 0 (or NaN)",
                  c.missing_reading));
  if (c.gyro_cut_off > 0)
    all.push_back(
        formatted("%zu samples of the gyroscope are at the end of its range, %.2f rad/s: the body turned faster, by "
                  "how much only images tell",
                  static_cast<std::size_t>(c.gyro_cut_off), c.gyro_range));
  if (c.imu_missing > 0 && reader.sensor().topics.hasInertial())
    all.push_back(std::to_string(c.imu_missing) + " of " + std::to_string(c.images) +
                  " images are not covered by the IMU" +
                  (pipeline.odometry().empty() ? "" : ": images and depth carry the pose there"));
  if (c.imu_rejected > 0)
    all.push_back(std::to_string(c.imu_rejected) +
                  " IMU messages are left out: not finite, all zero, or not newer than the one before");
  if (pipeline.images() == 0) all.push_back("no image could be used");
  for (const std::string& missing : {lateStart(pipeline), missingPoses(pipeline), otherStates(pipeline.states())})
    if (!missing.empty()) all.push_back(missing);
  if (c.imu_contradicted > 0)
    all.push_back(std::to_string(c.imu_contradicted) + " of " + std::to_string(c.images) +
                  " images contradict the IMU by more than any noise: poses are not to be trusted there; are its axes, "
                  "signs and units, T_imu_cam, the stamps and the scale of depth right? check_bag tells");
  if (c.level != frontend::Level::kAccelerometer && pipeline.images() > 0)
    all.push_back(
        formatted("without an accelerometer the vertical is that of %s%s", frontend::levelName(c.level),
                  c.level == frontend::Level::kCamera ? ": hold it upright, or begin with a floor in view" : ""));
  const InertialScale scale = pipeline.mapping() ? pipeline.mapping()->backEnd().scale() : InertialScale();
  // A calibration estimated with a wrong IMU, or with depth in a wrong unit, is meaningless.
  if (!c.imuIsWrong() && !isLarge(scale)) {
    for (const std::string& difference :
         calibrationDifferences(pipeline.frontEnd().givenCalibration(), pipeline.frontEnd().calibration())) {
      all.push_back(difference + " (summary.yaml: calibration)");
    }
  }
  if (pipeline.mapping()) {
    const std::string difference = scaleDifference(scale, reader.sensor());
    if (!difference.empty()) all.push_back(difference);
    const std::string bent = pipeline.mapping()->backEnd().depthDifference();
    if (!bent.empty()) all.push_back(bent + " (summary.yaml: calibration)");
    const MapSnapshot map = pipeline.mapping()->backEnd().snapshot();
    if (map.statistics.without_imu > 0)
      all.push_back(formatted(
          "%zu of %zu keyframes have no IMU factor: holes in the samples since the one before, or samples that images "
          "contradict",
          static_cast<std::size_t>(map.statistics.without_imu),
          static_cast<std::size_t>(map.statistics.keyframes_received)));
    for (const auto& [from, to] : guessedTimes(map))
      all.push_back(
          formatted("keyframes from %.1f to %.1f s after the first image were never tied to the rest of the map: their "
                    "place in trajectory.tum, planes and map is a guess, realtime.tum leaves them out",
                    from - pipeline.chain().front().t, to - pipeline.chain().front().t));
    if (!pipeline.chain().empty() && anchorTrajectory(pipeline.chain(), anchorsOf(map)).empty())
      all.push_back("the stored map was not recognised: no image has a pose in it, trajectory.tum is empty");
    const auto& refused = pipeline.mapping()->warnings();
    all.insert(all.end(), refused.begin(), refused.end());
  }
  return all;
}

}  // namespace vip_slam
