// SPDX-License-Identifier: BSD-3-Clause
// rosrun vip_slam_bringup check_bag BAG... --sensor NAME_OR_YAML  a recording, in one bag or several
// rosrun vip_slam_bringup check_bag --live --sensor NAME_OR_YAML  what is published now
// Exit status: 0 ready (warnings may stand), 1 not ready, 2 nothing could be checked.
#include <unistd.h>

#include <cstdio>
#include <iostream>
#include <optional>
#include <utility>

#include <ros/ros.h>

#include "vip_slam_bringup/preflight/checks.h"
#include "vip_slam_bringup/preflight/recorder.h"
#include "vip_slam_bringup/runner/trial_run.h"
#include "vip_slam_core/util/command_line.h"
#include "vip_slam_ros/sensor_files.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "check_bag", ros::init_options::AnonymousName | ros::init_options::NoSigintHandler);
  vip_slam::CommandLine line("check_bag",
                             "Tells what is missing or wrong in a bag or on live topics before VIP-SLAM sees them.");
  std::vector<std::string> bags;
  std::string sensor;
  bool live = false;
  double seconds = 0;
  line.argument("bag", bags,
                "the recording to check: a bag, several in any order, a folder of them or a pattern ('run_*.bag')",
                false);
  line.flag("live", live, "listen to live topics instead");
  line.option("sensor,s", sensor, "name of a shipped sensor or a YAML file");
  line.option("seconds", seconds, "how long to listen, or how much of the bag's images to look at; 0: 10 and 60",
              vip_slam::between(0.0, 1e6));
  line.required("sensor");
  if (const auto status = line.parse(argc, argv)) return *status;
  if (live != bags.empty()) return line.mistake("give either a bag or --live");
  try {
    const std::string file = vip_slam::resolveSensor(sensor);
    std::vector<std::string> notes;
    const vip_slam::SensorConfig config = vip_slam::loadSensorConfig(file, &notes);
    std::optional<vip_slam::BagSet> set;
    if (!live) set.emplace(bags);
    std::printf("%s against %s\n", live ? "Live topics" : set->name().c_str(), file.c_str());
    if (set && set->size() > 1) std::printf("%s\n", set->description().c_str());
    for (const std::string& note : notes) std::printf("%s\n", note.c_str());
    const auto recording = live ? vip_slam::recordLive(config, seconds > 0 ? seconds : 10)
                                : vip_slam::recordBag(*set, config, seconds > 0 ? seconds : 60);
    vip_slam::Findings findings = vip_slam::checkAll(recording);
    if (set && vip_slam::worst(findings) < vip_slam::Severity::kError) {
      const vip_slam::Findings found = vip_slam::trialRun(std::move(*set), config, seconds > 0 ? seconds : 60);
      findings.insert(findings.end(), found.begin(), found.end());
    }
    std::fputs(vip_slam::toText(findings, ::isatty(STDOUT_FILENO)).c_str(), stdout);
    return vip_slam::worst(findings) == vip_slam::Severity::kError ? 1 : 0;
  } catch (const std::exception& e) {
    std::cerr << "check_bag: " << e.what() << "\n";
    return 2;
  }
}
