// The rate and the delay of a topic that we publish, in /diagnostics ("... odom topic status").
#pragma once

#include <string>

#include <diagnostic_updater/publisher.h>

namespace vip_slam {

class OutputMonitor {
 public:
  /// `rate`: that of the images, Hz. Below 0.7 times it or above 1.3 the status warns; without a message it is an
  /// error, and stamps more than 5 s behind ROS time, or 1 s ahead, are named. `updater` must outlive this.
  OutputMonitor(const std::string& topic, double rate, diagnostic_updater::Updater* updater)
      : rate_(rate),
        status_(topic, *updater, {&rate_, &rate_, kTolerance, kSeconds},
                diagnostic_updater::TimeStampStatusParam(-1.0, 5.0)) {}
  OutputMonitor(const OutputMonitor&) = delete;
  OutputMonitor& operator=(const OutputMonitor&) = delete;

  /// To be called for each message. Thread-safe.
  void published(const ros::Time& stamp) { status_.tick(stamp); }

 private:
  static constexpr double kTolerance = 0.3;
  static constexpr int kSeconds = 5;  // reports, one a second, over which the rate is measured
  double rate_;
  diagnostic_updater::TopicDiagnostic status_;
};

}  // namespace vip_slam
