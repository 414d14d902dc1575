// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/runner/run_output.h"

#include <iomanip>

#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include <yaml-cpp/yaml.h>

#include "vip_slam_bringup/runner/plane_files.h"
#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/types/planes_yaml.h"
#include "vip_slam_core/util/atomic_file.h"

namespace vip_slam {
namespace {

double peakMemoryMb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return double(usage.ru_maxrss) / 1024.0;
}

double lengthOf(const std::vector<OdometryPose>& poses) {
  double length = 0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    if (poses[i].epoch == poses[i - 1].epoch) length += (poses[i].T_odom_I.t() - poses[i - 1].T_odom_I.t()).norm();
  }
  return length;
}

void emitCounters(YAML::Emitter& yaml, const FrontEndCounters& c, const std::map<std::string, std::uint64_t>& reader) {
  const std::pair<const char*, std::uint64_t> front_end[] = {{"restarts", c.restarts},
                                                             {"bad_image", c.bad_image},
                                                             {"bad_depth", c.bad_depth},
                                                             {"no_depth", c.no_depth},
                                                             {"bad_stamp", c.bad_stamp},
                                                             {"repeated_image", c.repeated_image},
                                                             {"repeated_depth", c.repeated_depth},
                                                             {"depth_unit_changes", c.depth_unit_changes},
                                                             {"imu_rejected", c.imu_rejected},
                                                             {"gyro_cut_off", c.gyro_cut_off},
                                                             {"imu_gaps", c.imu_gaps},
                                                             {"imu_spikes", c.imu_spikes},
                                                             {"imu_faults", c.imu_faults},
                                                             {"imu_missing", c.imu_missing},
                                                             {"zero_velocity", c.zero_velocity},
                                                             {"coasting", c.coasting},
                                                             {"moving", c.moving},
                                                             {"imu_contradicted", c.imu_contradicted},
                                                             {"lost", c.lost},
                                                             {"features_used", c.features_used},
                                                             {"features_gated", c.features_gated},
                                                             {"landmarks_reacquired", c.landmarks_reacquired}};
  yaml << YAML::Key << "counters" << YAML::Value << YAML::BeginMap;
  for (const auto& [name, value] : front_end) yaml << YAML::Key << name << YAML::Value << value;
  for (const auto& [name, value] : reader) yaml << YAML::Key << name << YAML::Value << value;
  yaml << YAML::EndMap;
}

void emitStates(YAML::Emitter& yaml, const std::vector<StateChange>& states) {
  yaml << YAML::Key << "states" << YAML::Value << YAML::BeginSeq;
  for (const StateChange& change : states) {
    yaml << YAML::Flow << YAML::BeginMap << YAML::Key << "t" << YAML::Value << change.t << YAML::Key << "state"
         << YAML::Value << trackingStateName(change.status.state) << YAML::Key << "reason" << YAML::Value
         << change.status.reason << YAML::EndMap;
  }
  yaml << YAML::EndSeq;
}

void emitMap(YAML::Emitter& yaml, const MapSnapshot& map, std::size_t planes,
             const std::vector<GlobalBaRecord>& adjustments) {
  const auto put = [&yaml](const char* key, const auto& value) { yaml << YAML::Key << key << YAML::Value << value; };
  put("keyframes", map.keyframes.size());
  put("landmarks", map.landmarks.size());
  put("planes", planes);
  put("plane_landmarks", map.statistics.plane_landmarks);
  put("landmarks_found_again", map.statistics.reobserved);
  put("landmarks_merged", map.statistics.merged);
  put("outliers_removed", map.statistics.outliers);
  put("keyframes_without_imu", map.statistics.without_imu);
  put("odometry_variance_factor", map.statistics.odometry_variance);
  yaml << YAML::Key << "loops" << YAML::Value << YAML::BeginSeq;
  for (const LoopEvent& loop : map.loops) {
    yaml << YAML::Flow << YAML::BeginMap;
    put("t", loop.t);
    put("query", loop.query);
    put("match", loop.match);
    put("accepted", loop.accepted);
    put("inliers", loop.inliers);
    const auto match = std::find_if(map.keyframes.begin(), map.keyframes.end(),
                                    [&loop](const SnapshotKeyframe& k) { return k.id == loop.match; });
    if (match != map.keyframes.end()) put("t_match", match->t);  // otherwise it was culled meanwhile
    put("reason", loop.reason);
    yaml << YAML::EndMap;
  }
  yaml << YAML::EndSeq << YAML::Key << "global_ba" << YAML::Value << YAML::BeginSeq;
  for (const GlobalBaRecord& record : adjustments) {
    yaml << YAML::Flow << YAML::BeginMap;
    put("t", record.t);
    put("keyframes", record.keyframes);
    put("ms", record.milliseconds);
    yaml << YAML::EndMap;
  }
  yaml << YAML::EndSeq;
}

