// SPDX-License-Identifier: BSD-3-Clause
// run_bag BAG... --sensor NAME_OR_YAML --out DIR: the whole system over a recording, in lock-step.
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include <opencv2/core/utility.hpp>

#include "vip_slam_bringup/runner/bag_reader.h"
#include "vip_slam_bringup/runner/pipeline.h"
#include "vip_slam_bringup/runner/run_output.h"
#include "vip_slam_core/util/command_line.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/output_folder.h"
#include "vip_slam_core/util/progress_bar.h"
#include "vip_slam_ros/sensor_files.h"

namespace {

volatile std::sig_atomic_t g_interrupted = 0;

struct Arguments {
  std::vector<std::string> bags;
  std::string sensor, out, parameters, variant, loop, map;
  bool localise = false;
  bool no_report = false;
  std::vector<std::string> settings;
  std::string extrinsics = "auto";
  double start = 0, duration = -1;
};

void addArguments(vip_slam::CommandLine& line, Arguments& arguments) {
  line.argument("bag", arguments.bags,
                "the recording: a bag, several in any order, a folder of them or a pattern ('run_*.bag')");
  line.option("sensor", arguments.sensor, "a shipped sensor or a sensor YAML file");
  line.required("sensor");
  line.option("out", arguments.out, "folder for the results; made when it does not exist");
  line.required("out");
  line.option("variant", arguments.variant, "vi, vi_p, vi_cp or vip (default)");
  line.option("loop", arguments.loop, "loop closing: on (default) or off");
  line.option("map", arguments.map, "stored map (map.vsm) to start in");
  line.flag("localise", arguments.localise, "leave the stored map as it is, only find the way in it");
  line.needs("localise", "map");
  line.flag("no-report", arguments.no_report, "leave report.html out");
  line.option("extrinsics", arguments.extrinsics,
              "where T_imu_cam comes from: tf in the bag, config (the sensor file), or auto: tf when the bag has it",
              vip_slam::oneOf("auto, tf, config"));
  line.option("params", arguments.parameters, "YAML file with options in groups, without those of the nodelets");
  line.option("set", arguments.settings, "one option as group/key=value; repeatable");
  line.option("start", arguments.start, "seconds to skip at the beginning", vip_slam::between(0.0, 1e6));
  line.option("duration", arguments.duration, "seconds to process; default: to the end", vip_slam::above(0.0));
}

std::string onOff(const std::string& name, const std::string& text) {
  if (text == "on" || text == "off") return text == "on" ? "true" : "false";
  throw std::invalid_argument(name + " " + text + ": expected on or off");
}

vip_slam::PipelineOptions loadPipelineOptions(const Arguments& arguments) {
  vip_slam::PipelineOptions options;
  try {
    if (!arguments.parameters.empty()) vip_slam::loadOptions(options, arguments.parameters, "");
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string(error.what()) +
                                " (files for the nodelets have options of theirs, which --params does not take)");
  }
  std::vector<std::pair<std::string, std::string>> values;
  if (!arguments.variant.empty()) values.emplace_back("backend/variant", arguments.variant);
  if (!arguments.loop.empty()) values.emplace_back("backend/loop_closing", onOff("--loop", arguments.loop));
  for (auto& value : vip_slam::splitSettings(arguments.settings)) values.push_back(std::move(value));
  vip_slam::setOptions(options, values);
  return options;
}

