// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/parameter_reference.h"

#include <algorithm>

#include "vip_slam_backend/back_end_node_options.h"
#include "vip_slam_bringup/runner/pipeline_options.h"
#include "vip_slam_bringup/stereo/stereo_depth.h"
#include "vip_slam_core/util/options.h"
#include "vip_slam_frontend/front_end_node_options.h"
#include "vip_slam_planes/planes_node_options.h"

namespace vip_slam {
namespace {

using Rows = std::vector<OptionRow>;

/// A nodelet's parameters in two tables: those of its estimator, which run_bag has as `group/name`, and its own.
std::string nodeletReference(const std::string& title, const std::string& group, Rows rows) {
  const Rows of_run_bag = listOptions(PipelineOptions());
  const auto shared = [&](const OptionRow& row) {
    const std::string name = group + "/" + row.name;
    return std::any_of(of_run_bag.begin(), of_run_bag.end(), [&](const OptionRow& r) { return r.name == name; });
  };
  const auto own = std::stable_partition(rows.begin(), rows.end(), shared);
  return optionReference(title + " (run_bag: `" + group + "/…`)", Rows(rows.begin(), own)) + "\n" +
         optionReference(title + ": of the nodelet `" + group + "` alone", Rows(own, rows.end())) + "\n";
}

Rows ofRunBagAlone() {
  Rows rows = listOptions(PipelineOptions());
  rows.erase(std::remove_if(rows.begin(), rows.end(),
                            [](const OptionRow& row) { return row.name.find('/') != std::string::npos; }),
             rows.end());
  return rows;
}

}  // namespace

std::string parameterReference() {
  std::string out =
      "# Parameters\n\n"
      "Made from the option structs by `rosrun vip_slam_bringup parameter_reference`; a test fails when this page is "
      "out\n"
      "of date. A group is a level of names: `tracking/max_features` is the ROS parameter\n"
      "`~tracking/max_features` of its nodelet, and `frontend/tracking/max_features` for run_bag\n"
      "(`--set frontend/tracking/max_features=300`, or a YAML file of nested maps by `--params`). An unknown name or "
      "a\n"
      "value out of range stops the start with the nearest known name. What a nodelet has alone, run_bag refuses.\n\n";
  out += nodeletReference("Front end", "frontend", listOptions(FrontEndNodeOptions()));
  out += nodeletReference("Planes", "planes", listOptions(PlanesNodeOptions()));
  out += nodeletReference("Back end", "backend", listOptions(BackEndNodeOptions()));
  out += optionReference("run_bag alone", ofRunBagAlone()) + "\n";
  out += optionReference("Stereo depth", listOptions(StereoDepthOptions()));
  return out;
}

}  // namespace vip_slam
