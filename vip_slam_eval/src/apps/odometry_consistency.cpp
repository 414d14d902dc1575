// SPDX-License-Identifier: BSD-3-Clause
// rosrun vip_slam_eval odometry_consistency SEQUENCE [--seeds N] [--seconds S] [--out FILE]
// Consistency of the odometry's covariance. One rendered sequence runs through the whole front end many times, each
// time with different noise in images, depth and IMU: errors common to all runs come from the scene, their scatter from
// the noise. Use --seeds 1 for the drift on a sequence that is too long to store as a bag.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>

#include <ros/package.h>
#include <opencv2/imgproc.hpp>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/util/atomic_file.h"
#include "vip_slam_core/util/command_line.h"
#include "vip_slam_eval/metrics/trajectory_consistency.h"
#include "vip_slam_eval/metrics/trajectory_metrics.h"
#include "vip_slam_frontend/filter/gating.h"
#include "vip_slam_frontend/front_end.h"
#include "vip_slam_sim/sequence/sequence_renderer.h"

namespace {

using namespace vip_slam;

constexpr int kSeedStep = 37;
constexpr double kDriftMetres = 10.0;
constexpr double kImuAhead = 0.02;  ///< s of IMU handed over beyond the image

/// Sets the initial bias sigmas to those with which the seeds draw their biases; otherwise the filter could not be
/// consistent, as the default sigmas are wider, to suit unknown sensors.
FrontEndOptions knowing(const SequenceSpec& spec, FrontEndOptions options) {
  if (spec.imu.gyro_bias > 0) options.filter.sigma_bias_gyro = spec.imu.gyro_bias;
  if (spec.imu.accel_bias > 0) options.filter.sigma_bias_accel = spec.imu.accel_bias;
  return options;
}

/// The front end on one noise seed.
class Run {
 public:
  Run(const SequenceRenderer& sequence, const FrontEndOptions& options, int seed)
      : sequence_(sequence),
        front_end_(knowing(sequence.spec(), options), sequence.sensor()),
        effects_(sequence.spec().effects, sequence.spec().depth, *sequence.camera(), seed),
        imu_(synthesiseImu(sequence.trajectory(), sequence.spec().imu, seed, sequence.sensor().gravity)) {}

  void add(const SimFrame& frame) {
    const double t = sequence_.toSeconds(frame.stamp_ns);
    const cv::Mat rgb = effects_.colour(frame.exact, frame.index, t);
    cv::Mat gray, depth;
    cv::cvtColor(rgb, gray, cv::COLOR_RGB2GRAY);
    effects_.depth(frame.exact, rgb, frame.index).convertTo(depth, CV_32F, 0.001);
    const double until = t + sequence_.spec().imu.time_offset + kImuAhead;
    for (; next_ < imu_.samples.size() && imu_.samples[next_].t < until; ++next_) {
      front_end_.addImu(imu_.samples[next_]);
    }
    const TrackedFramePtr tracked = front_end_.process({t, gray, depth}).frame;
    if (!hasPose(tracked->status.state)) return;
    poses_.push_back({t, tracked->state.T_W_I, poseCovariance(*tracked)});
  }
  const std::vector<PoseWithCovariance>& poses() const { return poses_; }

