// Converters on tiny generated folders: the bag's content, and the errors for unreadable folders.
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "vip_slam_bringup/convert/converters.h"
#include "vip_slam_bringup/convert/text_table.h"
#include "vip_slam_core/util/formatted.h"

namespace fs = std::filesystem;

namespace vip_slam {
namespace {

class Converters : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    root_ = fs::temp_directory_path() / ("vip_slam_convert_" + std::string(info->name()) + std::to_string(::getpid()));
    fs::remove_all(root_);
    fs::create_directories(root_);
    bag_ = (root_ / "out.bag").string();
  }
  void TearDown() override { fs::remove_all(root_); }

  void write(const std::string& name, const std::string& text) {
    fs::create_directories((root_ / name).parent_path());
    std::ofstream(root_ / name) << text;
  }
  void writeImage(const std::string& name, const cv::Mat& image) {
    fs::create_directories((root_ / name).parent_path());
    ASSERT_TRUE(cv::imwrite((root_ / name).string(), image));
  }
  std::string errorOf(const std::function<void()>& call) {
    try {
      call();
    } catch (const std::exception& e) {
      const std::string text = e.what();
      EXPECT_EQ(text.find('\n'), std::string::npos) << text;
      // No partial file stays behind.
      for (const auto& entry : fs::directory_iterator(root_))
        EXPECT_EQ(entry.path().filename().string().find("out"), std::string::npos) << entry.path();
      return text;
    }
    return "";
  }
  template <class Message>
  std::vector<boost::shared_ptr<Message>> read(const std::string& topic) {
    rosbag::Bag bag(bag_);
    std::vector<boost::shared_ptr<Message>> out;
    for (const auto& m : rosbag::View(bag, rosbag::TopicQuery(topic))) {
      auto message = m.instantiate<Message>();
      EXPECT_TRUE(message) << topic;
      if (message) {
        EXPECT_EQ(m.getTime(), message->header.stamp);
        out.push_back(message);
      }
    }
    return out;
  }

  fs::path root_;
  std::string bag_;
};

constexpr long long kStart = 1403715273262142976LL;

class EurocConverter : public Converters {
 protected:
  void makeFolder() {
    const std::string camera_yaml =
        "resolution: [96, 64]\nintrinsics: [80.0, 80.0, 48.0, 32.0]\ndistortion_model: radial-tangential\n"
        "distortion_coefficients: [0.0, 0.0, 0.0, 0.0]\nT_BS:\n  data: [1,0,0,";
    write("set/mav0/cam0/sensor.yaml", camera_yaml + "0.0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n");
    write("set/mav0/cam1/sensor.yaml", camera_yaml + "0.1, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n");
    write("set/mav0/imu0/sensor.yaml",
          "gyroscope_noise_density: 1.6968e-04\ngyroscope_random_walk: 1.9393e-05\n"
          "accelerometer_noise_density: 2.0e-3\naccelerometer_random_walk: 3.0e-3\n");
    std::string images = "#timestamp [ns],filename\n", imu = "#timestamp,wx,wy,wz,ax,ay,az\n";
    cv::RNG rng(3);
    for (int i = 0; i < 3; ++i) {
      const std::string stamp = std::to_string(kStart + i * 50000000LL);
      images += stamp + "," + stamp + ".png\n";
      cv::Mat image(64, 96, CV_8UC1);
      rng.fill(image, cv::RNG::UNIFORM, 0, 255);
      writeImage("set/mav0/cam0/data/" + stamp + ".png", image);
      writeImage("set/mav0/cam1/data/" + stamp + ".png", image);
    }
    for (int i = 0; i < 20; ++i) imu += std::to_string(kStart + i * 5000000LL) + ",0.1,0.2,0.3,9.8,0.5,-0.25\n";
    write("set/mav0/cam0/data.csv", images);
    write("set/mav0/cam1/data.csv", images);
    write("set/mav0/imu0/data.csv", imu);
    write("set/mav0/state_groundtruth_estimate0/data.csv",
          "#timestamp,px,py,pz,qw,qx,qy,qz\n" + std::to_string(kStart) + ",1,2,3,1,0,0,0\n");
    options_.folder = (root_ / "set").string();
    options_.bag = bag_;
    options_.stereo.num_disparities = 16;
  }
  EurocOptions options_;
};

