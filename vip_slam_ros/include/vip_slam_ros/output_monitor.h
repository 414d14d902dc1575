// SPDX-License-Identifier: BSD-3-Clause
// The rate and the delay of a topic that we publish, in /diagnostics ("... odom topic status").
#pragma once

#include <memory>
#include <string>

#include <ros/time.h>

namespace diagnostic_updater {
class TopicDiagnostic;
class Updater;
}  // namespace diagnostic_updater

namespace vip_slam {

class OutputMonitor {
 public:
  /// `rate`: that of the images, Hz. Below 0.7 times it or above 1.3 the status warns; without a message it is an
  /// error, and stamps more than 5 s behind ROS time, or 1 s ahead, are named. `updater` must outlive this.
  OutputMonitor(const std::string& topic, double rate, diagnostic_updater::Updater* updater);
  ~OutputMonitor();
  OutputMonitor(const OutputMonitor&) = delete;
  OutputMonitor& operator=(const OutputMonitor&) = delete;

  /// To be called for each message. Thread-safe.
  void published(const ros::Time& stamp);

 private:
  double rate_;
  std::unique_ptr<diagnostic_updater::TopicDiagnostic> status_;
};

}  // namespace vip_slam
