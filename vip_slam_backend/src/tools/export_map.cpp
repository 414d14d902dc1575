// SPDX-License-Identifier: BSD-3-Clause
// rosrun vip_slam_backend export_map MAP.vsm --out DIR: keyframe trajectory (TUM), planes (YAML), points (PLY, PCD).
#include <algorithm>
#include <cstdio>
#include <string>

#include "vip_slam_backend/export/point_files.h"
#include "vip_slam_backend/map_io/map_file.h"
#include "vip_slam_core/trajectory/tum_io.h"
#include "vip_slam_core/types/planes_yaml.h"
#include "vip_slam_core/util/command_line.h"
#include "vip_slam_core/util/output_folder.h"

namespace {

using namespace vip_slam;

/// Sorted by stamp, as TUM files require: ids ascend over sessions, stamps not always.
Trajectory keyframePoses(const Map& map) {
  Trajectory poses;
  for (const auto& [id, keyframe] : map.keyframes()) poses.push_back({keyframe.data->frame.t, keyframe.state.T_W_I});
  const auto earlier = [](const StampedPose& a, const StampedPose& b) { return a.t < b.t; };
  std::stable_sort(poses.begin(), poses.end(), earlier);
  // Two sessions of one recording have the same stamps.
  const auto same = [](const StampedPose& a, const StampedPose& b) { return a.t == b.t; };
  poses.erase(std::unique(poses.begin(), poses.end(), same), poses.end());
  return poses;
}

void exportMap(const std::string& file, const std::string& folder, const PointFilter& filter) {
  const StoredMap stored = loadMapFile(file, ImuNoise());
  prepareOutputFolder(folder);
  writeTum(folder + "/keyframes.tum", keyframePoses(stored.map));
  std::vector<PlaneEstimate> planes;
  for (const auto& entry : stored.map.planes()) planes.push_back(entry.second.estimate);
  writePlanesYaml(folder + "/planes.yaml", planes);
  const std::size_t points = writePoints(folder + "/points", stored.map, filter);
  std::printf("%zu keyframes, %zu planes, %zu of %zu points in %s\n", stored.map.keyframes().size(), planes.size(),
              points, stored.map.landmarks().size(), folder.c_str());
}

}  // namespace

int main(int argc, char** argv) {
  vip_slam::CommandLine line("export_map",
                             "Writes what a stored map holds: keyframes.tum, planes.yaml, points.ply, "
                             "points.pcd.");
  std::string map, out;
  line.argument("map", map, "map.vsm of a run");
  line.option("out", out, "folder for the files; made when it does not exist");
  line.required("out");
  vip_slam::PointFilter filter;
  line.option("outliers", filter.outliers,
              "leave out points so many standard deviations farther from their neighbours than is usual; 0: none",
              vip_slam::between(0.0, 100.0));
  line.option("voxel", filter.voxel, "one point in each cube of this side, m; 0: all", vip_slam::between(0.0, 100.0));
  if (const auto status = line.parse(argc, argv)) return *status;
  try {
    exportMap(map, out, filter);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "export_map: %s\n", error.what());
    return 1;
  }
  return 0;
}