TEST_F(EurocConverter, KeepsStampsPixelsAndInertialData) {
  makeFolder();
  options_.depth = true;
  const ConversionReport report = convertEuroc(options_);
  EXPECT_EQ(report.files.size(), 3u);
  for (const auto& file : report.files) EXPECT_TRUE(fs::exists(file)) << file;

  const auto left = read<sensor_msgs::Image>("/cam0/image_raw");
  ASSERT_EQ(left.size(), 3u);
  EXPECT_EQ(left[1]->header.stamp.toNSec(), std::uint64_t(kStart + 50000000LL));
  EXPECT_EQ(left[1]->encoding, "mono8");
  const cv::Mat png = cv::imread((root_ / "set/mav0/cam0/data" / (std::to_string(kStart) + ".png")).string(), 0);
  EXPECT_EQ(0, memcmp(left[0]->data.data(), png.data, 64 * 96));
  EXPECT_EQ(read<sensor_msgs::Image>("/cam1/image_raw").size(), 3u);

  const auto imu = read<sensor_msgs::Imu>("/imu0");
  ASSERT_EQ(imu.size(), 20u);
  EXPECT_DOUBLE_EQ(imu[3]->angular_velocity.z, 0.3);
  EXPECT_DOUBLE_EQ(imu[3]->linear_acceleration.x, 9.8);

  const SensorConfig sensor = loadSensorConfig((root_ / "out_sensor.yaml").string());
  const auto depth = read<sensor_msgs::Image>(sensor.topics.depth);
  ASSERT_EQ(depth.size(), 3u);
  EXPECT_EQ(depth[0]->encoding, sensor.depth_encoding);
  EXPECT_EQ(read<sensor_msgs::CameraInfo>(sensor.topics.color_info).size(), 3u);
  EXPECT_EQ(read<sensor_msgs::Image>(sensor.topics.color)[0]->encoding, sensor.color_encoding);
  EXPECT_DOUBLE_EQ(sensor.imu_noise.gyro_noise_density, 1.6968e-04);

  const Trajectory truth = readTum((root_ / "out_truth.tum").string());
  ASSERT_EQ(truth.size(), 1u);
  EXPECT_NEAR(truth[0].T_W_B.t().z(), 3, 1e-12);
}

TEST_F(EurocConverter, NamesFileAndLine) {
  makeFolder();
  write("set/mav0/imu0/data.csv", "#t,wx,wy,wz,ax,ay,az\n" + std::to_string(kStart) + ",0,0,abc,0,0,0\n");
  const std::string number = errorOf([&] { convertEuroc(options_); });
  EXPECT_NE(number.find("imu0/data.csv:2: gyro z is 'abc', expected a number"), std::string::npos) << number;

  makeFolder();
  fs::remove(root_ / "set/mav0/cam1/data" / (std::to_string(kStart + 50000000LL) + ".png"));
  const std::string missing = errorOf([&] { convertEuroc(options_); });
  EXPECT_NE(missing.find("cam1/data.csv:3: image"), std::string::npos) << missing;

  makeFolder();
  write("set/mav0/cam0/data/" + std::to_string(kStart + 100000000LL) + ".png", "not a png");
  const std::string broken = errorOf([&] { convertEuroc(options_); });
  EXPECT_NE(broken.find("is not a readable image"), std::string::npos) << broken;

  options_.folder = (root_ / "nothing").string();
  EXPECT_NE(errorOf([&] { convertEuroc(options_); }).find("expected a EuRoC folder"), std::string::npos);
}