 private:
  const SequenceRenderer& sequence_;
  FrontEnd front_end_;
  SensorEffects effects_;
  ImuLog imu_;
  std::size_t next_ = 0;
  std::vector<PoseWithCovariance> poses_;
};

/// Drift over 10 m of the path or, for a camera that stays in place, the largest estimated displacement.
void printDrift(const Trajectory& truth, const std::vector<PoseWithCovariance>& poses) {
  Trajectory estimate;
  for (const PoseWithCovariance& pose : poses) estimate.push_back({pose.t, pose.T_M_B});
  const std::vector<PosePair> pairs = associate(truth, estimate);
  const RelativeError drift = relativeErrorOverDistance(pairs, kDriftMetres);
  if (drift.position.count > 0) {
    std::printf("  over %.0f m: %.3f %% mean, %.3f rmse; %.4f deg/m mean\n", kDriftMetres,
                100 * drift.position.mean / kDriftMetres, 100 * drift.position.rmse / kDriftMetres,
                drift.rotation.mean / kDriftMetres);
    return;
  }
  double farthest = 0, turned = 0;
  for (const PosePair& pair : pairs) {
    const SE3 truly = pairs.front().T_W_B.inverse() * pair.T_W_B;
    const SE3 seemingly = pairs.front().T_M_B.inverse() * pair.T_M_B;
    farthest = std::max(farthest, (seemingly.t() - truly.t()).norm());
    turned = std::max(turned, logSO3(truly.rotation().conjugate() * seemingly.rotation()).norm());
  }
  std::printf("  off at most %.2f mm, %.3f deg\n", 1000 * farthest, turned / kDegree);
}

/// Errors and the sigmas reported by the filter, one line per image.
void writeErrors(std::ostream& out, int seed, const std::vector<JoinedError>& errors) {
  for (const JoinedError& e : errors) {
    out << seed << ',' << e.t << ',' << e.nees;
    for (int k = 0; k < 6; ++k) out << ',' << e.error[k];
    for (int k = 0; k < 6; ++k) out << ',' << std::sqrt(e.covariance(k, k));
    out << '\n';
  }
}

struct Study {
  SequenceSpec spec;
  FrontEndOptions options;
  int seeds = 20, first_seed = 1000, threads = 2;
  double seconds = 30;
  std::string out;
};

void judge(const Study& study) {
  const SequenceSpec& spec = study.spec;
  const int seeds = study.seeds;
  if (spec.depth.separate()) throw std::invalid_argument(spec.name + ": needs depth from the colour camera's own rays");
  RenderOptions options;
  options.threads = study.threads;
  options.count = static_cast<int>(study.seconds * spec.camera.rate);
  SequenceRenderer sequence(spec, options);
  std::vector<std::unique_ptr<Run>> runs;
  for (int i = 0; i < seeds; ++i)
    runs.push_back(std::make_unique<Run>(sequence, study.options, study.first_seed + kSeedStep * i));
  Trajectory truth;
  sequence.render([&](const SimFrame& frame) {
    const double t = sequence.toSeconds(frame.stamp_ns);
    truth.push_back({t, sequence.stateAt(t + spec.imu.time_offset).T_W_I});
    for (const auto& run : runs) run->add(frame);
    return true;
  });
  std::optional<AtomicFile> file;
  if (!study.out.empty()) {
    file.emplace(study.out);
    file->stream() << "seed,t,nees,x,y,z,rx,ry,rz,sx,sy,sz,srx,sry,srz\n";
  }
  double pose = 0, position = 0, rotation = 0;
  int judged = 0;  // seeds with poses
  for (int i = 0; i < seeds; ++i) {
    if (file) writeErrors(file->stream(), i, joinedErrors(truth, runs[i]->poses()));
    const Nees result = nees(truth, runs[i]->poses());
    if (result.pose.count == 0) {
      std::printf("seed %2d  no pose that could be judged (%zu poses)\n", i, runs[i]->poses().size());
      continue;
    }
    ++judged;
    std::printf("seed %2d  NEES pose %6.2f  position %6.2f  rotation %6.2f  poses %zu,", i, result.pose.mean,
                result.position.mean, result.rotation.mean, runs[i]->poses().size());
    printDrift(truth, runs[i]->poses());
    if (result.unusable > 0) std::printf("         %zu covariances are none and were left out\n", result.unusable);
    pose += result.pose.mean;
    position += result.position.mean;
    rotation += result.rotation.mean;
  }
  if (judged == 0) throw std::runtime_error(spec.name + ": the odometry began with no seed, nothing can be judged");
  pose /= judged, position /= judged, rotation /= judged;
  if (judged < seeds) std::printf("%d of %d seeds have no poses and are not counted\n", seeds - judged, seeds);
  const double low = chiSquareQuantile(0.025, 6 * judged) / judged;
  const double high = chiSquareQuantile(0.975, 6 * judged) / judged;
  std::printf("mean over %d seeds: pose %.2f (honest: 6, 95 %% band %.2f to %.2f: %s), position %.2f, rotation %.2f\n",
              judged, pose, low, high, pose >= low && pose <= high ? "inside" : "outside", position, rotation);
  if (file) file->commit();
}

}  // namespace

int main(int argc, char** argv) {
  vip_slam::CommandLine line("odometry_consistency",
                             "NEES of the odometry over many noise seeds of one rendered sequence.");
  Study study;
  std::string sequence;
  std::vector<std::string> settings;
  line.argument("sequence", sequence, "name of a shipped sequence or a .yaml file");
  line.option("seeds", study.seeds, "noise seeds", vip_slam::above(0));
  line.option("first-seed", study.first_seed, "the first of them");
  line.option("seconds", study.seconds, "length of the sequence's beginning that is used, s", vip_slam::above(0.0));
  line.option("threads", study.threads, "rendering threads", vip_slam::above(0));
  line.option("set", settings, "one option of the front end as group/key=value; repeatable");
  line.option("out", study.out, "CSV file for the errors and sigmas of every image");
  if (const auto status = line.parse(argc, argv)) return *status;
  try {
    const std::string library = ros::package::getPath("vip_slam_sim") + "/config/sequences.yaml";
    study.spec = vip_slam::loadSequence(sequence, library);
    vip_slam::setOptions(study.options, vip_slam::splitSettings(settings));
    judge(study);
  } catch (const std::exception& e) {
    std::cerr << "odometry_consistency: " << e.what() << '\n';
    return 1;
  }
  return 0;
}
