// SPDX-License-Identifier: BSD-3-Clause
// render_sequence NAME_OR_YAML --out DIR: a sequence with ground truth into a bag (or a folder).
#include <malloc.h>

#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>
#include <string>
#include <thread>

#include <ros/package.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/trajectory/tum_io.h"
#include "vip_slam_core/types/planes_yaml.h"
#include "vip_slam_core/util/atomic_file.h"
#include "vip_slam_core/util/command_line.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/output_folder.h"
#include "vip_slam_core/util/progress_bar.h"
#include "vip_slam_sim/io/sequence_writer.h"

namespace fs = std::filesystem;
using namespace vip_slam;

namespace {

volatile std::sig_atomic_t interrupted = 0;

/// Colour and depth (near = warm) side by side, as a PNG for viewing.
void saveSnapshot(const SimFrame& frame, const std::string& path) {
  cv::Mat bgr, metres, shown, colours, both;
  cv::cvtColor(frame.rgb, bgr, cv::COLOR_RGB2BGR);
  frame.depth.convertTo(metres, CV_32F, 0.001);
  metres.convertTo(shown, CV_8U, -255.0 / 10.0, 255.0);
  cv::applyColorMap(shown, colours, cv::COLORMAP_TURBO);
  colours.setTo(cv::Scalar(0, 0, 0), frame.depth == 0);
  cv::hconcat(bgr, colours, both);
  if (!cv::imwrite(path, both)) throw std::runtime_error(path + ": cannot be written");
}

void writeTruth(const SequenceRenderer& sequence, const std::string& path) {
  Trajectory truth;
  for (const ImuSample& s : sequence.imu().samples) {
    const std::int64_t ns = sequence.toNanoseconds(s.t);
    truth.push_back({static_cast<double>(ns) * 1e-9, sequence.stateAt(s.t).T_W_I});
  }
  writeTum(path, truth);
}

/// What the sensor file does not know: the camera as it is, and what depth readings are of true depth.
void writeErrors(const SequenceRenderer& sequence, const std::string& path) {
  const CameraIntrinsics& c = sequence.camera()->intrinsics();
  const DepthOptions& depth = sequence.spec().depth;
  std::string distortion;
  for (const double k : c.distortion) distortion += formatted("%s%.9g", distortion.empty() ? "" : ", ", k);
  AtomicFile file(path);
  file.stream() << formatted(
      "camera: [%.9g, %.9g, %.9g, %.9g]\ndistortion: [%s]\ndepth_scale: %.9g\ndepth_offset: %.9g\n", c.fx, c.fy, c.cx,
      c.cy, distortion.c_str(), depth.scale, depth.offset);
  file.commit();
}

int run(int argc, char** argv) {
  std::string what, out, format = "bag", library = ros::package::getPath("vip_slam_sim") + "/config/sequences.yaml";
  int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  int snapshot_every = 0, first = 0, count = -1;
  bool list = false, keys = false, keep = false;
  CommandLine line("render_sequence", "Renders an RGB-D + IMU sequence with ground truth.");
  line.argument("sequence", what, "name of a shipped sequence (--list) or a .yaml file", false);
  line.option("out", out, "directory for NAME.bag, NAME_truth.tum, NAME_planes.yaml, NAME_sensor.yaml");
  line.option("format", format, "bag, folder (EuRoC/TUM layout) or none (snapshots only)", oneOf("bag, folder, none"));
  line.option("threads", threads, "rendering threads", between(1, 256));
  line.option("library", library, "YAML of the named sequences");
  line.option("snapshots", snapshot_every, "also save every Nth frame as PNG (colour beside depth)",
              between(0, 1 << 30));
  line.option("first", first, "first frame", between(0, 1 << 30));
  line.option("count", count, "number of frames (default all)", between(1, 1 << 30));
  line.flag("list", list, "list the shipped sequences");
  line.flag("keys", keys, "print the keys of a sequence with their defaults and ranges");
  line.flag("skip-existing", keep, "do nothing when the outputs are there");
  if (const auto status = line.parse(argc, argv)) return *status;
  if (list) {
    for (const std::string& name : sequenceNames(library)) std::cout << name << "\n";
    return 0;
  }
  if (keys) {
    std::cout << optionReference("Keys of a sequence", listOptions(SequenceSpec()));
    return 0;
  }
  if (what.empty() || out.empty()) return line.mistake("expected a sequence and --out DIR");

  const SequenceSpec spec = loadSequence(what, library);
  const std::string base = (fs::path(out) / spec.name).string();
  const std::string output = format == "bag" ? base + ".bag" : base;
  if (keep && format != "none" && fs::exists(output) && fs::exists(base + "_planes.yaml")) {
    std::fprintf(stderr, "%s: there already\n", output.c_str());
    return 0;
  }
  prepareOutputFolder(out);
  RenderOptions options;
  options.threads = threads;
  options.first = first;
  options.count = count;
  std::fprintf(stderr, "%s: building and lighting scene '%s'\n", spec.name.c_str(), spec.scene.c_str());
  SequenceRenderer sequence(spec, options);
  const auto& imu = sequence.imu().samples;
  if (first >= sequence.frameCount())
    return line.mistake("--first " + std::to_string(first) + ": the sequence has " +
                        std::to_string(sequence.frameCount()) + " frames");
  const int frames = std::min(sequence.frameCount() - first, count < 0 ? sequence.frameCount() : count);

  std::unique_ptr<SequenceWriter> writer;
  if (format == "bag") writer = makeBagWriter(base + ".bag", sequence.sensor(), sequence.toNanoseconds(0));
  if (format == "folder") writer = makeFolderWriter(base);
  std::size_t next_imu = 0;
  const auto imuUntil = [&](std::int64_t ns) {
    for (; next_imu < imu.size() && sequence.toNanoseconds(imu[next_imu].t) <= ns; ++next_imu)
      if (writer)
        writer->imu(sequence.toNanoseconds(imu[next_imu].t), imu[next_imu], sequence.stateAt(imu[next_imu].t),
                    sequence.trajectory().at(imu[next_imu].t).omega_I);
  };
  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::signal(SIGTERM, [](int) { interrupted = 1; });
  ProgressBar bar(spec.name);
  int done = 0;
  sequence.render([&](const SimFrame& frame) {
    imuUntil(frame.stamp_ns);
    if (writer) writer->frame(frame);
    if (snapshot_every > 0 && frame.index % snapshot_every == 0) {
      saveSnapshot(frame, base + formatted("_%05d.png", frame.index));
    }
    ++done;
    bar.update(double(done) / frames, std::to_string(done) + "/" + std::to_string(frames));
    return !interrupted;
  });
  bar.finish(std::to_string(done) + " images");
  if (interrupted) throw std::runtime_error("interrupted, nothing is left behind");
  imuUntil(std::numeric_limits<std::int64_t>::max());
  if (writer) {
    saveSensorConfig(base + "_sensor.yaml", sequence.sensor());
    writeTruePlanesYaml(base + "_planes.yaml", sequence.planes());
    writeTruth(sequence, base + "_truth.tum");
    writeErrors(sequence, base + "_errors.yaml");
    writer->commit();
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  // Image buffers are allocated and freed with every frame: keep their pages instead of returning them to the system.
  mallopt(M_MMAP_THRESHOLD, 1 << 28);
  mallopt(M_TRIM_THRESHOLD, 1 << 29);
  try {
    return run(argc, argv);
  } catch (const std::exception& e) {
    std::cerr << "render_sequence: " << e.what() << "\n";
    return 1;
  }
}