TEST_F(EurocConverter, NamesWhatIsWrongInTheCalibration) {
  makeFolder();
  std::ifstream file(root_ / "set/mav0/cam0/sensor.yaml");
  const std::string good((std::istreambuf_iterator<char>(file)), {});
  const auto changed = [&](const std::string& from, const std::string& to, const std::string& what) {
    std::string content = good;
    const auto at = content.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    write("set/mav0/cam0/sensor.yaml", content.replace(at, from.size(), to));
    const std::string error = errorOf([&] { convertEuroc(options_); });
    EXPECT_NE(error.find("cam0/sensor.yaml: " + what), std::string::npos) << error;
  };
  changed("radial-tangential", "omni", "distortion_model: 'omni', expected radial-tangential or equidistant");
  changed("intrinsics", "intrinsic", "intrinsics: missing, expected 4 numbers");
  changed("[80.0, 80.0, 48.0, 32.0]", "[80.0, 80.0]", "intrinsics: 2 numbers, expected 4 numbers");
  changed("[80.0, 80.0, 48.0, 32.0]", "here", "intrinsics: not a list of numbers, expected 4 numbers");
  changed("T_BS", "T_SB", "T_BS/data: missing, expected 16 numbers");
  changed("data: [1,", "data: [2,", "T_BS/data: not a rigid transform: the rotation is off orthonormal by 3");
}

TEST_F(EurocConverter, DoesNotOverwriteUnasked) {
  makeFolder();
  convertEuroc(options_);
  EXPECT_THROW(convertEuroc(options_), std::runtime_error);
  // The bag's companion files may have been edited since.
  fs::remove(bag_);
  const std::string sensor = bag_.substr(0, bag_.size() - 4) + "_sensor.yaml";
  try {
    convertEuroc(options_);
    FAIL() << "the sensor file was overwritten";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()).find(sensor + ": exists already"), 0u) << error.what();
  }
  options_.overwrite = true;
  EXPECT_NO_THROW(convertEuroc(options_));
}

TEST_F(EurocConverter, ABagThatFailsLeavesWhatLiesBesideTheOldOne) {
  makeFolder();
  convertEuroc(options_);
  options_.overwrite = true;
  write("set/mav0/cam0/data/" + std::to_string(kStart + 100000000LL) + ".png", "not a png");
  EXPECT_THROW(convertEuroc(options_), std::runtime_error);
  const std::string stem = bag_.substr(0, bag_.size() - 4);
  for (const std::string& file : {bag_, stem + "_sensor.yaml", stem + "_truth.tum"})
    EXPECT_TRUE(fs::exists(file)) << file;
}

class TumConverter : public Converters {
 protected:
  void makeFolder(const std::string& name) {
    std::string rgb = "# color images\n", depth = "# depth maps\n";
    for (int i = 0; i < 4; ++i) {
      char line[96];
      std::snprintf(line, sizeof(line), "%.6f rgb/%d.png\n", 1305031102.1 + 0.033 * i, i);
      rgb += line;
      std::snprintf(line, sizeof(line), "%.6f depth/%d.png\n", 1305031102.11 + 0.033 * i, i);
      depth += line;
      writeImage(name + "/rgb/" + std::to_string(i) + ".png", cv::Mat(480, 640, CV_8UC3, cv::Scalar(10, 20, 30)));
      writeImage(name + "/depth/" + std::to_string(i) + ".png", cv::Mat(480, 640, CV_16UC1, cv::Scalar(7500)));
    }
    write(name + "/rgb.txt", rgb);
    write(name + "/depth.txt", depth);
    write(name + "/groundtruth.txt",
          "# t x y z qx qy qz qw\n1305031102.1 1 2 3 0 0 0 1\n1305031102.2 1 2 3.5 0 0 0 1\n");
    options_.folder = (root_ / name).string();
    options_.bag = bag_;
  }
  std::string words_, warning_;  ///< of a conversion, the first each
  TumRgbdOptions options_;
};

TEST_F(TumConverter, WithoutAnImuTheBagHasImagesAndTheSensorFileSaysSo) {
  makeFolder("rgbd_dataset_freiburg1_xyz");
  options_.rolling_shutter = 0.024;
  const ConversionReport report = convertTumRgbd(options_);
  EXPECT_TRUE(report.warnings.empty());
  EXPECT_EQ(report.messages.size(), 4u);  // images and their calibrations
  const SensorConfig sensor = loadSensorConfig((root_ / "out_sensor.yaml").string());
  EXPECT_FALSE(sensor.hasGyro());
  EXPECT_FALSE(sensor.hasAccel());
  EXPECT_EQ(sensor.rolling_shutter, 0.024);
  EXPECT_LT(sensor.T_imu_cam.boxminus(SE3()).norm(), 1e-12);  // so that the truth is the colour camera's
  EXPECT_NEAR(sensor.camera.fx, 517.3, 1e-9);
  const auto depth = read<sensor_msgs::Image>(sensor.topics.depth);
  ASSERT_EQ(depth.size(), 4u);
  const auto* value = reinterpret_cast<const std::uint16_t*>(depth[0]->data.data());
  EXPECT_NEAR(value[5] * sensor.depth_scale, 1.5, 1e-9);
  const auto color = read<sensor_msgs::Image>(sensor.topics.color);
  EXPECT_EQ(color[0]->encoding, sensor.color_encoding);
  EXPECT_EQ(color[0]->data[0], 10);
  EXPECT_EQ(readTum((root_ / "out_truth.tum").string()).size(), 2u);
}

