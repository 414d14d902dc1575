#include "vip_slam_bringup/parameter_reference.h"

#include "vip_slam_backend/back_end_node_options.h"
#include "vip_slam_bringup/stereo/stereo_depth.h"
#include "vip_slam_core/util/options.h"
#include "vip_slam_frontend/front_end_node_options.h"
#include "vip_slam_planes/planes_node_options.h"

namespace vip_slam {

std::string parameterReference() {
  std::string out =
      "# Parameters\n\n"
      "Made from the option structs by `rosrun vip_slam_bringup parameter_reference`; a test fails when this page is "
      "out\n"
      "of date. A group is a level of names: `tracking/max_features` is the ROS parameter\n"
      "`~tracking/max_features` of its nodelet, and `frontend/tracking/max_features` for run_bag\n"
      "(`--set frontend/tracking/max_features=300`, or a YAML file of nested maps by `--params`). An unknown name or "
      "a\n"
      "value out of range stops the start with the nearest known name.\n\n";
  out += optionReference("Front end (run_bag: `frontend/…`)", listOptions(FrontEndNodeOptions())) + "\n";
  out += optionReference("Planes (run_bag: `planes/…`)", listOptions(PlanesNodeOptions())) + "\n";
  out += optionReference("Back end (run_bag: `backend/…`)", listOptions(BackEndNodeOptions())) + "\n";
  out += optionReference("Stereo depth", listOptions(StereoDepthOptions()));
  return out;
}

}  // namespace vip_slam