/// With the keys and units of a sensor file, so that it can be copied there.
void emitCalibration(YAML::Emitter& yaml, const CalibrationEstimate& calibration, const DepthCurve& depth_curve) {
  const auto list = [&yaml](const char* key, const Eigen::VectorXd& values) {
    yaml << YAML::Key << key << YAML::Value << YAML::Flow
         << std::vector<double>(values.data(), values.data() + values.size());
  };
  const auto rows = [&yaml](const char* key, const Eigen::MatrixXd& M) {
    yaml << YAML::Key << key << YAML::Value << YAML::BeginSeq;
    for (int r = 0; r < M.rows(); ++r) {
      const Eigen::VectorXd row = M.row(r);
      yaml << YAML::Flow << std::vector<double>(row.data(), row.data() + row.size());
    }
    yaml << YAML::EndSeq;
  };
  yaml << YAML::Key << "calibration" << YAML::Value << YAML::BeginMap;
  rows("T_imu_cam", calibration.T_I_C.matrix());
  yaml << YAML::Key << "time_offset" << YAML::Value << calibration.time_offset;
  list("sigma_rotation_deg", calibration.sigma_rotation / kDegree);
  list("sigma_translation", calibration.sigma_translation);
  yaml << YAML::Key << "sigma_time_offset" << YAML::Value << calibration.sigma_time_offset;
  list("intrinsics", calibration.intrinsics);
  list("sigma_bearing", calibration.sigma_bearing);
  yaml << YAML::Key << "depth_offset" << YAML::Value << calibration.depth_offset;
  yaml << YAML::Key << "sigma_depth_offset" << YAML::Value << calibration.sigma_depth_offset;
  if (calibration.sigma_depth_scale > 0) {
    const double unit = calibration.depth_unit > 0 ? calibration.depth_unit / calibration.depth_scale : 1.0;
    yaml << YAML::Key << "depth_scale" << YAML::Value << unit * calibration.depth_scale;
    yaml << YAML::Key << "sigma_depth_scale" << YAML::Value << unit * calibration.sigma_depth_scale;
  }
  if (calibration.sigma_depth_delay > 0) {
    yaml << YAML::Key << "depth_delay" << YAML::Value << calibration.depth_delay;
    yaml << YAML::Key << "sigma_depth_delay" << YAML::Value << calibration.sigma_depth_delay;
  }
  if (calibration.sigma_readout > 0) {
    yaml << YAML::Key << "rolling_shutter" << YAML::Value << calibration.readout;
    yaml << YAML::Key << "sigma_rolling_shutter" << YAML::Value << calibration.sigma_readout;
  }
  list("depth_shift", calibration.depth_shift_px);
  list("sigma_depth_shift", calibration.sigma_depth_shift);
  Eigen::VectorXd added(static_cast<Eigen::Index>(depth_curve.added.size()));
  for (Eigen::Index k = 0; k < added.size(); ++k) {
    added(k) = 1e-5 * std::round(1e5 * double(depth_curve.added[static_cast<std::size_t>(k)]));
  }
  list("depth_curve", added);
  rows("gyro_correction", calibration.gyro_correction);
  rows("sigma_gyro_correction", calibration.sigma_gyro_correction);
  yaml << YAML::EndMap;
}

std::string summary(const RunFacts& facts, const Pipeline& pipeline, const BagReader& reader, const MapSnapshot& map,
                    std::size_t planes) {
  const double duration = pipeline.duration();
  YAML::Emitter yaml;
  yaml.SetDoublePrecision(15);
  yaml << YAML::BeginMap;
  const auto put = [&yaml](const char* key, const auto& value) { yaml << YAML::Key << key << YAML::Value << value; };
  put("bag", facts.bag);
  put("sensor", facts.sensor);
  put("extrinsics", reader.extrinsicsSource());
  put("variant", facts.variant);
  put("loop_closing", facts.loop_closing);
  put("finished", facts.finished);
  put("duration", duration);
  put("processing_time", facts.processing_time);
  put("real_time_factor", duration / facts.processing_time);
  put("peak_memory_mb", peakMemoryMb());
  put("images", pipeline.images());
  put("tracked_images", pipeline.odometry().size());
  put("distance", lengthOf(pipeline.odometry()));
  put("epochs", pipeline.frontEnd().counters().restarts + 1);
  put("gyro_walk_factor", pipeline.frontEnd().counters().gyro_walk);
  put("accel_walk_factor", pipeline.frontEnd().counters().accel_walk);
  put("depth_noise_white", pipeline.frontEnd().counters().depth_white);
  put("depth_noise_shared", pipeline.frontEnd().counters().depth_shared);
  emitMap(yaml, map, planes,
          pipeline.mapping() ? pipeline.mapping()->globalAdjustments() : std::vector<GlobalBaRecord>());
  emitCounters(yaml, pipeline.frontEnd().counters(), reader.counters());
  const BackEnd* back_end = pipeline.mapping() ? &pipeline.mapping()->backEnd() : nullptr;
  emitCalibration(yaml, pipeline.frontEnd().calibration(),
                  chained(reader.sensor().depth_curve, back_end ? back_end->depthCurve() : DepthCurve()));
  emitStates(yaml, pipeline.states());
  put("warnings", runWarnings(pipeline, reader));
  yaml << YAML::EndMap;
  return yaml.c_str();
}