TEST_F(TumConverter, TheKinectsAccelerometerComesInTheCamerasAxes) {
  makeFolder("rgbd_dataset_freiburg1_xyz");
  // The camera looks down by half a right angle: up lies along -y and -z of its own axes.
  write("rgbd_dataset_freiburg1_xyz/accelerometer.txt",
        "# t ax ay az\n1305031090 0 0 9.8\n1305031102.1 0.5 7 -7\n1305031102.102 0.5 7 -7\n1305031102.2 0 7 -7\n");
  EXPECT_TRUE(convertTumRgbd(options_).warnings.empty());
  const SensorConfig sensor = loadSensorConfig((root_ / "out_sensor.yaml").string());
  EXPECT_FALSE(sensor.hasGyro());
  EXPECT_TRUE(sensor.hasAccel());
  EXPECT_EQ(sensor.imu_rate, 10);
  EXPECT_LT(sensor.T_imu_cam.boxminus(SE3()).norm(), 1e-12);
  const auto samples = read<sensor_msgs::Imu>(sensor.topics.accel);
  ASSERT_EQ(samples.size(), 2u);  // without the one long before the images, and the one that was read again
  EXPECT_EQ(samples[0]->angular_velocity_covariance[0], -1);  // not measured
  EXPECT_EQ(samples[0]->linear_acceleration.x, -0.5);
  EXPECT_EQ(samples[0]->linear_acceleration.y, -7);
  EXPECT_EQ(samples[0]->linear_acceleration.z, -7);
  EXPECT_EQ(samples[0]->header.frame_id, read<sensor_msgs::Image>(sensor.topics.color)[0]->header.frame_id);
  options_.no_imu = options_.overwrite = true;
  EXPECT_EQ(convertTumRgbd(options_).messages.size(), 4u);
  EXPECT_FALSE(loadSensorConfig((root_ / "out_sensor.yaml").string()).hasAccel());
}

TEST_F(TumConverter, ABagThatReplacesAnotherLeavesNoTruthOfThat) {
  makeFolder("rgbd_dataset_freiburg1_xyz");
  convertTumRgbd(options_);
  const std::string truth = bag_.substr(0, bag_.size() - 4) + "_truth.tum";
  ASSERT_TRUE(fs::exists(truth));
  fs::remove(root_ / "rgbd_dataset_freiburg1_xyz" / "groundtruth.txt");
  options_.overwrite = true;
  convertTumRgbd(options_);
  EXPECT_FALSE(fs::exists(truth));
}

TEST_F(TumConverter, TheExifOrientationTurnsNothing) {
  makeFolder("rgbd_dataset_freiburg1_xyz");
  const cv::Mat picture(480, 640, CV_8UC3, cv::Scalar(10, 20, 30));
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", picture, jpeg);
  // An APP1 segment right after the start of the image: EXIF, big endian, orientation 6 (turned by a quarter).
  const std::vector<std::uint8_t> exif = {0xff, 0xe1, 0, 34, 'E', 'x', 'i', 'f', 0,    0,    'M', 'M',
                                          0,    42,   0, 0,  0,   8,   0,   1,   0x01, 0x12, 0,   3,
                                          0,    0,    0, 1,  0,   6,   0,   0,   0,    0,    0,   0};
  jpeg.insert(jpeg.begin() + 2, exif.begin(), exif.end());
  ASSERT_EQ(cv::imdecode(jpeg, cv::IMREAD_COLOR).rows, picture.cols) << "the tag is not understood";
  for (int i = 0; i < 4; ++i)
    write("rgbd_dataset_freiburg1_xyz/rgb/" + std::to_string(i) + ".png", std::string(jpeg.begin(), jpeg.end()));
  convertTumRgbd(options_);
  const SensorConfig sensor = loadSensorConfig((root_ / "out_sensor.yaml").string());
  EXPECT_EQ(sensor.camera.width, 640);
  const auto color = read<sensor_msgs::Image>(sensor.topics.color);
  ASSERT_EQ(color.size(), 4u);
  EXPECT_EQ(color[0]->width, 640u);
}

