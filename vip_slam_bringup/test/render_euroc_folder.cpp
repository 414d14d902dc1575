// SPDX-License-Identifier: BSD-3-Clause
// A folder in EuRoC's layout, rendered: the shipped EuRoC stereo pair and an IMU fly through the simulator's room.
//   render_euroc_folder OUT [SECONDS]
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <thread>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "vip_slam_bringup/stereo/stereo_calibration.h"
#include "vip_slam_sim/motion/imu_synthesiser.h"
#include "vip_slam_sim/motion/motion_generator.h"
#include "vip_slam_sim/render/light_baker.h"
#include "vip_slam_sim/render/renderer.h"
#include "vip_slam_sim/render/sensor_effects.h"

namespace fs = std::filesystem;
using namespace vip_slam;

namespace {

constexpr long long kStart = 1403715273262142976;  // V1_01's first stamp, nanoseconds
constexpr double kImageRate = 20;

std::string stampOf(double t) { return std::to_string(kStart + std::llround(t * 1e9)); }

std::ofstream open(const fs::path& path) {
  fs::create_directories(path.parent_path());
  std::ofstream out(path);
  if (!out) throw std::runtime_error(path.string() + ": cannot be written");
  out << std::setprecision(15);
  return out;
}

void writeSensor(const fs::path& folder, const CameraIntrinsics& camera, const SE3& T_imu_cam) {
  std::ofstream out = open(folder / "sensor.yaml");
  const Eigen::Matrix4d T = T_imu_cam.matrix();
  out << "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [";
  for (int i = 0; i < 16; ++i) out << (i ? ", " : "") << T(i / 4, i % 4);
  out << "]\nrate_hz: " << kImageRate << "\nresolution: [" << camera.width << ", " << camera.height << "]\n"
      << "camera_model: pinhole\nintrinsics: [" << camera.fx << ", " << camera.fy << ", " << camera.cx << ", "
      << camera.cy << "]\ndistortion_model: radial-tangential\ndistortion_coefficients: [";
  for (std::size_t i = 0; i < camera.distortion.size(); ++i) out << (i ? ", " : "") << camera.distortion[i];
  out << "]\n";
}

void writeInertial(const fs::path& root, const SplineTrajectory& body, const ImuLog& log, const ImuOptions& options) {
  std::ofstream imu = open(root / "imu0/data.csv"), truth = open(root / "state_groundtruth_estimate0/data.csv");
  imu << "#timestamp [ns],w_RS_S_x [rad s^-1],...,a_RS_S_z [m s^-2]\n";
  truth << "#timestamp,p_RS_R_x [m],...,q_RS_w [],...\n";
  for (const ImuSample& s : log.samples) {
    imu << stampOf(s.t);
    for (const Eigen::Vector3d& v : {s.gyro, s.accel}) imu << ',' << v.x() << ',' << v.y() << ',' << v.z();
    imu << '\n';
    const SE3 T = body.at(s.t).T_W_I;
    const Eigen::Quaterniond& q = T.rotation();
    truth << stampOf(s.t) << ',' << T.t().x() << ',' << T.t().y() << ',' << T.t().z() << ',' << q.w() << ',' << q.x()
          << ',' << q.y() << ',' << q.z() << '\n';
  }
  open(root / "imu0/sensor.yaml") << "sensor_type: imu\nrate_hz: " << options.rate
                                  << "\ngyroscope_noise_density: " << options.gyro_noise_density
                                  << "\ngyroscope_random_walk: " << options.gyro_random_walk
                                  << "\naccelerometer_noise_density: " << options.accel_noise_density
                                  << "\naccelerometer_random_walk: " << options.accel_random_walk << '\n';
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 2) throw std::runtime_error("usage: render_euroc_folder OUT [SECONDS]");
  const fs::path root = fs::path(argv[1]) / "mav0";
  SequenceSpec spec;
  spec.motion.type = "orbit";
  spec.motion.style = "drone";
  spec.motion.duration = argc > 2 ? std::stod(argv[2]) : 9;
  spec.motion.pitch = -8;
  spec.motion.z = 1.5;
  spec.effects.exposure = 1.3;
  const StereoCalibration pair = loadStereoCalibration(CONFIG_DIR "/stereo/euroc.yaml");
  const SplineTrajectory body = makeMotion(spec.motion, pair.T_imu_left, spec.seed);
  writeInertial(root, body, synthesiseImu(body, spec.imu, spec.seed), spec.imu);

  auto scene = std::make_shared<Scene>(buildScene("room"));
  const auto tracer = std::make_shared<RayTracer>(*scene);
  bakeLight(scene.get(), *tracer, 2, 3);
  const auto shoot = [&](const std::string& name, const CameraIntrinsics& intrinsics, const SE3& T_imu_cam, int seed) {
    const fs::path folder = root / name;
    writeSensor(folder, intrinsics, T_imu_cam);
    fs::create_directories(folder / "data");
    std::ofstream list = open(folder / "data.csv");
    list << "#timestamp [ns],filename\n";
    const auto camera = makeCamera(intrinsics);
    const Renderer renderer(scene, tracer, camera);
    const SensorEffects effects(spec.effects, spec.depth, *camera, seed);
    for (int k = 0; k < (body.end() - 0.2) * kImageRate; ++k) {
      const double t = 0.1 + k / kImageRate;
      FrameBuffers frame;
      renderer.render(body.at(t).T_W_I * T_imu_cam, &frame);
      cv::Mat gray;
      cv::cvtColor(effects.colour(frame, k, t), gray, cv::COLOR_RGB2GRAY);
      const std::string file = stampOf(t) + ".png";
      if (!cv::imwrite((folder / "data" / file).string(), gray, {cv::IMWRITE_PNG_COMPRESSION, 1}))
        throw std::runtime_error((folder / "data" / file).string() + ": cannot be written");
      list << stampOf(t) << ',' << file << '\n';
    }
  };
  std::exception_ptr failed;
  std::thread right([&] {
    try {
      shoot("cam1", pair.right, pair.T_imu_right, 2);
    } catch (...) {
      failed = std::current_exception();
    }
  });
  shoot("cam0", pair.left, pair.T_imu_left, 1);
  right.join();
  if (failed) std::rethrow_exception(failed);
  return 0;
} catch (const std::exception& error) {
  std::cerr << "render_euroc_folder: " << error.what() << '\n';
  return 1;
}
