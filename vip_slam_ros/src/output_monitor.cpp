// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/output_monitor.h"

// Only here: before diagnostic_updater 1.11 this header defines a function that is not inline.
#include <diagnostic_updater/publisher.h>

namespace vip_slam {
namespace {

constexpr double kTolerance = 0.3;
constexpr int kSeconds = 5;  // reports, one a second, over which the rate is measured

}  // namespace

OutputMonitor::OutputMonitor(const std::string& topic, double rate, diagnostic_updater::Updater* updater)
    : rate_(rate),
      status_(std::make_unique<diagnostic_updater::TopicDiagnostic>(
          topic, *updater, diagnostic_updater::FrequencyStatusParam(&rate_, &rate_, kTolerance, kSeconds),
          diagnostic_updater::TimeStampStatusParam(-1.0, 5.0))) {}

OutputMonitor::~OutputMonitor() = default;

void OutputMonitor::published(const ros::Time& stamp) { status_->tick(stamp); }

}  // namespace vip_slam