TEST_F(TumConverter, TheUnitOfDepthIsGuessedAndNamed) {
  makeFolder("room");
  write("room/calibration.txt", "525 525 320 240\n");
  const auto scaleOf = [&](double near, double far, double factor) {
    cv::Mat depth(480, 640, CV_16UC1);
    for (int v = 0; v < depth.rows; ++v)
      depth.row(v).setTo(std::lround((near + (far - near) * v / depth.rows) * 1000) * (factor / 1000));
    for (int i = 0; i < 4; ++i) writeImage("room/depth/" + std::to_string(i) + ".png", depth);
    return [this] {
      options_.overwrite = true;
      const ConversionReport report = convertTumRgbd(options_);
      words_ = report.notes.empty() ? "" : report.notes[0];
      warning_ = report.warnings.empty() ? "" : report.warnings[0];
      return 1 / loadSensorConfig((root_ / "out_sensor.yaml").string()).depth_scale;
    }();
  };
  EXPECT_NEAR(scaleOf(0.5, 2, 1000), 1000, 1e-6);
  EXPECT_NE(words_.find("depth: 1000 units per metre are guessed"), std::string::npos) << words_;
  EXPECT_NEAR(scaleOf(0.5, 2, 5000), 5000, 1e-6);
  EXPECT_NE(words_.find("depth: 5000 units per metre are guessed: the values are multiples of 5"), std::string::npos);
  EXPECT_EQ(warning_, "");
  EXPECT_NEAR(scaleOf(1, 5, 1000), 1000, 1e-6);
  EXPECT_NE(warning_.find("--depth-factor says otherwise"), std::string::npos) << "not certain";
  options_.depth_factor = 2000;
  EXPECT_NEAR(scaleOf(1, 5, 1000), 2000, 1e-6);
  EXPECT_EQ(words_ + warning_, "") << "as given";
}

TEST_F(TumConverter, StampsInNanosecondsAreReadAndOthersNameTheirLine) {
  makeFolder("room");
  write("room/calibration.txt", "525 525 320 240\n");
  std::string rgb, depth;
  for (int i = 0; i < 4; ++i) {
    rgb += std::to_string(1403636579763555584LL + i * 33000000LL) + " rgb/" + std::to_string(i) + ".png\n";
    depth += std::to_string(1403636579763555584LL + i * 33000000LL) + " depth/" + std::to_string(i) + ".png\n";
  }
  write("room/rgb.txt", rgb + rgb.substr(rgb.rfind("1403636")));  // public recordings repeat lines
  write("room/depth.txt", depth);
  write("room/groundtruth.txt", "1403636579763555584 0 0 0 0 0 0 1\n1403636579863555584 0 0 0 0 0 0 1\n");
  write("room/imu.txt", "1403636579763555584 0 0 0 0 9.8 0\n1403636579768555584 0 0 0 0 9.8 0\n");
  convertTumRgbd(options_);
  const auto color = read<sensor_msgs::Image>("/camera/rgb/image_color");
  ASSERT_EQ(color.size(), 4u);
  EXPECT_NEAR(color[2]->header.stamp.toSec(), 1403636579.829555584, 1e-6);
  EXPECT_NEAR(read<sensor_msgs::Imu>("/camera/imu")[1]->header.stamp.toSec(), 1403636579.768555584, 1e-6);
  EXPECT_NEAR(readTum((root_ / "out_truth.tum").string())[1].t, 1403636579.863555584, 1e-6);
  for (const char* file : {"out.bag", "out_sensor.yaml", "out_truth.tum"}) fs::remove(root_ / file);
  write("room/rgb.txt", "-3 rgb/0.png\n1 rgb/1.png\n");
  EXPECT_NE(errorOf([&] { convertTumRgbd(options_); }).find("rgb.txt:1: the stamp is -3 s, expected 0 to 4294967295"),
            std::string::npos);
}

