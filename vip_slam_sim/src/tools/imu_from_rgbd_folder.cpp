// imu_from_rgbd_folder FOLDER --out DIR: real RGB-D images with poses become a bag with a synthetic IMU.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>
#include <limits>
#include <string>

#include "progress_bar.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/util/command_line.h"
#include "vip_slam_sim/io/rgbd_folder.h"
#include "vip_slam_sim/io/sequence_writer.h"

namespace fs = std::filesystem;
using namespace vip_slam;

namespace {

struct Settings {
  std::string folder, out, name, format = "bag";
  std::vector<double> up;  ///< in the folder's world; empty: from the depth images
  std::vector<double> intrinsics;
  bool registered = false;
  double rate = 30, spacing = 0.15;
  int iterations = 3, seed = 1;
  ImuOptions imu;
};

/// Largest and root-mean-square distance of the spline from the poses it was fitted to.
void reportFit(const SplineTrajectory& spline, const Trajectory& poses) {
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
               1000 * std::sqrt(position / n), std::sqrt(angle / n) * 180 / M_PI, 1000 * worst);
}

SensorConfig sensorOf(const Settings& s, const RgbdFolder& folder, const SequenceSpec& rig) {
  SensorConfig sensor = rig.sensorConfig();
  sensor.name = s.name;
  sensor.camera = folder.camera;
  sensor.depth_camera = folder.depth_camera;
  sensor.T_color_depth = folder.T_color_depth;
  sensor.color_rate = sensor.depth_rate = s.rate;
  sensor.depth_noise = DepthNoise::preset(DepthSensorType::kStructuredLight);
  return sensor;
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
  line.option("intrinsics", s.intrinsics, "fx fy cx cy of the colour camera", count<double>(4, 4));
  line.flag("registered", s.registered,
            "7-Scenes layout: depth, intrinsics and poses belong to the colour camera, not to one of its own");
  line.option("rate", s.rate, "images per second, where the folder has no stamps", between(1.0, 120.0));
  line.option("spacing", s.spacing, "seconds between spline knots: smooths the poses' noise", between(0.02, 2.0));
  line.option("iterations", s.iterations, "corrections towards the poses", between(0, 50));
  line.option("imu-rate", s.imu.rate, "Hz", between(50.0, 2000.0));
  line.option("seed", s.seed, "of the IMU's noise");
  line.option("format", s.format, "bag or folder", oneOf("bag, folder"));
  if (const auto status = line.parse(argc, argv)) return *status;
  if (s.name.empty())
    s.name = fs::path(s.folder).filename().empty() ? fs::path(s.folder).parent_path().filename().string()
                                                   : fs::path(s.folder).filename().string();
  RgbdFolder folder = openRgbdFolder(s.folder, s.rate, s.registered);
  if (s.intrinsics.size() == 4) {
    folder.camera.fx = s.intrinsics[0];
    folder.camera.fy = s.intrinsics[1];
    folder.camera.cx = s.intrinsics[2];
    folder.camera.cy = s.intrinsics[3];
  }
  if (!folder.camera.validate().empty())
    throw std::runtime_error(s.folder + ": " + folder.camera.validate() + "; give --intrinsics FX FY CX CY");
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
  Trajectory body;
  for (const StampedPose& p : folder.T_W_C) body.push_back({p.t - begin, place * p.T_W_B * rig.T_imu_cam().inverse()});
  const SplineTrajectory spline = SplineTrajectory::fit(body, s.spacing, s.iterations);
  reportFit(spline, body);
  const ImuLog imu = synthesiseImu(spline, s.imu, s.seed);

  const SensorConfig sensor = sensorOf(s, folder, rig);
  const auto start_ns = std::llround(rig.start_time) * 1000000000LL;
  const auto stamp = [&](double t) { return start_ns + std::llround(t * 1e9); };
  fs::create_directories(s.out);
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
      writer->imu(stamp(imu.samples[next].t), imu.samples[next], x);
      truth.push_back({static_cast<double>(stamp(imu.samples[next].t)) * 1e-9, m.T_W_I});
    }
  };
  ProgressBar bar(s.name, static_cast<int>(folder.frames.size()));
  for (std::size_t i = 0; i < folder.frames.size(); ++i) {
    const double t = folder.frames[i].t - begin;
    if (t < 0 || t > spline.end() - 1.0 / s.imu.rate) continue;  // no IMU there
    SimFrame frame;
    frame.index = static_cast<int>(i);
    frame.stamp_ns = stamp(t);
    frame.T_W_C = spline.at(t).T_W_I * rig.T_imu_cam();
    loadRgbdFrame(folder, folder.frames[i], &frame.rgb, &frame.depth);
    imuUntil(frame.stamp_ns);
    writer->frame(frame);
    bar.update(static_cast<int>(i) + 1);
  }
  bar.finish();
  imuUntil(std::numeric_limits<std::int64_t>::max());
  saveSensorConfig(base + "_sensor.yaml", sensor);
  writeTum(base + "_truth.tum", truth);
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