/// The report script is in the folder of this program.
void makeReport(const std::string& folder) {
  const auto script = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "make_report";
  const pid_t child = fork();
  if (child == 0) {
    execl(script.c_str(), script.c_str(), "--out-dir", folder.c_str(), static_cast<char*>(nullptr));
    _exit(127);
  }
  int status = 0;
  const bool ended = child > 0 && waitpid(child, &status, 0) == child;
  if (ended && WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
  const std::string why = !ended              ? std::string("could not be run: ") + std::strerror(errno)
                          : WIFEXITED(status) ? "ended with status " + std::to_string(WEXITSTATUS(status))
                                              : "ended by signal " + std::to_string(WTERMSIG(status));
  std::fprintf(stderr, "run_bag: no report: %s %s\n", script.c_str(), why.c_str());
}

int run(const Arguments& arguments) {
  using Clock = std::chrono::steady_clock;
  const vip_slam::PipelineOptions options = loadPipelineOptions(arguments);
  std::vector<std::string> notes;
  vip_slam::SensorConfig sensor = vip_slam::loadSensorConfig(vip_slam::resolveSensor(arguments.sensor), &notes);
  for (const std::string& note : notes) std::fprintf(stderr, "run_bag: note: %s\n", note.c_str());
  vip_slam::BagReaderOptions reading;
  reading.input = options.input;
  reading.start = arguments.start;
  reading.duration = arguments.duration;
  reading.extrinsics = arguments.extrinsics;
  vip_slam::BagReader reader(vip_slam::BagSet(arguments.bags), sensor, reading);
  if (reader.bags().size() > 1) std::fprintf(stderr, "run_bag: %s\n", reader.bags().description().c_str());
  vip_slam::prepareOutputFolder(arguments.out);

  vip_slam::TimingLog timing;
  vip_slam::Pipeline pipeline(options, sensor, &timing);
  if (!arguments.map.empty()) pipeline.loadMap(arguments.map, arguments.localise);
  vip_slam::ProgressBar progress("run_bag");
  const auto begin = Clock::now();
  reader.start();
  while (const auto event = reader.next()) {
    if (g_interrupted) break;
    pipeline.add(*event);
    if (const auto* pair = std::get_if<vip_slam::ImagePair>(&*event)) {
      progress.update((pair->t - reader.beginTime()) / (reader.endTime() - reader.beginTime()),
                      pipeline.states().empty() ? "" : trackingStateName(pipeline.states().back().status.state));
    }
  }
  reader.stop();
  pipeline.finish();
  const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();

  vip_slam::RunFacts facts;
  facts.bag = reader.bags().paths();
  facts.sensor = sensor.name;
  facts.variant = options.backend.variant;
  facts.loop_closing = options.backend.loop_closing;
  facts.finished = !g_interrupted && !reader.damaged();
  facts.processing_time = seconds;
  vip_slam::writeRun(arguments.out, facts, pipeline, reader, timing);
  if (!arguments.no_report) makeReport(arguments.out);
  const char* const cut = g_interrupted ? " (interrupted)" : reader.damaged() ? " (the bag is damaged)" : "";
  progress.finish(vip_slam::formatted("%zu images in %.1f s%s, results in %s", pipeline.images(), seconds, cut,
                                      arguments.out.c_str()));
  const auto warnings = vip_slam::runWarnings(pipeline, reader);
  for (std::size_t i = 0; i < std::min<std::size_t>(warnings.size(), 8); ++i)
    std::fprintf(stderr, "run_bag: warning: %s\n", warnings[i].c_str());
  if (warnings.size() > 8) std::fprintf(stderr, "run_bag: %zu more warnings in summary.yaml\n", warnings.size() - 8);
  if (pipeline.odometry().empty() && !g_interrupted) {
    const vip_slam::TrackingStatus& status = pipeline.status();
    const std::string why =
        pipeline.images() == 0 ? "" : std::string(" (") + trackingStateName(status.state) + ": " + status.reason + ")";
    std::fprintf(stderr, "run_bag: no image has a pose%s; check_bag tells what is wrong with the data\n", why.c_str());
  }
  if (pipeline.odometry().empty()) return 2;
  return facts.finished ? 0 : 3;
}

}  // namespace

int main(int argc, char** argv) {
  vip_slam::CommandLine line("run_bag",
                             "Runs VIP-SLAM over a bag, as fast as the machine allows; two runs give the same bits.");
  Arguments arguments;
  addArguments(line, arguments);
  if (const auto status = line.parse(argc, argv)) return *status == 0 ? 0 : 1;  // status 2 is reserved for the bag
  std::signal(SIGINT, [](int) { g_interrupted = 1; });
  std::signal(SIGTERM, [](int) { g_interrupted = 1; });
  // The pipeline has its own threads; those of OpenCV would only compete with them.
  cv::setNumThreads(1);
  try {
    return run(arguments);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "run_bag: %s\n", error.what());
    return 1;
  }
}