TEST_F(TumConverter, UnknownCameraAndBadRowsAreNamed) {
  makeFolder("kitchen");
  EXPECT_NE(errorOf([&] { convertTumRgbd(options_); }).find("no calibration"), std::string::npos);
  write("kitchen/calibration.txt", "525 525 320 240\n");
  write("kitchen/imu.txt", "1305031102.1 0 0 0 0 9.8 0\n1305031102.1 0 0 0 0 9.8 0\n");
  const std::string error = errorOf([&] { convertTumRgbd(options_); });
  EXPECT_NE(error.find("imu.txt:2: the stamp 1305031102.099999905 does not follow 1305031102.099999905"),
            std::string::npos)
      << error;
  write("kitchen/imu.txt", "1305031102.1 0 0 0 0 9.8 0\n1305031102.11 0.1 0 0 0 9.8 0\n");
  options_.depth_factor = 5000;
  EXPECT_TRUE(convertTumRgbd(options_).warnings.empty());
  EXPECT_EQ(loadSensorConfig((root_ / "out_sensor.yaml").string()).topics.imu, "/camera/imu");
  EXPECT_EQ(read<sensor_msgs::Imu>("/camera/imu").size(), 2u);
}

class StrayConverter : public Converters {
 protected:
  void makeFolder(int video_frames, double gravity) {
    fs::create_directories(root_ / "rec");
    cv::VideoWriter video((root_ / "rec/rgb.mp4").string(), cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 30,
                          {320, 240});
    ASSERT_TRUE(video.isOpened());
    for (int i = 0; i < video_frames; ++i) video.write(cv::Mat(240, 320, CV_8UC3, cv::Scalar(40 * i, 90, 200)));
    video.release();
    std::string odometry = "timestamp, frame, x, y, z, qx, qy, qz, qw\n",
                imu = "timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z\n";
    for (int i = 0; i < 4; ++i) {
      char line[128], name[32];
      std::snprintf(line, sizeof(line), "%.6f, %06d, 0.0, %f, 0.0, 0.0, 0.0, 0.0, 1.0\n", 100 + i / 30.0, i, 0.1 * i);
      odometry += line;
      std::snprintf(name, sizeof(name), "%06d.png", i);
      cv::Mat depth(24, 32, CV_16UC1, cv::Scalar(1234)), confidence(24, 32, CV_8UC1, cv::Scalar(2));
      confidence.colRange(0, 16).setTo(0);
      writeImage(std::string("rec/depth/") + name, depth);
      writeImage(std::string("rec/confidence/") + name, confidence);
    }
    for (int i = 0; i < 20; ++i) {
      char line[128];
      std::snprintf(line, sizeof(line), "%.6f, 0.0, %f, 0.0, 0.01, 0.02, 0.03\n", 100 + 0.01 * i, -gravity);
      imu += line;
    }
    write("rec/odometry.csv", odometry);
    write("rec/imu.csv", imu);
    write("rec/camera_matrix.csv", "250.0, 0.0, 159.5\n0.0, 250.0, 119.5\n0.0, 0.0, 1.0\n");
    options_.folder = (root_ / "rec").string();
    options_.bag = bag_;
    options_.width = 160;
  }
  StrayOptions options_;
};

