// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_bringup/stereo/stereo_calibration.h"

#include <stdexcept>

#include <yaml-cpp/yaml.h>

namespace vip_slam {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& key, const std::string& what) {
  throw std::runtime_error(path + ": " + key + ": " + what);
}

template <class T>
T scalar(const YAML::Node& node, const std::string& path, const std::string& key, const char* name) {
  if (!node[name]) fail(path, key + "/" + name, "missing");
  try {
    return node[name].as<T>();
  } catch (const YAML::Exception&) {
    fail(path, key + "/" + name, "cannot be read, expected a number or a name");
  }
}

SE3 matrix(const YAML::Node& node, const std::string& path, const std::string& key) {
  Eigen::Matrix4d T;
  const std::string expected = "expected four rows of four numbers with a rotation in the upper left";
  if (!node || !node.IsSequence() || node.size() != 4) fail(path, key, expected);
  for (int r = 0; r < 4; ++r) {
    if (!node[r].IsSequence() || node[r].size() != 4) fail(path, key, expected);
    for (int c = 0; c < 4; ++c) {
      try {
        T(r, c) = node[r][c].as<double>();
      } catch (const YAML::Exception&) {
        fail(path, key, expected);
      }
    }
  }
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  if ((R.transpose() * R - Eigen::Matrix3d::Identity()).norm() > 1e-4 || R.determinant() < 0) fail(path, key, expected);
  return SE3(T);
}

void readCamera(const YAML::Node& root, const std::string& path, const std::string& key, CameraIntrinsics* camera,
                SE3* T_imu_cam) {
  const YAML::Node node = root[key];
  if (!node || !node.IsMap()) fail(path, key, "missing, expected a map with the camera's calibration");
  camera->width = scalar<int>(node, path, key, "width");
  camera->height = scalar<int>(node, path, key, "height");
  camera->fx = scalar<double>(node, path, key, "fx");
  camera->fy = scalar<double>(node, path, key, "fy");
  camera->cx = scalar<double>(node, path, key, "cx");
  camera->cy = scalar<double>(node, path, key, "cy");
  try {
    camera->model = distortionModelFromName(scalar<std::string>(node, path, key, "model"));
    camera->distortion = node["distortion"].as<std::vector<double>>(std::vector<double>());
  } catch (const std::exception& e) {
    fail(path, key, e.what());
  }
  const std::string wrong = camera->validate();
  if (!wrong.empty()) fail(path, key, wrong);
  *T_imu_cam = matrix(node["T_imu_cam"], path, key + "/T_imu_cam");
}

}  // namespace

StereoCalibration loadStereoCalibration(const std::string& path) {
  YAML::Node root;
  try {
    root = YAML::LoadFile(path);
  } catch (const YAML::Exception& e) {
    throw std::runtime_error(path + ": cannot be read as YAML: " + e.what());
  }
  StereoCalibration calibration;
  readCamera(root, path, "left", &calibration.left, &calibration.T_imu_left);
  readCamera(root, path, "right", &calibration.right, &calibration.T_imu_right);
  return calibration;
}

}  // namespace vip_slam
