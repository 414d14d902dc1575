// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_eval/plane_benchmark/plane_benchmark.h"
#include "vip_slam_core/util/progress_bar.h"

#include <stdexcept>
#include <tuple>

#include "plane_benchmark/true_map.h"
#include "vip_slam_bringup/runner/bag_reader.h"
#include "vip_slam_eval/report/plane_tables.h"
#include "vip_slam_frontend/front_end.h"
#include "vip_slam_ros/sensor_files.h"

namespace vip_slam {
namespace {

/// Front end, true map and plane mapper, run in lock-step.
class Bench {
 public:
  Bench(const PlaneBenchmarkInput& input, const SensorConfig& sensor, TimingLog* timing)
      : front_end_(input.options.frontend, sensor),
        mapper_(input.options.planes, makeCamera(sensor.camera), sensor.depth_noise, timing),
        map_(input.truth, sensor) {}

  void add(const SensorEvent& event) {
    if (const auto* imu = std::get_if<ImuSample>(&event)) {
      front_end_.addImu(*imu);
    } else if (const auto* gyro = std::get_if<GyroSample>(&event)) {
      front_end_.addGyro(gyro->t, gyro->gyro);
    } else if (const auto* accel = std::get_if<AccelSample>(&event)) {
      front_end_.addAccel(accel->t, accel->accel);
    } else if (const auto* pair = std::get_if<ImagePair>(&event)) {
      waiting_.push_back(*pair);
    } else if (std::holds_alternative<TimeJump>(event)) {
      waiting_.clear();  // time jumped back; the front end detects that by itself
    }
    while (!waiting_.empty() && front_end_.ready(waiting_.front().t, waiting_.front().depth_lag)) {
      process(waiting_.front());
      waiting_.pop_front();
    }
  }

  PlaneBenchmarkResult finish(const PlaneBenchmarkInput& input) {
    map_.apply(mapper_.applyMapUpdate({}));  // changes since the last keyframe
    result_.planes = mapper_.planes();
    result_.points = map_.points();
    if (input.true_planes) {
      result_.metrics = planeMetrics(*input.true_planes, result_.planes);
      result_.associations = associationMetrics(result_.points, *input.true_planes, *result_.metrics,
                                                input.options.planes.association.min_keyframes);
    }
    result_.counters = mapper_.counters();
    return result_;
  }

 private:
  void process(const ImagePair& pair) {
    const FrameOutput output = front_end_.process({pair.t, pair.gray, pair.depth, pair.depth_lag});
    ++result_.images;
    if (output.keyframe) {
      auto keyframe = std::make_shared<Keyframe>(*output.keyframe);
      if (map_.place(&keyframe->frame)) {
        ++result_.keyframes;
        mapper_.addKeyframe(keyframe);
        const MapUpdate placed = map_.addKeyframe(*keyframe);
        map_.apply(mapper_.applyMapUpdate(placed));
        for (const PlaneEstimate& plane : mapper_.planes())
          result_.history.push_back({keyframe->frame.t, plane.id, plane.plane});
      }
    }
    TrackedFrame frame = *output.frame;
    if (map_.place(&frame)) mapper_.grow(frame, SE3());
  }

  FrontEnd front_end_;
  PlaneMapper mapper_;
  TrueMap map_;
  std::deque<ImagePair> waiting_;
  PlaneBenchmarkResult result_;
};

}  // namespace

PlaneBenchmarkResult runPlaneBenchmark(const PlaneBenchmarkInput& input, TimingLog* timing) {
  SensorConfig sensor = loadSensorConfig(resolveSensor(input.sensor));
  BagReaderOptions reading;
  reading.input = input.options.input;
  reading.start = input.start;
  reading.duration = input.duration;
  BagReader reader(input.bag, sensor, reading);
  Bench bench(input, sensor, timing);
  ProgressBar progress("plane_benchmark");
  reader.start();
  while (const auto event = reader.next()) {
    bench.add(*event);
    if (const auto* pair = std::get_if<ImagePair>(&*event)) {
      progress.update((pair->t - reader.beginTime()) / (reader.endTime() - reader.beginTime()));
    }
  }
  PlaneBenchmarkResult result = bench.finish(input);
  progress.finish(std::to_string(result.keyframes) + " keyframes");
  if (result.keyframes == 0) {
    throw std::runtime_error(input.bag + ": no keyframe at a time that the truth covers, expected the same clock");
  }
  return result;
}

MetricTable metricsOf(const PlaneBenchmarkResult& result, const TimingLog& timing) {
  MetricTable table;
  table.push_back({"run", "images", double(result.images), ""});
  table.push_back({"run", "keyframes", double(result.keyframes), ""});
  table.push_back({"run", "planes started", double(result.counters.planes_started), ""});
  table.push_back({"run", "planes merged", double(result.counters.planes_merged), ""});
  table.push_back({"run", "planes removed", double(result.counters.planes_removed), ""});
  if (result.metrics) appendPlaneMetrics(&table, *result.metrics);
  if (result.associations) appendAssociationMetrics(&table, *result.associations);
  using Clock = TimingLog::Clock;
  for (const auto& [stage, clock, name] : {std::tuple("planes.update", Clock::kElapsed, "keyframe"),
                                           std::tuple("planes.grow", Clock::kElapsed, "growth frame"),
                                           std::tuple("planes.update", Clock::kProcessor, "keyframe computing"),
                                           std::tuple("planes.grow", Clock::kProcessor, "growth frame computing")}) {
    const TimingSummary time = timing.summary(stage, clock);
    table.push_back({"time", std::string(name) + " median", time.median, "ms"});
    table.push_back({"time", std::string(name) + " 99 %", time.p99, "ms"});
    table.push_back({"time", std::string(name) + " max", time.max, "ms"});
  }
  return table;
}

}  // namespace vip_slam
