// SPDX-License-Identifier: BSD-3-Clause
// rosrun vip_slam_bringup convert_to_bag euroc|tum_rgbd|stray FOLDER --out NAME.bag
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <iostream>
#include <stdexcept>

#include "vip_slam_bringup/convert/converters.h"
#include "vip_slam_core/util/command_line.h"

namespace {

volatile std::sig_atomic_t interrupted = 0;

void addCommon(vip_slam::CommandLine& line, vip_slam::ConversionOptions* options) {
  line.argument("folder", options->folder, "the data set's folder");
  line.option("out,o", options->bag, "bag to write; NAME_sensor.yaml and NAME_truth.tum appear beside it");
  line.required("out");
  line.flag("force,f", options->overwrite, "overwrite the bag");
  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::signal(SIGTERM, [](int) { interrupted = 1; });
  options->progress = [shown = ::isatty(STDERR_FILENO) != 0](std::size_t done, std::size_t all) {
    if (interrupted) throw std::runtime_error("interrupted, nothing is left behind");
    if (shown && (done % 200 == 0 || done == all))
      std::fprintf(stderr, "\r%3zu %% of %zu messages%s", 100 * done / all, all, done == all ? "\n" : "");
  };
}

int printReport(const vip_slam::ConversionReport& report) {
  for (const auto& [topic, count] : report.messages) std::printf("%8zu  %s\n", count, topic.c_str());
  for (const auto& note : report.notes) std::printf("%s\n", note.c_str());
  for (const auto& warning : report.warnings) std::printf("warning: %s\n", warning.c_str());
  for (const auto& file : report.files) std::printf("wrote %s\n", file.c_str());
  return 0;
}

int convertEuroc(int argc, char** argv) {
  vip_slam::CommandLine line("convert_to_bag euroc", "Converts a EuRoC MAV folder (mav0/cam0, cam1, imu0) into a bag.");
  vip_slam::EurocOptions euroc;
  addCommon(line, &euroc);
  line.flag("depth", euroc.depth, "also write the rectified left image and the stereo depth");
  if (const auto status = line.parse(argc, argv)) return *status;
  return printReport(vip_slam::convertEuroc(euroc));
}

int convertTumRgbd(int argc, char** argv) {
  vip_slam::CommandLine line("convert_to_bag tum_rgbd",
                             "Converts a TUM RGB-D folder (rgb.txt, depth.txt; imu.txt or accelerometer.txt when "
                             "there) into a bag.");
  vip_slam::TumRgbdOptions tum;
  std::vector<double> camera;
  double depth_factor = 0;
  addCommon(line, &tum);
  line.option("camera", camera, "fx fy cx cy [k1 k2 p1 p2 [k3]]", vip_slam::count<double>(4, 9));
  line.flag("no-imu", tum.no_imu, "leave out imu.txt and accelerometer.txt");
  line.option("rolling-shutter", tum.rolling_shutter,
              "seconds from the colour image's first row to its last; a Kinect v1's: 0.02 to 0.03; rendered images: 0",
              vip_slam::between(0.0, 0.1));
  line.option("depth-factor", depth_factor, "depth units per metre; 0: 1000 or 5000, as the images tell",
              vip_slam::between(0.0, 1e6));
  if (const auto status = line.parse(argc, argv)) return *status;
  if (depth_factor > 0) tum.depth_factor = depth_factor;
  if (!camera.empty()) {
    vip_slam::CameraIntrinsics intrinsics;
    intrinsics.fx = camera[0];
    intrinsics.fy = camera[1];
    intrinsics.cx = camera[2];
    intrinsics.cy = camera[3];
    intrinsics.distortion.assign(camera.begin() + 4, camera.end());
    if (!intrinsics.distortion.empty()) intrinsics.model = vip_slam::DistortionModel::kRadTan;
    tum.camera = intrinsics;
  }
  return printReport(vip_slam::convertTumRgbd(tum));
}

int convertStray(int argc, char** argv) {
  vip_slam::CommandLine line("convert_to_bag stray",
                             "Converts a Stray Scanner recording (iPhone or iPad with LiDAR) into a bag.");
  vip_slam::StrayOptions stray;
  addCommon(line, &stray);
  line.option("width", stray.width, "width of colour and depth, px", vip_slam::between(160, 1920));
  line.option("min-confidence", stray.min_confidence, "drop depth below this ARKit confidence",
              vip_slam::between(0, 2));
  if (const auto status = line.parse(argc, argv)) return *status;
  return printReport(vip_slam::convertStray(stray));
}

}  // namespace

int main(int argc, char** argv) {
  const std::string format = argc > 1 ? argv[1] : "";
  try {
    if (format == "euroc") return convertEuroc(argc - 1, argv + 1);
    if (format == "tum_rgbd") return convertTumRgbd(argc - 1, argv + 1);
    if (format == "stray") return convertStray(argc - 1, argv + 1);
  } catch (const std::exception& e) {
    std::cerr << "convert_to_bag: " << e.what() << "\n";
    return 1;
  }
  const bool help = format == "--help" || format == "-h";
  (help ? std::cout : std::cerr) << "Usage: convert_to_bag euroc|tum_rgbd|stray FOLDER --out NAME.bag [options]\n"
                                    "       convert_to_bag euroc|tum_rgbd|stray --help\n";
  return help ? 0 : 2;
}
