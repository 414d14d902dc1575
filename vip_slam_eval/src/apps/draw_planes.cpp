// SPDX-License-Identifier: BSD-3-Clause
// rosrun vip_slam_eval draw_planes BAG --sensor S --trajectory T.tum --planes P.yaml --time SECONDS... --out DIR
// [--heights]: draws the planes of a run over images of its bag; --heights measures how stable horizontal planes are.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <sstream>

#include <opencv2/imgcodecs.hpp>

#include "vip_slam_bringup/runner/bag_reader.h"
#include "vip_slam_core/trajectory/tum_io.h"
#include "vip_slam_core/types/planes_yaml.h"
#include "vip_slam_core/util/atomic_file.h"
#include "vip_slam_core/util/command_line.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/output_folder.h"
#include "vip_slam_eval/plane_benchmark/plane_heights.h"
#include "vip_slam_eval/plane_benchmark/plane_picture.h"
#include "vip_slam_ros/sensor_files.h"

namespace {

using namespace vip_slam;

struct Arguments {
  std::string bag, sensor, trajectory, planes, out;
  std::vector<double> times;
  bool heights = false;
};

void writePicture(const std::string& path, const cv::Mat& picture) {
  std::vector<uchar> bytes;
  if (!cv::imencode(".png", picture, bytes)) throw std::runtime_error(path + ": cannot be encoded as PNG");
  AtomicFile file(path, true);
  file.stream().write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  file.commit();
}

int draw(Arguments arguments) {
  SensorConfig sensor = loadSensorConfig(resolveSensor(arguments.sensor));
  BagReader reader(arguments.bag, sensor);
  const auto camera = makeCamera(sensor.camera);
  const Trajectory trajectory = readTum(arguments.trajectory);
  const std::vector<PlaneEstimate> planes = readPlanesYaml(arguments.planes);
  prepareOutputFolder(arguments.out);
  std::sort(arguments.times.begin(), arguments.times.end());
  std::size_t next = 0;
  PlaneHeights heights;
  reader.start();
  while (const auto event = reader.next()) {
    const auto* pair = std::get_if<ImagePair>(&*event);
    if (!pair) continue;
    const bool due = next < arguments.times.size() && pair->t >= reader.beginTime() + arguments.times[next];
    SE3 T_map_I;
    if (!(due || arguments.heights) || !poseAt(trajectory, pair->t, &T_map_I)) continue;
    if (arguments.heights && !pair->depth.empty()) {
      measureHeights(pair->t, pair->depth, *camera, T_map_I * sensor.T_imu_cam, planes, &heights);
    }
    if (!due) continue;
    const cv::Mat picture = drawPlanes(pair->gray, pair->depth, *camera, T_map_I * sensor.T_imu_cam, planes);
    const std::string name = formatted("planes_%07.2f.png", pair->t - reader.beginTime());
    const std::string path = (std::filesystem::path(arguments.out) / name).string();
    writePicture(path, picture);
    std::cout << path << "\n";
    while (next < arguments.times.size() && pair->t >= reader.beginTime() + arguments.times[next]) ++next;
  }
  if (arguments.heights) {
    std::cout << heightTable(heights, planes);
    AtomicFile file((std::filesystem::path(arguments.out) / "heights.csv").string());
    file.stream() << heightsCsv(heights);
    file.commit();
  }
  if (next < arguments.times.size()) {
    std::ostringstream missing;
    for (std::size_t k = next; k < arguments.times.size(); ++k) missing << (k > next ? ", " : "") << arguments.times[k];
    throw std::runtime_error("no picture for --time " + missing.str() + ": " + arguments.bag + " and " +
                             arguments.trajectory + " have no image with a pose at or after that");
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  vip_slam::CommandLine line("draw_planes", "Draws the planes of a run over images of its bag.");
  Arguments arguments;
  line.argument("bag", arguments.bag, "the recording");
  line.option("sensor", arguments.sensor, "a shipped sensor or a sensor YAML file");
  line.required("sensor");
  line.option("trajectory", arguments.trajectory, "poses of the IMU in the planes' world, TUM");
  line.required("trajectory");
  line.option("planes", arguments.planes, "planes.yaml of the run");
  line.required("planes");
  line.option("time", arguments.times, "seconds after the beginning of the bag; several make several pictures",
              vip_slam::each(vip_slam::between(0.0, 1e6)));
  line.flag("heights", arguments.heights,
            "also print how the height of each level plane varies over the images, and write heights.csv");
  line.option("out", arguments.out, "folder for the pictures");
  line.required("out");
  if (const auto status = line.parse(argc, argv)) return *status;
  if (arguments.times.empty() && !arguments.heights) return line.mistake("give --time, or --heights, or both");
  try {
    return draw(arguments);
  } catch (const std::exception& error) {
    std::cerr << "draw_planes: " << error.what() << "\n";
    return 1;
  }
}
