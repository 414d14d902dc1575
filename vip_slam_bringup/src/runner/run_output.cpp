#include "vip_slam_bringup/runner/run_output.h"

#include <sys/resource.h>

#include <yaml-cpp/yaml.h>

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
  const std::pair<const char*, std::uint64_t> front_end[] = {
      {"restarts", c.restarts},         {"bad_image", c.bad_image},
      {"bad_depth", c.bad_depth},       {"no_depth", c.no_depth},
      {"bad_stamp", c.bad_stamp},       {"imu_rejected", c.imu_rejected},
      {"imu_gaps", c.imu_gaps},         {"imu_missing", c.imu_missing},
      {"zero_velocity", c.zero_velocity}, {"coasting", c.coasting},
      {"lost", c.lost},                 {"features_used", c.features_used},
      {"features_gated", c.features_gated}, {"landmarks_reacquired", c.landmarks_reacquired}};
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

std::string summary(const RunFacts& facts, const Pipeline& pipeline, const BagReader& reader) {
  const double duration = reader.endTime() - reader.beginTime();
  YAML::Emitter yaml;
  yaml.SetDoublePrecision(15);
  yaml << YAML::BeginMap;
  const auto put = [&yaml](const char* key, const auto& value) { yaml << YAML::Key << key << YAML::Value << value; };
  put("bag", facts.bag);
  put("sensor", facts.sensor);
  put("finished", facts.finished);
  put("duration", duration);
  put("processing_time", facts.processing_time);
  put("real_time_factor", duration / facts.processing_time);
  put("peak_memory_mb", peakMemoryMb());
  put("images", pipeline.images());
  put("tracked_images", pipeline.odometry().size());
  put("keyframes", pipeline.frontEnd().counters().keyframes);
  put("distance", lengthOf(pipeline.odometry()));
  put("epochs", pipeline.frontEnd().counters().restarts + 1);
  emitCounters(yaml, pipeline.frontEnd().counters(), reader.counters());
  emitStates(yaml, pipeline.states());
  put("warnings", reader.warnings());
  yaml << YAML::EndMap;
  return yaml.c_str();
}

}  // namespace

void writeRun(const std::string& folder, const RunFacts& facts, const Pipeline& pipeline, const BagReader& reader,
              const TimingLog& timing) {
  Trajectory odometry;
  for (const OdometryPose& pose : pipeline.odometry()) odometry.push_back({pose.t, pose.T_odom_I});
  writeTum(folder + "/odometry.tum", odometry);
  timing.writeCsv(folder + "/timing.csv");
  AtomicFile file(folder + "/summary.yaml");
  file.stream() << summary(facts, pipeline, reader) << "\n";
  file.commit();
}

}  // namespace vip_slam