TEST_F(StrayConverter, ColourDepthAndSpecificForce) {
  for (const double gravity : {1.0, 9.81}) {
    makeFolder(4, gravity);
    options_.overwrite = true;
    const ConversionReport report = convertStray(options_);
    EXPECT_TRUE(report.warnings.empty());
    const SensorConfig sensor = loadSensorConfig((root_ / "out_sensor.yaml").string());
    const auto imu = read<sensor_msgs::Imu>(sensor.topics.imu);
    ASSERT_EQ(imu.size(), 20u);
    EXPECT_NEAR(imu[0]->linear_acceleration.y, 9.81, 1e-3);  // upright at rest: along +y
    // At rest the specific force points up: against the image's y in a phone turned to landscape. Here the phone is
    // upright, so up is the image's -x.
    const Eigen::Vector3d up_C = sensor.T_imu_cam.R().transpose() * Eigen::Vector3d(0, 1, 0);
    EXPECT_NEAR(up_C.x(), -1, 1e-12);

    const auto color = read<sensor_msgs::CompressedImage>(sensor.topics.color);
    ASSERT_EQ(color.size(), 4u);
    const cv::Mat image = cv::imdecode(color[3]->data, cv::IMREAD_COLOR);
    EXPECT_EQ(image.cols, 160);
    EXPECT_NEAR(image.at<cv::Vec3b>(60, 80)[0], 120, 12);  // must be the fourth frame
    const auto depth = read<sensor_msgs::CompressedImage>(sensor.topics.depth);
    ASSERT_EQ(depth.size(), 4u);
    const cv::Mat z = cv::imdecode(depth[0]->data, cv::IMREAD_UNCHANGED);
    ASSERT_EQ(z.type(), CV_16UC1);
    ASSERT_EQ(z.size(), image.size());
    EXPECT_EQ(z.at<std::uint16_t>(60, 20), 0);  // low confidence
    EXPECT_EQ(z.at<std::uint16_t>(60, 140), 1234);
    const auto info = read<sensor_msgs::CameraInfo>(sensor.topics.color_info);
    EXPECT_NEAR(info[0]->K[0], 125, 1e-9);
    // ARKit's up is y, ours is z.
    const Trajectory truth = readTum((root_ / "out_truth.tum").string());
    EXPECT_NEAR(truth.back().T_W_B.t().z() - truth.front().T_W_B.t().z(), 0.3, 1e-6);
  }
}