/// The upper triangle of each pose's covariance, row by row.
void writeCovariances(const std::string& path, const std::vector<OdometryCovariance>& covariances,
                      const MachineClock& clock) {
  AtomicFile file(path);
  file.stream() << "t";
  for (const char* name : {"xx", "xy", "xz", "xa", "xb", "xc", "yy", "yz", "ya", "yb", "yc",
                           "zz", "za", "zb", "zc", "aa", "ab", "ac", "bb", "bc", "cc"}) {
    file.stream() << ',' << name;
  }
  file.stream() << '\n';
  for (const OdometryCovariance& sample : covariances) {
    file.stream() << std::fixed << std::setprecision(9) << clock.stamp(sample.t) << std::scientific
                  << std::setprecision(8);
    for (int r = 0; r < 6; ++r) {
      for (int c = r; c < 6; ++c) file.stream() << ',' << sample.covariance(r, c);
    }
    file.stream() << '\n';
  }
  file.commit();
}

/// Map points with the plane they are tied to (0: none) and the keyframes that see them, for judging the associations.
void writePoints(const std::string& path, const std::vector<LandmarkEstimate>& landmarks) {
  AtomicFile file(path);
  file.stream() << "id,x,y,z,plane,keyframes\n" << std::fixed << std::setprecision(5);
  for (const LandmarkEstimate& landmark : landmarks) {
    file.stream() << landmark.id << ',' << landmark.p_W.x() << ',' << landmark.p_W.y() << ',' << landmark.p_W.z() << ','
                  << landmark.plane << ',' << landmark.observations << '\n';
  }
  file.commit();
}

/// All files named in docs/outputs.md, whether or not a run writes them.
constexpr const char* kFiles[] = {"trajectory.tum", "realtime.tum", "odometry.tum", "odometry_covariance.csv",
                                  "planes.yaml",    "planes.ply",   "points.csv",   "plane_history.csv",
                                  "floorplan.svg",  "map.vsm",      "timing.csv",   "summary.yaml",
                                  "report.html"};

}  // namespace

void writeRun(const std::string& folder, const RunFacts& facts, const Pipeline& pipeline, const BagReader& reader,
              const TimingLog& timing) {
  // Files of an earlier run in the same folder must not be mistaken for this run's.
  for (const char* name : kFiles) std::filesystem::remove(std::filesystem::path(folder) / name);
  const auto stamped = [&](Trajectory poses) {
    for (auto& pose : poses) pose.t = pipeline.machineClock().stamp(pose.t);
    return poses;
  };
  Trajectory odometry;
  for (const OdometryPose& pose : pipeline.odometry()) odometry.push_back({pose.t, pose.T_odom_I});
  writeTum(folder + "/odometry.tum", stamped(std::move(odometry)));
  writeCovariances(folder + "/odometry_covariance.csv", pipeline.covariances(), pipeline.machineClock());
  MapSnapshot map;
  std::vector<PlaneEstimate> planes;
  if (const MappingThread* mapping = pipeline.mapping()) {
    map = mapping->backEnd().snapshot();
    planes = mapping->planes();
    const Trajectory trajectory = anchorTrajectory(pipeline.chain(), anchorsOf(map));
    writeTum(folder + "/trajectory.tum", stamped(trajectory));
    writeTum(folder + "/realtime.tum", stamped(pipeline.realtime()));
    writePlanesYaml(folder + "/planes.yaml", planes);
    writePlanesPly(folder + "/planes.ply", planes);
    writeFloorPlan(folder + "/floorplan.svg", planes, trajectory);
    writePlaneHistory(folder + "/plane_history.csv", mapping->planeHistory());
    writePoints(folder + "/points.csv", map.landmarks);
    mapping->backEnd().saveMap(folder + "/map.vsm");
  }
  timing.writeCsv(folder + "/timing.csv");
  AtomicFile file(folder + "/summary.yaml");
  file.stream() << summary(facts, pipeline, reader, map, planes.size()) << "\n";
  file.commit();
}

}  // namespace vip_slam
