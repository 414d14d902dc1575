// SPDX-License-Identifier: BSD-3-Clause
// The services of the system, offered by the back end.
#include <cstdlib>
#include <filesystem>

#include <std_srvs/Empty.h>
#include <vip_slam_msgs/LoadMap.h>
#include <vip_slam_msgs/Pause.h>
#include <vip_slam_msgs/Reset.h>
#include <vip_slam_msgs/SaveMap.h>
#include <vip_slam_msgs/SaveTrajectory.h>
#include <vip_slam_msgs/SetLocalisationMode.h>
#include <vip_slam_msgs/TriggerGlobalBa.h>

#include "back_end_nodelet.h"
#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_ros/plane_conversions.h"

namespace vip_slam {
namespace {

constexpr double kPatience = 30.0;  // seconds that a service waits for the owner thread

/// Makes sure that the path is absolute, since the node's working directory is not the caller's. `~/` is the home of
/// the user that runs the node.
std::string absolutePath(const std::string& path) {
  if (path.empty()) throw std::invalid_argument("path: empty, expected a file name");
  const char* home = std::getenv("HOME");
  if (path.compare(0, 2, "~/") == 0 && home) return home + path.substr(1);
  return std::filesystem::absolute(path).lexically_normal().string();
}

}  // namespace

bool BackEndNodelet::askOwner(const std::function<std::string()>& work, std::string* message) {
  bool success = false;
  try {
    // Copies: work that runs after the timeout must not touch this function's variables.
    auto words = std::make_shared<std::string>();
    success = owner_->call(
        control_lane_, [words, work] { *words = work(); }, kPatience);
    *message = success ? *words : formatted("the back end was not free within %g s; nothing was done", kPatience);
  } catch (const std::exception& error) {
    *message = error.what();
  }
  if (!success) NODELET_WARN("%s", message->c_str());
  return success;
}

template <class Service>
void BackEndNodelet::offer(const std::string& name,
                           const std::function<std::string(const typename Service::Request&)>& work) {
  using Request = typename Service::Request;
  using Response = typename Service::Response;
  const boost::function<bool(Request&, Response&)> callback = [this, work](const Request& request, Response& response) {
    response.success = askOwner([work, request] { return work(request); }, &response.message);
    return true;
  };
  services_.push_back(getMTNodeHandle().advertiseService(name, callback));
}

void BackEndNodelet::offerEmpty(const std::string& name, const std::function<std::string()>& work) {
  const boost::function<bool(std_srvs::EmptyRequest&, std_srvs::EmptyResponse&)> callback =
      [this, work](std_srvs::EmptyRequest&, std_srvs::EmptyResponse&) {
        std::string message;
        const bool success = askOwner(work, &message);
        if (success) NODELET_INFO("%s", message.c_str());
        return success;
      };
  services_.push_back(getMTNodeHandle().advertiseService(name, callback));
}

void BackEndNodelet::advertiseServices() {
  using namespace vip_slam_msgs;
  offer<SaveMap>("save_map", [this](const SaveMapRequest& request) { return saveMap(request.path); });
  offer<LoadMap>("load_map", [this](const LoadMapRequest& request) { return loadMap(request.path); });
  offer<SaveTrajectory>("save_trajectory",
                        [this](const SaveTrajectoryRequest& request) { return saveTrajectory(request.path); });
  offer<Reset>("reset", [this](const ResetRequest& request) { return reset(request.keep_map); });
  offer<Pause>("pause", [this](const PauseRequest& request) {
    command(request.pause ? Control::PAUSE : Control::RESUME);
    return request.pause ? "paused" : "resumed";
  });
  offer<SetLocalisationMode>("set_localisation_mode", [this](const SetLocalisationModeRequest& request) {
    return setLocalisation(request.localisation);
  });
  offer<TriggerGlobalBa>("trigger_global_ba", [this](const TriggerGlobalBaRequest&) {
    if (localise_) throw std::runtime_error("localisation mode: the map does not change");
    backEnd().requestGlobalBa();
    startGlobalBa();
    return "a global adjustment is under way; its result comes as a global map update";
  });
  if (!options_.rtabmap_services.empty()) advertiseRtabmapServices(options_.rtabmap_services + "/");
}

void BackEndNodelet::advertiseRtabmapServices(const std::string& prefix) {
  using vip_slam_msgs::Control;
  offerEmpty(prefix + "reset", [this] { return reset(false); });
  offerEmpty(prefix + "trigger_new_map", [this] { return reset(true); });
  offerEmpty(prefix + "pause", [this] {
    command(Control::PAUSE);
    return "paused";
  });
  offerEmpty(prefix + "resume", [this] {
    command(Control::RESUME);
    return "resumed";
  });
  offerEmpty(prefix + "set_mode_localization", [this] { return setLocalisation(true); });
  offerEmpty(prefix + "set_mode_mapping", [this] { return setLocalisation(false); });
  offerEmpty(prefix + "backup", [this] { return saveMap(options_.backup_path); });
}

BackEnd& BackEndNodelet::backEnd() {
  if (!back_end_) throw std::runtime_error("there is no map yet: the sensor's calibration is not known");
  return *back_end_;
}

void BackEndNodelet::command(std::uint8_t command) {
  auto msg = boost::make_shared<vip_slam_msgs::Control>();
  msg->header.stamp = ros::Time::now();
  msg->header.frame_id = options_.map_frame;
  msg->command = command;
  if (command == vip_slam_msgs::Control::MAP_LOADED) {
    for (const StoredPlane& plane : backEnd().storedPlanes()) {
      msg->planes.push_back(toMsg(plane.estimate));
      msg->hosts.push_back(toMsg(plane.host));
    }
    msg->newest_keyframe = backEnd().map().newestKeyframe();
  }
  control_pub_.publish(msg);
}

std::string BackEndNodelet::reset(bool keep_map) {
  if (keep_map) {
    command(vip_slam_msgs::Control::RESET_ODOMETRY);
    return "the odometry starts anew, the map stays";
  }
  // Keyframes still in transit belong to the discarded map.
  barrier_.raise();
  if (back_end_) back_end_->reset();
  planes_wanted_ = 0;
  display_.clear();
  pose_.clear();
  publishDisplay(barrier_.newest(), true);
  publishStatistics();
  command(vip_slam_msgs::Control::RESET);
  return "map and odometry start anew";
}

std::string BackEndNodelet::saveMap(const std::string& path) {
  const std::string file = absolutePath(path);
  // What waits for a loaded map to be recognised is saved with it, as a part of its own.
  if (const std::optional<MapUpdate> waited = backEnd().mapWaiting()) distribute(*waited);
  backEnd().saveMap(file);
  return "map of " + std::to_string(display_.keyframeCount()) + " keyframes written to " + file;
}

std::string BackEndNodelet::loadMap(const std::string& path) {
  const std::string file = absolutePath(path);
  const MapUpdate update = backEnd().loadMap(file);
  planes_wanted_ = 0;
  display_.clear();
  {
    std::lock_guard<std::mutex> lock(shown_mutex_);
    load_problem_.clear();
  }
  command(vip_slam_msgs::Control::MAP_LOADED);
  distribute(update);
  return "map of " + std::to_string(update.keyframes.size()) + " keyframes loaded from " + file;
}

std::string BackEndNodelet::saveTrajectory(const std::string& path) {
  const MapSnapshot map = backEnd().snapshot();
  const Trajectory trajectory = pose_.trajectory(anchorsOf(map));
  if (trajectory.empty()) throw std::runtime_error("no image has a pose in map yet");
  const std::string file = absolutePath(path);
  writeTum(file, trajectory);
  const std::size_t guessed = guessedTimes(map).size();
  const std::string parts = std::to_string(guessed) + (guessed == 1 ? " part" : " parts");
  return std::to_string(trajectory.size()) + " poses written to " + file +
         (guessed > 0 ? "; the place of " + parts + " of the map is a guess, nothing ties it to the rest" : "");
}

std::string BackEndNodelet::setLocalisation(bool on) {
  backEnd().setLocalisationMode(on);
  localise_ = on;
  vip_slam_backend::BackEndConfig config;
  {
    std::lock_guard<std::mutex> lock(shown_mutex_);
    shown_.localisation_mode = config_.localisation_mode = on;
    config = config_;
  }
  // Otherwise a change of another parameter would restore the mode that dynamic_reconfigure had last.
  const boost::recursive_mutex::scoped_lock lock(reconfigure_mutex_);
  reconfigure_->updateConfig(config);
  return on ? "localisation: the map no longer changes" : "mapping";
}

}  // namespace vip_slam
