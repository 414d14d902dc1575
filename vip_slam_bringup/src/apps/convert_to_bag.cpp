// rosrun vip_slam_bringup convert_to_bag euroc|tum_rgbd|stray FOLDER --out NAME.bag
#include <unistd.h>

#include <cstdio>
#include <iostream>

#include <CLI/CLI.hpp>

#include "vip_slam_bringup/convert/converters.h"

namespace {

void addCommon(CLI::App* app, vip_slam::ConversionOptions* options) {
  app->add_option("folder", options->folder, "the data set's folder")->required();
  app->add_option("--out,-o", options->bag, "bag to write; NAME_sensor.yaml and NAME_truth.tum appear beside it")
      ->required();
  app->add_flag("--force,-f", options->overwrite, "overwrite the bag");
  if (::isatty(STDERR_FILENO)) {
    options->progress = [](std::size_t done, std::size_t all) {
      if (done % 200 == 0 || done == all)
        std::fprintf(stderr, "\r%3zu %% of %zu messages%s", 100 * done / all, all, done == all ? "\n" : "");
    };
  }
}

int printReport(const vip_slam::ConversionReport& report) {
  for (const auto& [topic, count] : report.messages) std::printf("%8zu  %s\n", count, topic.c_str());
  for (const auto& warning : report.warnings) std::printf("warning: %s\n", warning.c_str());
  for (const auto& file : report.files) std::printf("wrote %s\n", file.c_str());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Converts a data set's folder into a bag."};
  app.require_subcommand(1);

  vip_slam::EurocOptions euroc;
  CLI::App* euroc_command = app.add_subcommand("euroc", "EuRoC MAV folder (mav0/cam0, cam1, imu0)");
  addCommon(euroc_command, &euroc);
  euroc_command->add_flag("--depth", euroc.depth, "also write the rectified left image and the stereo depth");

  vip_slam::TumRgbdOptions tum;
  std::vector<double> camera;
  CLI::App* tum_command = app.add_subcommand("tum_rgbd", "TUM RGB-D folder (rgb.txt, depth.txt, imu.txt)");
  addCommon(tum_command, &tum);
  tum_command->add_option("--camera", camera, "fx fy cx cy [k1 k2 p1 p2 [k3]]")->expected(4, 9);
  tum_command->add_option("--depth-factor", tum.depth_factor, "depth units per metre")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();

  vip_slam::StrayOptions stray;
  CLI::App* stray_command = app.add_subcommand("stray", "Stray Scanner recording (iPhone or iPad with LiDAR)");
  addCommon(stray_command, &stray);
  stray_command->add_option("--width", stray.width, "width of colour and depth, px")
      ->check(CLI::Range(160, 1920))
      ->capture_default_str();
  stray_command->add_option("--min-confidence", stray.min_confidence, "drop depth below this ARKit confidence")
      ->check(CLI::Range(0, 2))
      ->capture_default_str();

  CLI11_PARSE(app, argc, argv);
  try {
    if (*euroc_command) return printReport(vip_slam::convertEuroc(euroc));
    if (*stray_command) return printReport(vip_slam::convertStray(stray));
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
  } catch (const std::exception& e) {
    std::cerr << "convert_to_bag: " << e.what() << "\n";
    return 1;
  }
}