/// Tells players to turn the video of an MP4 file by a quarter: the matrix of its track header.
void setRotateFlag(const fs::path& path) {
  std::string bytes;
  {
    std::ifstream in(path, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
  }
  const auto header = bytes.find("tkhd");
  ASSERT_NE(header, std::string::npos);
  ASSERT_EQ(bytes[header + 4], 0) << "another version of the track header";
  const std::int32_t one = 1 << 16, matrix[9] = {0, one, 0, -one, 0, 0, 240 * one, 0, 1 << 30};
  for (int i = 0; i < 9; ++i)
    for (int b = 0; b < 4; ++b)
      bytes[header + 44 + 4 * i + b] = static_cast<char>(static_cast<std::uint32_t>(matrix[i]) >> (24 - 8 * b));
  std::ofstream(path, std::ios::binary) << bytes;
}

TEST_F(StrayConverter, AVideoWithARotateFlagIsTakenAsItIsStored) {
  makeFolder(4, 1.0);
  setRotateFlag(root_ / "rec/rgb.mp4");
  cv::Mat turned;
  ASSERT_TRUE(cv::VideoCapture((root_ / "rec/rgb.mp4").string()).read(turned));
  if (turned.size() != cv::Size(240, 320)) GTEST_SKIP() << "this OpenCV does not know the flag";
  const ConversionReport report = convertStray(options_);
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_NE(report.warnings[0].find("tells players to turn it by"), std::string::npos) << report.warnings[0];
  const auto color = read<sensor_msgs::CompressedImage>("/phone/color/image_raw/compressed");
  ASSERT_EQ(color.size(), 4u);
  EXPECT_EQ(cv::imdecode(color[3]->data, cv::IMREAD_COLOR).size(), cv::Size(160, 120));
}

TEST_F(StrayConverter, AVideoOfAnotherShapeOrSizeIsNamed) {
  makeFolder(4, 1.0);
  write("rec/camera_matrix.csv", "500.0, 0.0, 319.5\n0.0, 500.0, 239.5\n0.0, 0.0, 1.0\n");
  const std::string resized = errorOf([&] { convertStray(options_); });
  EXPECT_NE(resized.find("pictures of 320x240, but the intrinsics (principal point 320, 240) are for pictures of about "
                         "640x480: resized by hand?"),
            std::string::npos)
      << resized;
  makeFolder(4, 1.0);
  for (int i = 0; i < 4; ++i) writeImage(formatted("rec/depth/%06d.png", i), cv::Mat(32, 24, CV_16UC1, cv::Scalar(9)));
  const std::string turned = errorOf([&] { convertStray(options_); });
  EXPECT_NE(turned.find("pictures of 320x240 have another shape than the depth images of 24x32"), std::string::npos)
      << turned;
}

TEST_F(StrayConverter, ImuRowsOutOfOrderAreSortedAndCounted) {
  makeFolder(4, 1.0);
  std::string imu = "timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z\n";
  for (const double t : {100.00, 100.02, 100.01, 100.03, 100.03, 100.04})
    imu += formatted("%.6f, 0.0, -1.0, 0.0, %f, 0.02, 0.03\n", t, t - 100);
  write("rec/imu.csv", imu);
  const ConversionReport report = convertStray(options_);
  ASSERT_EQ(report.warnings.size(), 2u);
  EXPECT_NE(report.warnings[0].find("imu.csv: 1 of 6 rows come late and are sorted"), std::string::npos);
  EXPECT_NE(report.warnings[1].find("imu.csv: 1 of 6 rows repeat a stamp and are left out"), std::string::npos);
  const auto samples = read<sensor_msgs::Imu>("/phone/imu");
  ASSERT_EQ(samples.size(), 5u);
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(samples[i]->angular_velocity.x, 0.01 * i, 1e-6);
}

TEST_F(StrayConverter, FocalLengthsDifferFromRowToRow) {
  makeFolder(4, 1.0);
  // A bright square at about the same bearing in all pictures, while the focal length grows.
  cv::VideoWriter video((root_ / "rec/rgb.mp4").string(), cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 30, {320, 240});
  std::string odometry = "timestamp, frame, x, y, z, qx, qy, qz, qw, fx, fy, cx, cy\n";
  std::vector<Eigen::Vector2d> bearings;
  for (int i = 0; i < 4; ++i) {
    const double f = 250 + 5 * i;
    cv::Mat picture(240, 320, CV_8UC3, cv::Scalar(20, 20, 20));
    const int u = static_cast<int>(std::lround(159.5 + 0.4 * f)), v = static_cast<int>(std::lround(119.5 - 0.2 * f));
    picture(cv::Rect(u - 8, v - 8, 17, 17)).setTo(cv::Scalar(230, 230, 230));
    video.write(picture);
    bearings.emplace_back((u - 159.5) / f, (v - 119.5) / f);
    odometry += formatted("%.6f, %06d, 0, 0, 0, 0, 0, 0, 1, %f, %f, 159.5, 119.5\n", 100 + i / 30.0, i, f, f);
  }
  video.release();
  write("rec/odometry.csv", odometry);
  options_.width = 320;
  convertStray(options_);
  const auto infos = read<sensor_msgs::CameraInfo>("/phone/color/camera_info");
  const auto pictures = read<sensor_msgs::CompressedImage>("/phone/color/image_raw/compressed");
  ASSERT_EQ(infos.size(), 4u);
  ASSERT_EQ(pictures.size(), 4u);
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(infos[i]->K[0], 265, 1e-6);  // the longest
    const cv::Moments m = cv::moments(cv::imdecode(pictures[i]->data, cv::IMREAD_GRAYSCALE) > 128, true);
    EXPECT_NEAR(m.m10 / m.m00, 159.5 + 265 * bearings[i].x(), 0.6) << i;
    EXPECT_NEAR(m.m01 / m.m00, 119.5 + 265 * bearings[i].y(), 0.6) << i;
  }
}

TEST_F(StrayConverter, OneHiddenFrameIsForgivenAShortVideoIsNot) {
  makeFolder(3, 1.0);
  const ConversionReport report = convertStray(options_);
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_EQ(read<sensor_msgs::CompressedImage>("/phone/color/image_raw/compressed").size(), 3u);
  fs::remove(bag_);
  fs::remove(root_ / "out_sensor.yaml");
  fs::remove(root_ / "out_truth.tum");
  makeFolder(1, 1.0);
  EXPECT_NE(errorOf([&] { convertStray(options_); }).find("1 frames for 4 rows"), std::string::npos);
  makeFolder(4, 5.0);
  EXPECT_NE(errorOf([&] { convertStray(options_); }).find("median acceleration"), std::string::npos);
}

}  // namespace
}  // namespace vip_slam
