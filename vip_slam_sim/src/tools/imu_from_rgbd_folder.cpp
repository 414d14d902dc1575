// SPDX-License-Identifier: BSD-3-Clause
// imu_from_rgbd_folder FOLDER --out DIR: real RGB-D images with poses become a bag with a synthetic IMU, or without
// any.
#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>
#include <limits>
#include <string>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/util/command_line.h"
#include "vip_slam_core/util/output_folder.h"
#include "vip_slam_core/util/progress_bar.h"
#include "vip_slam_sim/io/pose_accuracy.h"
#include "vip_slam_sim/io/rgbd_folder.h"
#include "vip_slam_sim/io/sequence_writer.h"

namespace fs = std::filesystem;
using namespace vip_slam;

namespace {

volatile std::sig_atomic_t interrupted = 0;

struct Settings {
  std::string folder, out, name, format = "bag";
  std::vector<double> up;  ///< in the folder's world; empty: from the depth images
  std::vector<double> intrinsics;
  bool registered = false;
  double rate = 30, spacing = 0, depth_factor = 0;
  int iterations = 20, seed = 1;
  bool nominal_noise = false, refine = false, no_imu = false;
  ImuOptions imu;
};

/// Prints the largest and the RMS distance of the spline from the poses to which it was fitted; returns the RMS per
/// axis.
PoseSigma reportFit(const SplineTrajectory& spline, const Trajectory& poses) {
  double position = 0, angle = 0, worst = 0;
  for (const StampedPose& p : poses) {
    const MotionState m = spline.at(p.t);
    const double d = (m.T_W_I.t() - p.T_W_B.t()).norm();
    position += d * d;
    worst = std::max(worst, d);
    angle += logSO3(m.T_W_I.rotation().conjugate() * p.T_W_B.rotation()).squaredNorm();
  }
  const double n = static_cast<double>(poses.size());
  std::fprintf(stderr, "spline: %.1f mm and %.2f deg RMS from the given poses, %.1f mm at most\n",
               1000 * std::sqrt(position / n), std::sqrt(angle / n) / kDegree, 1000 * worst);
  return {std::sqrt(angle / (3 * n)), std::sqrt(position / (3 * n))};
}

/// The noise of the IMU synthesised from these poses; prints the contributions.
ImuNoise coveringNoise(const ImuNoise& own, const PoseSigma& jitter, const RgbdFolder& folder) {
  // The estimators compare the IMU with images, so errors of poses between two images do not matter.
  const double interval = std::max(poseInterval(folder.T_W_C), imageInterval(folder));
  std::vector<DepthDisagreement> drift;
  for (const DepthDisagreement& d : posesAgainstDepth(folder, folder.T_W_C, {interval, 0.1, 0.3, 1.0})) {
    if (!drift.empty() && d.lag < 1.5 * drift.back().lag) continue;
    drift.push_back(d);
    if (d.pairs == 0)
      std::fprintf(stderr, "poses against depth over %.2f s: too few images with surfaces in three directions\n",
                   d.lag);
    else
      std::fprintf(stderr, "poses against depth over %.2f s: %.1f mm and %.2f deg per axis (%d pairs)\n", d.lag,
                   1000 * d.error.position, d.error.rotation / kDegree, d.pairs);
  }
  const ImuNoise noise = noiseOfImuFromPoses(own, jitter, interval, drift);
  std::fprintf(stderr,
               "noise densities in the sensor file: gyro %.2g rad/s/sqrt(Hz), accelerometer %.2g m/s^2/sqrt(Hz)\n",
               noise.gyro_noise_density, noise.accel_noise_density);
  return noise;
}

/// Refines the folder's poses by its depth images and prints by how much they moved.
void refine(RgbdFolder* folder) {
  const Trajectory given = folder->T_W_C;
  const DepthDisagreement drift = posesAgainstDepth(*folder, given, {1.0})[0];
  if (drift.pairs == 0)
    throw std::runtime_error("--refine: too few depth images with surfaces in three directions, or less than a second");
  folder->T_W_C = refinePoses(*folder, poseJitter(given), drift.error);
  double sum = 0, worst = 0;
  for (const StampedPose& p : folder->T_W_C) {
    SE3 T;
    if (!poseAt(given, p.t, &T)) continue;
    const double moved = (p.T_W_B.t() - T.t()).norm();
    sum += moved * moved;
    worst = std::max(worst, moved);
  }
  std::fprintf(stderr, "given poses against depth over %.2f s: %.1f mm and %.2f deg per axis\n", drift.lag,
               1000 * drift.error.position, drift.error.rotation / kDegree);
  std::fprintf(stderr, "refined: poses moved by %.1f mm RMS, %.1f mm at most\n",
               1000 * std::sqrt(sum / static_cast<double>(folder->T_W_C.size())), 1000 * worst);
}

SensorConfig sensorOf(const Settings& s, const RgbdFolder& folder, const SequenceSpec& rig) {
  SensorConfig sensor = rig.sensorConfig();
  sensor.name = s.name;
  sensor.camera = folder.camera;
  sensor.depth_camera = folder.depth_camera;
  sensor.T_color_depth = folder.T_color_depth;
  sensor.rolling_shutter = folder.colour_readout;
  sensor.color_rate = sensor.depth_rate = 1.0 / imageInterval(folder);
  sensor.imu_rate = s.imu.rate;
  sensor.depth_noise = DepthNoise::preset(DepthSensorType::kStructuredLight);
  return sensor;
}

void catchInterrupts() {
  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::signal(SIGTERM, [](int) { interrupted = 1; });
}

/// The folder as an RGB-D camera without IMU: the body is the colour camera, and the truth are the poses as they are.
void writeWithoutImu(const Settings& s, const RgbdFolder& folder) {
  if (s.format != "bag") throw std::runtime_error("--no-imu: is for bags, expected --format bag");
  SequenceSpec rig;
  rig.depth.registered = folder.depth_registered;
  SensorConfig sensor = sensorOf(s, folder, rig);
  sensor.topics.imu.clear();
  sensor.T_imu_cam = SE3();
  const double begin = folder.frames.front().t;
  const auto start_ns = std::llround(rig.start_time) * 1000000000LL;
  const auto stamp = [&](double t) { return start_ns + std::llround((t - begin) * 1e9); };
  prepareOutputFolder(s.out);
  const std::string base = (fs::path(s.out) / s.name).string();
  const auto writer = makeBagWriter(base + ".bag", sensor, start_ns);
  catchInterrupts();
  ProgressBar bar(s.name);
  for (std::size_t i = 0; i < folder.frames.size(); ++i) {
    if (interrupted) throw std::runtime_error("interrupted, nothing is left behind");
    SimFrame frame;
    frame.index = static_cast<int>(i);
    frame.stamp_ns = stamp(folder.frames[i].t);
    frame.depth_stamp_ns = stamp(folder.frames[i].t_depth);
    loadRgbdFrame(folder, folder.frames[i], &frame.rgb, &frame.depth);
    writer->frame(frame);
    bar.update(double(i + 1) / double(folder.frames.size()));
  }
  bar.finish(std::to_string(folder.frames.size()) + " images");
  Trajectory truth = folder.T_W_C;
  for (StampedPose& p : truth) p.t = static_cast<double>(stamp(p.t)) * 1e-9;
  saveSensorConfig(base + "_sensor.yaml", sensor);
  writeTum(base + "_truth.tum", truth);
  writer->commit();
}

int run(int argc, char** argv) {
  Settings s;
  CommandLine line("imu_from_rgbd_folder", "Gives a folder of RGB-D images with poses an IMU, and writes a bag.");
  line.argument("folder", s.folder, "7-Scenes or TUM layout");
  line.option("out", s.out, "directory for NAME.bag, NAME_truth.tum, NAME_sensor.yaml");
  line.required("out");
  line.option("name", s.name, "default: the folder's name");
  line.option("up", s.up, "up vector in the world of the poses; default: from floors and walls in the depth",
              count<double>(3, 3));
  line.option("intrinsics", s.intrinsics, "fx fy cx cy [k1 k2 p1 p2 [k3]] of the colour camera", count<double>(4, 9));
  line.flag("registered", s.registered,
            "7-Scenes layout: depth, intrinsics and poses belong to the colour camera, not to one of its own");
  line.option("depth-factor", s.depth_factor,
              "depth units per metre; 0: 1000 in the 7-Scenes layout, 1000 or 5000 in TUM's, as the images tell",
              between(0.0, 1e6));
  line.option("rate", s.rate, "images per second, where the folder has no stamps", between(1.0, 120.0));
  line.option("spacing", s.spacing,
              "seconds between spline knots; default: the widest that stays within the poses' jitter",
              between(0.02, 2.0));
  line.option("iterations", s.iterations, "corrections towards the poses", between(0, 50));
  line.option("imu-rate", s.imu.rate, "Hz", between(50.0, 2000.0));
  line.option("seed", s.seed, "of the IMU's noise");
  line.flag("refine", s.refine,
            "mend the poses by registering the depth images; NAME_given.tum keeps those of the folder");
  line.flag("nominal-noise", s.nominal_noise,
            "the sensor file states the IMU's own noise, not what the poses' errors add to it");
  line.flag("no-imu", s.no_imu, "make no IMU: a bag of an RGB-D camera alone, with the colour camera's poses as truth");
  line.option("format", s.format, "bag or folder", oneOf("bag, folder"));
  if (const auto status = line.parse(argc, argv)) return *status;
  if (s.name.empty())
    s.name = fs::path(s.folder).filename().empty() ? fs::path(s.folder).parent_path().filename().string()
                                                   : fs::path(s.folder).filename().string();
  RgbdFolder folder = openRgbdFolder(s.folder, s.rate, s.registered, s.depth_factor);
  if (folder.depth_guess)
    std::fprintf(stderr, "depth: %g units per metre are guessed%s: %s (--depth-factor says otherwise)\n",
                 folder.depth_guess->units_per_metre, folder.depth_guess->certain ? "" : ", not for certain",
                 folder.depth_guess->reason.c_str());
  if (!s.intrinsics.empty()) {
    if (s.intrinsics.size() != 4 && s.intrinsics.size() != 8 && s.intrinsics.size() != 9)
      throw std::runtime_error("--intrinsics: " + std::to_string(s.intrinsics.size()) +
                               " numbers, expected fx fy cx cy, with k1 k2 p1 p2, or k1 k2 p1 p2 k3");
    folder.camera.fx = s.intrinsics[0];
    folder.camera.fy = s.intrinsics[1];
    folder.camera.cx = s.intrinsics[2];
    folder.camera.cy = s.intrinsics[3];
    folder.camera.distortion.assign(s.intrinsics.begin() + 4, s.intrinsics.end());
    folder.camera.model = s.intrinsics.size() > 4 ? DistortionModel::kRadTan : DistortionModel::kNone;
  }
  if (!folder.camera.validate().empty())
    throw std::runtime_error(s.folder + ": " + folder.camera.validate() + "; give --intrinsics FX FY CX CY");
  const Trajectory given = folder.T_W_C;
  if (s.refine) refine(&folder);
  if (s.no_imu) {
    writeWithoutImu(s, folder);
    return 0;
  }
  const Eigen::Vector3d up = s.up.empty() ? upFromDepth(folder) : Eigen::Vector3d(s.up[0], s.up[1], s.up[2]);
  if (!(up.norm() > 1e-6)) throw std::runtime_error("--up: expected a vector that is not zero");
  std::fprintf(stderr, "up in the folder's world: %.4f %.4f %.4f\n", up.x() / up.norm(), up.y() / up.norm(),
               up.z() / up.norm());

  // Level world, first camera above the origin; body = IMU of the simulator's rig.
  SequenceSpec rig;
  rig.depth.registered = folder.depth_registered;
  const double begin = folder.T_W_C.front().t;
  const SE3 level(gravityAlignedRotation(up), Eigen::Vector3d::Zero());
  const Eigen::Vector3d origin = level * folder.T_W_C.front().T_W_B.t();
  const SE3 place(level.rotation(), -origin);
  const auto bodyOf = [&](const Trajectory& cameras) {
    Trajectory out;
    for (const StampedPose& p : cameras) out.push_back({p.t - begin, place * p.T_W_B * rig.T_imu_cam().inverse()});
    return out;
  };
  const Trajectory body = bodyOf(folder.T_W_C);
  const PoseSigma jitter = poseJitter(body);
  if (s.spacing == 0) s.spacing = splineSpacing(body, jitter, s.iterations);
  std::fprintf(stderr, "jitter of the poses: %.2f mm and %.3f deg per axis; spline knots %.0f ms apart\n",
               1000 * jitter.position, jitter.rotation / kDegree, 1000 * s.spacing);
  const SplineTrajectory spline = SplineTrajectory::fit(body, s.spacing, s.iterations);
  const PoseSigma fit = reportFit(spline, body);
  const ImuLog imu = synthesiseImu(spline, s.imu, s.seed);

  SensorConfig sensor = sensorOf(s, folder, rig);
  if (!s.nominal_noise) {
    const PoseSigma error{std::max(jitter.rotation, fit.rotation), std::max(jitter.position, fit.position)};
    sensor.imu_noise = coveringNoise(sensor.imu_noise, error, folder);
  }
  const auto start_ns = std::llround(rig.start_time) * 1000000000LL;
  const auto stamp = [&](double t) { return start_ns + std::llround(t * 1e9); };
  prepareOutputFolder(s.out);
  const std::string base = (fs::path(s.out) / s.name).string();
  std::unique_ptr<SequenceWriter> writer =
      s.format == "bag" ? makeBagWriter(base + ".bag", sensor, start_ns) : makeFolderWriter(base);
  Trajectory truth;
  std::size_t next = 0;
  const auto imuUntil = [&](std::int64_t ns) {
    for (; next < imu.samples.size() && stamp(imu.samples[next].t) <= ns; ++next) {
      NavState x;
      const MotionState m = spline.at(imu.samples[next].t);
      x.T_W_I = m.T_W_I;
      x.v_W = m.v_W;
      x.bias_gyro = imu.biases[next].gyro;
      x.bias_accel = imu.biases[next].accel;
      writer->imu(stamp(imu.samples[next].t), imu.samples[next], x, m.omega_I);
      truth.push_back({static_cast<double>(stamp(imu.samples[next].t)) * 1e-9, m.T_W_I});
    }
  };
  catchInterrupts();
  ProgressBar bar(s.name);
  for (std::size_t i = 0; i < folder.frames.size(); ++i) {
    if (interrupted) throw std::runtime_error("interrupted, nothing is left behind");
    const double t = folder.frames[i].t - begin;
    if (t < 0 || t > spline.end() - 1.0 / s.imu.rate) continue;  // no IMU samples at this time
    SimFrame frame;
    frame.index = static_cast<int>(i);
    frame.stamp_ns = stamp(t);
    frame.depth_stamp_ns = stamp(folder.frames[i].t_depth - begin);
    frame.T_W_C = spline.at(t).T_W_I * rig.T_imu_cam();
    loadRgbdFrame(folder, folder.frames[i], &frame.rgb, &frame.depth);
    imuUntil(frame.stamp_ns);
    writer->frame(frame);
    bar.update(double(i + 1) / double(folder.frames.size()));
  }
  bar.finish(std::to_string(folder.frames.size()) + " images");
  imuUntil(std::numeric_limits<std::int64_t>::max());
  saveSensorConfig(base + "_sensor.yaml", sensor);
  writeTum(base + "_truth.tum", truth);
  if (s.refine) {
    Trajectory poses = bodyOf(given);
    for (StampedPose& p : poses) p.t = static_cast<double>(stamp(p.t)) * 1e-9;
    writeTum(base + "_given.tum", poses);
  }
  writer->commit();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& e) {
    std::cerr << "imu_from_rgbd_folder: " << e.what() << "\n";
    return 1;
  }
}
