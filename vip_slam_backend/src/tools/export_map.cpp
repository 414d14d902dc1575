// rosrun vip_slam_backend export_map MAP.vsm --out DIR: keyframe trajectory (TUM), planes (YAML), points (PLY and PCD).
#include <cstdio>
#include <filesystem>
#include <string>

#include "vip_slam_backend/map_io/map_file.h"
#include "vip_slam_backend/map_io/point_files.h"
#include "vip_slam_core/trajectory/tum_io.h"
#include "vip_slam_core/types/planes_yaml.h"

int main(int argc, char** argv) {
  using namespace vip_slam;
  if (argc != 4 || std::string(argv[2]) != "--out") {
    std::fprintf(stderr, "usage: export_map MAP.vsm --out DIR\n");
    return 2;
  }
  try {
    const StoredMap stored = loadMapFile(argv[1], ImuNoise());
    const std::string folder = argv[3];
    std::filesystem::create_directories(folder);
    Trajectory trajectory;
    for (const auto& entry : stored.map.keyframes()) {
      const double t = entry.second.data->frame.t;
      // Sessions follow each other in id, not always in time; TUM wants ascending stamps.
      if (trajectory.empty() || t > trajectory.back().t) trajectory.push_back({t, entry.second.state.T_W_I});
    }
    writeTum(folder + "/keyframes.tum", trajectory);
    std::vector<PlaneEstimate> planes;
    for (const auto& entry : stored.map.planes()) planes.push_back(entry.second.estimate);
    writePlanesYaml(folder + "/planes.yaml", planes);
    writePointsPly(folder + "/points.ply", stored.map);
    writePointsPcd(folder + "/points.pcd", stored.map);
    std::printf("%zu keyframes, %zu planes, %zu points in %s\n", stored.map.keyframes().size(), planes.size(),
                stored.map.landmarks().size(), folder.c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "export_map: %s\n", error.what());
    return 1;
  }
  return 0;
}
