// SPDX-License-Identifier: BSD-3-Clause
// TUM trajectories, plane maps and sensor files: round trips, and errors that name file, line or key.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <regex>
#include <sstream>

#include <opencv2/imgcodecs.hpp>

#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_core/testing/analytic_motion.h"
#include "vip_slam_core/trajectory/tum_io.h"
#include "vip_slam_core/types/planes_yaml.h"

namespace vip_slam {
namespace {

namespace fs = std::filesystem;

class FileFormats : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              (std::string("formats_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string text(const std::string& name) const {
    std::ostringstream out;
    out << std::ifstream(path(name)).rdbuf();
    return out.str();
  }
  void write(const std::string& name, const std::string& content) const { std::ofstream(path(name)) << content; }
  // The message must name the file and contain `what`, in one line.
  void expectRefused(const std::function<void()>& action, const std::string& file, const std::string& what) {
    try {
      action();
      ADD_FAILURE() << "accepted, expected: " << what;
    } catch (const std::runtime_error& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find(file), std::string::npos) << message;
      EXPECT_NE(message.find(what), std::string::npos) << message;
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
  }
  fs::path folder_;
};

TEST_F(FileFormats, TumRoundTrip) {
  const testing::AnalyticMotion motion(1);
  Trajectory trajectory;
  for (int k = 0; k < 100; ++k) trajectory.push_back({1403715273.25 + 0.05 * k, motion.stateAt(0.05 * k).T_W_I});
  writeTum(path("t.tum"), trajectory);
  const Trajectory back = readTum(path("t.tum"));
  ASSERT_EQ(back.size(), trajectory.size());
  for (std::size_t k = 0; k < back.size(); ++k) {
    EXPECT_NEAR(back[k].t, trajectory[k].t, 5e-7);
    EXPECT_LT(back[k].T_W_B.boxminus(trajectory[k].T_W_B).norm(), 1e-8);
  }
  write("spaces.tum", "# head\n\n  1 1 2 3\t0 0 0 1 \r\n# middle\n2.5 1 2 3 0 0 0 -1\n");
  EXPECT_EQ(readTum(path("spaces.tum")).size(), 2u);
}

TEST_F(FileFormats, TumStampsInOtherUnitsAreSeconds) {
  const auto second = [&](const std::string& a, const std::string& b) {
    write("units.tum", a + " 1 2 3 0 0 0 1\n" + b + " 1 2 3 0 0 0 1\n");
    const Trajectory read = readTum(path("units.tum"));
    EXPECT_EQ(read.size(), 2u);
    return read.back().t;
  };
  EXPECT_NEAR(second("1403636579763555584", "1403636579863555584"), 1403636579.863555584, 1e-6);
  EXPECT_NEAR(second("1403636579763555", "1403636579863555"), 1403636579.863555, 1e-6);
  EXPECT_NEAR(second("1403636579763", "1403636579863"), 1403636579.863, 1e-6);
  EXPECT_EQ(second("1403636579.5", "1403636580.25"), 1403636580.25);
  EXPECT_NEAR(second("0", "33000000"), 0.033, 1e-12);  // from the start of the recording
  EXPECT_EQ(second("0", "600"), 600);
}

TEST_F(FileFormats, TumErrorsNameTheLine) {
  const auto refused = [&](const std::string& content, const std::string& what) {
    write("bad.tum", content);
    expectRefused([&] { readTum(path("bad.tum")); }, "bad.tum", what);
  };
  expectRefused([&] { readTum(path("missing.tum")); }, "missing.tum", "cannot be opened");
  refused("# c\n1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0\n", ":3: 7 values, expected 8");
  refused("1 0 0 0 0 0 0 1 5\n", ":1: 9 values");
  refused("1 0 zero 0 0 0 0 1\n", ":1: 'zero' is not a number");
  refused("1 0 nan 0 0 0 0 1\n", "expected a finite number");
  refused("1 0 0 0 0 0 0 0\n", "unit quaternion");
  refused("1 0 0 0 0 0 0 1\n0.9 0 0 0 0 0 0 1\n", ":2: timestamp 0.9 does not follow 1");
  write("twice.tum", "1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n2 5 0 0 0 0 0 1\n3 2 0 0 0 0 0 1\n");
  const Trajectory twice = readTum(path("twice.tum"));
  ASSERT_EQ(twice.size(), 3u);
  EXPECT_EQ(twice[1].T_W_B.t().x(), 1);
  refused("2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n", "ascending");
}

TEST_F(FileFormats, TumOfAClockThatWasSetBackIsReadWithoutTheTimeThatRepeats) {
  write("back.tum", "1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n1.5 2 0 0 0 0 0 1\n2 3 0 0 0 0 0 1\n2.5 4 0 0 0 0 0 1\n");
  std::string ran_back;
  const Trajectory read = readTum(path("back.tum"), &ran_back);
  ASSERT_EQ(read.size(), 3u);
  EXPECT_EQ(read[2].T_W_B.t().x(), 4);
  EXPECT_NE(ran_back.find(":3: timestamp 1.5 does not follow 2"), std::string::npos) << ran_back;
  EXPECT_NE(ran_back.find(" 1 poses are left out"), std::string::npos) << ran_back;
  write("mixed.tum", "5 0 0 0 0 0 0 1\n4 1 0 0 0 0 0 1\n3 2 0 0 0 0 0 1\n2 3 0 0 0 0 0 1\n");
  expectRefused([&] { readTum(path("mixed.tum"), &ran_back); }, "mixed.tum", "most of them");
}

TEST_F(FileFormats, PoseAtInterpolatesButNotAcrossGaps) {
  const SE3 a(Eigen::Quaterniond::Identity(), {0, 0, 0}), b(expQuaternion({0, 0, 1}), {1, 0, 0});
  const Trajectory trajectory = {{1.0, a}, {1.1, b}, {3.0, a}};
  SE3 T;
  ASSERT_TRUE(poseAt(trajectory, 1.05, &T, 0.11));
  EXPECT_NEAR(T.t().x(), 0.5, 1e-9);
  EXPECT_NEAR(yawOf(T.rotation()), 0.5, 1e-9);
  EXPECT_TRUE(poseAt(trajectory, 1.0, &T));
  EXPECT_TRUE(poseAt(trajectory, 3.0, &T));
  EXPECT_FALSE(poseAt(trajectory, 2.0, &T));
  EXPECT_FALSE(poseAt(trajectory, 0.9, &T));
  EXPECT_FALSE(poseAt(trajectory, 3.1, &T));
  EXPECT_FALSE(poseAt({}, 1, &T));
}

PlaneEstimate floorPlane() {
  PlaneEstimate plane;
  plane.id = 12;
  plane.kind = PlaneKind::kHorizontal;
  plane.plane = Plane(Eigen::Vector3d(0.01, 0, 1), 0.1);
  plane.area = 3.25;
  plane.keyframes = 9;
  PlanePolygon polygon;
  polygon.outer = {{0, 0, -0.1}, {2, 0, -0.12}, {2, 2, -0.12}, {0, 2, -0.1}};
  polygon.holes.push_back({{0.5, 0.5, -0.1}, {1, 0.5, -0.11}, {1, 1, -0.11}});
  plane.polygons = {polygon, {{{5, 5, 0}, {6, 5, 0}, {6, 6, 0}}, {}}};
  return plane;
}

TEST_F(FileFormats, PlanesRoundTrip) {
  const PlaneEstimate floor = floorPlane();  // GCC 9 cannot make the base out of a temporary
  TruePlane truth{floor};
  truth.id = 13;
  truth.kind = PlaneKind::kGeneral;
  truth.seen_seconds = 4.5;
  truth.seen_area = 2.5;
  writeTruePlanesYaml(path("p.yaml"), {{floor}, truth});
  const auto back = readTruePlanesYaml(path("p.yaml"));
  ASSERT_EQ(back.size(), 2u);
  EXPECT_EQ(back[0].id, 12u);
  EXPECT_EQ(back[0].kind, PlaneKind::kHorizontal);
  EXPECT_LT((back[0].plane.coefficients() - floorPlane().plane.coefficients()).norm(), 1e-12);
  EXPECT_EQ(back[0].keyframes, 9u);
  EXPECT_EQ(back[0].area, 3.25);
  ASSERT_EQ(back[0].polygons.size(), 2u);
  ASSERT_EQ(back[0].polygons[0].holes.size(), 1u);
  EXPECT_EQ(back[0].polygons[0].outer, floorPlane().polygons[0].outer);
  EXPECT_EQ(back[0].polygons[0].holes[0], floorPlane().polygons[0].holes[0]);
  EXPECT_LT(back[0].seen_seconds, 0);
  EXPECT_EQ(back[1].seen_seconds, 4.5);
  EXPECT_EQ(back[1].seen_area, 2.5);
  EXPECT_EQ(back[1].kind, PlaneKind::kGeneral);
  EXPECT_EQ(readPlanesYaml(path("p.yaml"))[1].id, 13u);
  writePlanesYaml(path("none.yaml"), {});
  EXPECT_TRUE(readPlanesYaml(path("none.yaml")).empty());
}

TEST_F(FileFormats, PlaneErrorsNamePlaneAndKey) {
  writePlanesYaml(path("good.yaml"), {floorPlane()});
  const std::string good = text("good.yaml");
  const auto changed = [&](const std::string& from, const std::string& to, const std::string& what) {
    std::string content = good;
    const auto at = content.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    write("bad.yaml", content.replace(at, from.size(), to));
    expectRefused([&] { readPlanesYaml(path("bad.yaml")); }, "bad.yaml", what);
  };
  changed("kind: horizontal", "kind: flat", "kind");
  changed("distance:", "distanz:", "distanz");
  changed("    area: 3.25\n", "", "area");
  changed("area: 3.25", "area: large", "area");
  changed("[2, 0, -0.12]", "[2, 0]", "outer");
  changed("[2, 0, -0.12]", "[2, 0, .nan]", "outer");
  changed("normal: [", "normal: [0, ", "normal");
  changed("planes:", "flats:", "planes");
  changed("planes:", "planes: [", "line");
  write("summary.yaml", "bag: x.bag\nplanes: 12\n");
  expectRefused([&] { readPlanesYaml(path("summary.yaml")); }, "summary.yaml", "planes: expected a list");
  expectRefused([&] { readPlanesYaml(path("missing.yaml")); }, "missing.yaml", "cannot be read");
}

SensorConfig sensor() {
  SensorConfig c;
  c.name = "test rig";
  c.topics.color = "/c";
  c.topics.color_info = "/ci";
  c.topics.depth = "/d";
  c.topics.depth_info = "/di";
  c.topics.gyro = "/g";
  c.topics.accel = "/a";
  c.color_encoding = "bgr8";
  c.depth_encoding = "32FC1";
  c.depth_scale = 0.0002;
  c.depth_offset = -0.012;
  c.depth_delay = 0.021;
  c.depth_shift << 1.75, -0.5;
  c.depth_curve.added = {0.0f, 0.0031f, -0.002f};
  c.depth_registered = false;
  c.color_rate = 25, c.depth_rate = 15, c.imu_rate = 250;
  c.intrinsics_from_camera_info = false;
  c.camera.width = 640, c.camera.height = 480;
  c.camera.fx = 610.25, c.camera.fy = 611.5, c.camera.cx = 320.1, c.camera.cy = 239.9;
  c.camera.model = DistortionModel::kRadTan;
  c.camera.distortion = {0.1, -0.2, 0.001, -0.002, 0.05};
  c.depth_camera = c.camera;
  c.depth_camera.model = DistortionModel::kNone;
  c.depth_camera.distortion.clear();
  c.T_color_depth = SE3(expQuaternion({0.01, 0.02, -0.01}), {0.015, 0, 0.001});
  c.T_imu_cam = SE3(expQuaternion({-1.2, 1.2, -1.2}), {0.03, 0.02, -0.01});
  c.T_base_imu = SE3(expQuaternion({0, 0, 0.5}), {0.1, 0.2, 0.3});
  c.imu_noise = {1.7e-4, 2e-5, 2e-3, 3e-3, 4e-3};
  c.gyro_correction << 0.01, 0.002, 0, -0.003, -0.02, 0.001, 0, 0.004, 0.015;
  c.depth_noise = DepthNoise::preset(DepthSensorType::kStereo);
  c.depth_noise.c = 0.0031;
  c.time_offset = -0.0123;
  c.gravity = 9.807;
  return c;
}

TEST_F(FileFormats, SensorRoundTrip) {
  saveSensorConfig(path("s.yaml"), sensor());
  const SensorConfig a = sensor(), b = loadSensorConfig(path("s.yaml"));
  EXPECT_EQ(b.name, a.name);
  EXPECT_EQ(b.topics.color, "/c");
  EXPECT_EQ(b.topics.depth_info, "/di");
  EXPECT_EQ(b.topics.imu, "");
  EXPECT_EQ(b.topics.accel, "/a");
  EXPECT_EQ(b.color_encoding, a.color_encoding);
  EXPECT_EQ(b.depth_encoding, a.depth_encoding);
  EXPECT_EQ(b.depth_scale, a.depth_scale);
  EXPECT_EQ(b.depth_offset, a.depth_offset);
  EXPECT_EQ(b.depth_delay, a.depth_delay);
  EXPECT_EQ(b.depth_shift, a.depth_shift);
  EXPECT_EQ(b.depth_curve, a.depth_curve);
  EXPECT_FALSE(b.depth_registered);
  EXPECT_EQ(b.color_rate, 25);
  EXPECT_EQ(b.depth_rate, 15);
  EXPECT_EQ(b.imu_rate, 250);
  EXPECT_FALSE(b.intrinsics_from_camera_info);
  EXPECT_EQ(b.camera.fx, a.camera.fx);
  EXPECT_EQ(b.camera.distortion, a.camera.distortion);
  EXPECT_EQ(b.camera.model, a.camera.model);
  EXPECT_EQ(b.depth_camera.model, DistortionModel::kNone);
  EXPECT_LT(b.T_color_depth.boxminus(a.T_color_depth).norm(), 1e-12);
  EXPECT_LT(b.T_imu_cam.boxminus(a.T_imu_cam).norm(), 1e-12);
  EXPECT_LT(b.T_base_imu.boxminus(a.T_base_imu).norm(), 1e-12);
  EXPECT_EQ(b.imu_noise.gyro_random_walk, a.imu_noise.gyro_random_walk);
  EXPECT_EQ(b.imu_noise.accel_noise_density, a.imu_noise.accel_noise_density);
  EXPECT_EQ(b.imu_noise.gyro_correction_sigma, a.imu_noise.gyro_correction_sigma);
  EXPECT_EQ(b.gyro_correction, a.gyro_correction);
  EXPECT_EQ(b.depth_noise.type, DepthSensorType::kStereo);
  EXPECT_EQ(b.depth_noise.c, 0.0031);
  EXPECT_EQ(b.depth_noise.bias_floor, a.depth_noise.bias_floor);
  EXPECT_EQ(b.time_offset, a.time_offset);
  EXPECT_EQ(b.gravity, a.gravity);

  SensorConfig plain = sensor();
  plain.depth_registered = true;
  plain.depth_undistorted = true;
  plain.intrinsics_from_camera_info = true;
  plain.camera = CameraIntrinsics();
  plain.topics.imu = "/imu";
  plain.topics.gyro = plain.topics.accel = "";
  saveSensorConfig(path("s2.yaml"), plain);
  const SensorConfig back = loadSensorConfig(path("s2.yaml"));
  EXPECT_TRUE(back.depth_registered);
  EXPECT_TRUE(back.depth_undistorted);
  EXPECT_TRUE(back.intrinsics_from_camera_info);
  EXPECT_EQ(back.topics.imu, "/imu");
}

TEST_F(FileFormats, SensorWithPartOfAnImu) {
  SensorConfig part = sensor();
  const auto saved = [&](const std::string& imu, const std::string& gyro, const std::string& accel) {
    part.topics.imu = imu;
    part.topics.gyro = gyro;
    part.topics.accel = accel;
    saveSensorConfig(path("s.yaml"), part);
    return loadSensorConfig(path("s.yaml"));
  };
  const auto expectStreams = [](const SensorConfig& config, bool gyro, bool accel, const std::string& frame_of) {
    EXPECT_EQ(config.hasGyro(), gyro);
    EXPECT_EQ(config.hasAccel(), accel);
    EXPECT_EQ(config.topics.inertial(), frame_of);
  };
  expectStreams(saved("/i", "", ""), true, true, "/i");
  expectStreams(saved("", "/g", "/a"), true, true, "/g");
  EXPECT_NE(text("s.yaml").find("gyro_noise_density"), std::string::npos);

  expectStreams(saved("", "", "/a"), false, true, "/a");
  EXPECT_EQ(text("s.yaml").find("gyro_"), std::string::npos);
  EXPECT_EQ(loadSensorConfig(path("s.yaml")).imu_noise.accel_noise_density, part.imu_noise.accel_noise_density);
  expectStreams(saved("", "/g", ""), true, false, "/g");
  EXPECT_EQ(text("s.yaml").find("accel_"), std::string::npos);
  EXPECT_EQ(loadSensorConfig(path("s.yaml")).gyro_correction, part.gyro_correction);

  expectStreams(saved("", "", ""), false, false, "");
  const std::string bare = text("s.yaml");
  EXPECT_EQ(bare.find("\nimu:\n"), std::string::npos) << "a section for an IMU that does not exist";
  const auto T_imu_cam = bare.find("T_imu_cam"), next = bare.find("T_base_imu");
  write("s.yaml", bare.substr(0, T_imu_cam) + bare.substr(next));
  EXPECT_LT(loadSensorConfig(path("s.yaml")).T_imu_cam.boxminus(SE3()).norm(), 1e-12);
  // Said with imu: "", not by silence.
  write("s.yaml", std::regex_replace(bare, std::regex("  (imu|gyro|accel): \"\"\n"), ""));
  expectRefused([&] { loadSensorConfig(path("s.yaml")); }, "s.yaml", "topics/imu: missing");
}

TEST_F(FileFormats, SensorMask) {
  saveSensorConfig(path("plain.yaml"), sensor());
  EXPECT_TRUE(loadSensorConfig(path("plain.yaml")).mask.empty());
  EXPECT_EQ(text("plain.yaml").find("mask"), std::string::npos);
  const auto with = [&](const std::string& mask) { write("s.yaml", text("plain.yaml") + "mask: " + mask + "\n"); };

  cv::Mat picture(480, 640, CV_8UC3, cv::Scalar::all(250));
  picture.rowRange(400, 480) = cv::Scalar::all(9);
  fs::create_directories(folder_ / "rig");
  cv::imwrite(path("rig/bumper.png"), picture);
  with("rig/bumper.png");  // relative to the file, whatever the working directory
  const SensorConfig config = loadSensorConfig(path("s.yaml"));
  ASSERT_EQ(config.mask.type(), CV_8UC1);
  EXPECT_EQ(cv::countNonZero(config.mask == 255), 640 * 400);
  EXPECT_EQ(cv::countNonZero(config.mask), 640 * 400);
  EXPECT_EQ(config.mask.at<std::uint8_t>(399, 0), 255);
  EXPECT_EQ(config.mask.at<std::uint8_t>(400, 639), 0);
  EXPECT_EQ(maskProblem(config, 640, 480), "");
  EXPECT_NE(maskProblem(config, 1280, 720).find("bumper.png is 640x480, the colour image is 1280x720"),
            std::string::npos);
  saveSensorConfig(path("rig/copy.yaml"), config);  // found from another folder too
  EXPECT_EQ(cv::countNonZero(loadSensorConfig(path("rig/copy.yaml")).mask), 640 * 400);

  const auto refused = [&](const std::string& mask, const std::string& what) {
    with(mask);
    expectRefused([&] { loadSensorConfig(path("s.yaml")); }, "s.yaml: mask: ", what);
  };
  refused("none.png", "none.png cannot be read");
  refused("plain.yaml", "is no picture");
  cv::imwrite(path("black.png"), cv::Mat(480, 640, CV_8U, cv::Scalar(0)));
  refused("black.png", "black all over");
  cv::imwrite(path("small.png"), cv::Mat(240, 320, CV_8U, cv::Scalar(255)));
  refused("small.png", "is 320x240, the colour image is 640x480");
}

TEST_F(FileFormats, SensorErrorsNameFileAndKey) {
  saveSensorConfig(path("good.yaml"), sensor());
  const std::string good = text("good.yaml");
  const auto changed = [&](const std::string& from, const std::string& to, const std::string& what) {
    std::string content = good;
    const auto at = content.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    write("bad.yaml", content.replace(at, from.size(), to));
    expectRefused([&] { loadSensorConfig(path("bad.yaml")); }, "bad.yaml", what);
  };
  expectRefused([&] { loadSensorConfig(path("missing.yaml")); }, "missing.yaml", "cannot be read");
  changed("name:", "nom:", "name: missing");
  changed("time_offset:", "time_ofset:", "time_ofset: unknown key");
  changed("time_offset: -0.0123", "time_offset: -0.0123\ntime_offset: 0.03", "time_offset: stands there twice");
  changed("gyro_noise_density: 0.00017", "gyro_nois_density: 0.00017",
          "'imu/gyro_nois_density' is no key, is it meant?");
  changed("  rate: 250", "  rate: fast", "imu/rate");
  changed("gyro_noise_density: 0.00017", "gyro_noise_density: -1", "imu");
  changed("accel_random_walk: 0.003", "accel_random_walk: .nan", "imu");
  changed("fx: 610.25", "fx: 0", "fx");
  changed("fx: 610.25", "fx: .nan", "fx");
  changed("model: radtan", "model: barrel", "barrel");
  changed("distortion: [0.1, -0.2, 0.001, -0.002, 0.05]", "distortion: [0.1, -0.2]", "distortion");
  changed("model: stereo", "model: sonar", "sonar");
  changed("min_range: 0.3", "min_range: 30", "depth_noise");
  changed("gravity: 9.807", "gravity: 1.6", "gravity");
  changed("[0.01, 0.002, 0]", "[0.01, 0.002]", "imu/gyro_correction: row 1: 2 entries, expected 3 numbers");
  changed("[0.01, 0.002, 0]", "[0.01, 0.9, 0]", "imu/gyro_correction: has 0.9, expected numbers from -0.2 to 0.2");
  changed("[0.01, 0.002, 0]", "[0.01, .nan, 0]", "imu/gyro_correction: has nan, expected numbers from -0.2 to 0.2");
  changed("gyro_correction_sigma: 0.004", "gyro_correction_sigma: 0", "imu/gyro_correction_sigma");
  changed("gyro_correction_sigma: 0.004", "gyro_correction_sigma: 0.3", "imu/gyro_correction_sigma");
  changed("scale: 0.0002", "scale: 0", "depth/scale");
  changed("shift: [1.75, -0.5]", "shift: [1.75]", "depth/shift: 1 numbers, expected two: right and down");
  changed("shift: [1.75, -0.5]", "shift: [1.75, 90]", "depth/shift: [1.75, 90], expected at most 50 pixels");
  changed("shift: [1.75, -0.5]", "shift: [.nan, 0]", "depth/shift");
  changed("curve: [0, 0.0031", "curve: [0, 1.31", "depth/curve: 1.31 m are added at 0.125 m, expected at most 1");
  changed("curve: [0, 0.0031", "curve: [0, here", "depth/curve: is 'a list', expected a list of numbers");
  changed("[0, 0, 0, 1]", "[0, 0, 0, 2]", "T_color_depth: not a rigid transform: the last row is 0 0 0 2");
  changed("T_imu_cam:\n  - [", "T_imu_cam:\n  - [9, ", "T_imu_cam: row 1: 5 entries, expected 4 numbers");
  changed("T_imu_cam:\n  - [", "T_imu_cam:\n  - [x", "T_imu_cam: row 1: 'x");
  changed("imu: \"\"", "imu: \"/i\"", "topics/gyro");  // both would be read, and mixed
  changed("encoding: bgr8", "encoding: rgb9", "color/encoding");
  changed("encoding: 32FC1", "encoding: 8UC1", "depth/encoding");
  changed("time_offset: -0.0123", "time_offset: .inf", "time_offset");
  changed("  rate: 25\n", "  rate: 0\n", "color/rate");
  SensorConfig uncalibrated = sensor();
  uncalibrated.intrinsics_from_camera_info = true;
  const auto without = [&](std::string* topic) {
    topic->clear();
    saveSensorConfig(path("bad.yaml"), uncalibrated);
    return [&] { loadSensorConfig(path("bad.yaml")); };
  };
  expectRefused(without(&uncalibrated.topics.depth_info), "bad.yaml", "topics/depth_info: missing");
  expectRefused(without(&uncalibrated.topics.color_info), "bad.yaml", "topics/color_info: missing");
}

}  // namespace
}  // namespace vip_slam
