// The services of the system, offered by the back end.
#include <vip_slam_msgs/LoadMap.h>
#include <vip_slam_msgs/Pause.h>
#include <vip_slam_msgs/Reset.h>
#include <vip_slam_msgs/SaveMap.h>
#include <vip_slam_msgs/SaveTrajectory.h>
#include <vip_slam_msgs/SetLocalisationMode.h>
#include <vip_slam_msgs/TriggerGlobalBa.h>

#include "back_end_nodelet.h"
#include "vip_slam_ros/plane_conversions.h"

namespace vip_slam {
namespace {

constexpr double kPatience = 30.0;  // seconds that a service waits for the owner thread

std::string requirePath(const std::string& path) {
  if (path.empty()) throw std::invalid_argument("path: empty, expected a file name");
  return path;
}

}  // namespace

template <class Response>
bool BackEndNodelet::serve(Response& response, const std::function<std::string()>& work) {
  try {
    auto words = std::make_shared<std::string>();
    response.success = owner_->call(control_lane_, [words, work] { *words = work(); }, kPatience);
    response.message = response.success ? *words : "the back end was busy for too long; nothing was done";
  } catch (const std::exception& error) {
    response.success = false;
    response.message = error.what();
  }
  if (!response.success) NODELET_WARN("%s", response.message.c_str());
  return true;
}

void BackEndNodelet::advertiseServices() {
  using namespace vip_slam_msgs;
  ros::NodeHandle& nh = getMTNodeHandle();
  const auto offer = [&](const std::string& name, auto callback) {
    services_.push_back(nh.advertiseService(name, callback));
  };
  using std::function;
  offer("save_map", function<bool(SaveMap::Request&, SaveMap::Response&)>([this](auto& q, auto& r) {
          return serve(r, [this, path = q.path] { return saveMap(path); });
        }));
  offer("load_map", function<bool(LoadMap::Request&, LoadMap::Response&)>([this](auto& q, auto& r) {
          return serve(r, [this, path = q.path] { return loadMap(path); });
        }));
  offer("save_trajectory", function<bool(SaveTrajectory::Request&, SaveTrajectory::Response&)>([this](auto& q, auto& r) {
          return serve(r, [this, path = q.path] { return saveTrajectory(path); });
        }));
  offer("reset", function<bool(Reset::Request&, Reset::Response&)>([this](auto& q, auto& r) {
          return serve(r, [this, keep = bool(q.keep_map)] { return reset(keep); });
        }));
  offer("pause", function<bool(Pause::Request&, Pause::Response&)>([this](auto& q, auto& r) {
          return serve(r, [this, pause = bool(q.pause)] {
            command(pause ? Control::PAUSE : Control::RESUME);
            return std::string(pause ? "paused" : "resumed");
          });
        }));
  offer("set_localisation_mode",
        function<bool(SetLocalisationMode::Request&, SetLocalisationMode::Response&)>([this](auto& q, auto& r) {
          return serve(r, [this, on = bool(q.localisation)] {
            backEnd();
            return setLocalisation(on);
          });
        }));
  offer("trigger_global_ba",
        function<bool(TriggerGlobalBa::Request&, TriggerGlobalBa::Response&)>([this](auto&, auto& r) {
          return serve(r, [this] {
            backEnd().requestGlobalBa();
            startGlobalBa();
            return std::string("a global adjustment is under way; its result comes as a global map update");
          });
        }));
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
    for (const auto& plane : backEnd().snapshot().planes) msg->planes.push_back(toMsg(plane));
  }
  control_pub_.publish(msg);
}

std::string BackEndNodelet::reset(bool keep_map) {
  if (keep_map) {
    command(vip_slam_msgs::Control::RESET_ODOMETRY);
    return "the odometry starts anew, the map stays";
  }
  // Keyframes that are still on their way belong to what is forgotten.
  ignore_before_ = ros::Time::now().toSec();
  if (back_end_) back_end_->reset();
  display_.clear();
  pose_.clear();
  publishDisplay(ignore_before_, true);
  command(vip_slam_msgs::Control::RESET);
  return "map and odometry start anew";
}

std::string BackEndNodelet::saveMap(const std::string& path) {
  backEnd().saveMap(requirePath(path));
  return "map of " + std::to_string(display_.keyframeCount()) + " keyframes written to " + path;
}

std::string BackEndNodelet::loadMap(const std::string& path) {
  const MapUpdate update = backEnd().loadMap(requirePath(path));
  display_.clear();
  command(vip_slam_msgs::Control::MAP_LOADED);
  distribute(update);
  return "map of " + std::to_string(update.keyframes.size()) + " keyframes loaded from " + path;
}

std::string BackEndNodelet::saveTrajectory(const std::string& path) {
  std::vector<Anchor> anchors;
  for (const SnapshotKeyframe& keyframe : backEnd().snapshot().keyframes) {
    anchors.push_back({keyframe.t, keyframe.epoch, keyframe.T_odom_I, keyframe.state.T_W_I});
  }
  const Trajectory trajectory = pose_.trajectory(anchors);
  if (trajectory.empty()) throw std::runtime_error("no image has a pose in map yet");
  writeTum(requirePath(path), trajectory);
  return std::to_string(trajectory.size()) + " poses written to " + path;
}

std::string BackEndNodelet::setLocalisation(bool on) {
  backEnd().setLocalisationMode(on);
  std::lock_guard<std::mutex> lock(shown_mutex_);
  shown_.localisation_mode = on;
  return on ? "localisation: the map no longer changes" : "mapping";
}

}  // namespace vip_slam
