// SPDX-License-Identifier: BSD-3-Clause
#include "driver_facts.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <stdexcept>

#include <yaml-cpp/yaml.h>

#include "vip_slam_core/geometry/angle.h"

namespace fs = std::filesystem;

namespace vip_slam::test_support {
namespace {

using Strings = std::map<std::string, std::string>;

/// "-z" -> (0, 0, -1).
Eigen::Vector3d axisOf(const std::string& text) {
  if (text.size() != 2 || (text[0] != '+' && text[0] != '-') || text[1] < 'x' || text[1] > 'z')
    throw std::runtime_error("axis '" + text + "', expected a sign and one of x, y, z");
  return (text[0] == '-' ? -1 : 1) * Eigen::Vector3d::Unit(text[1] - 'x');
}

/// `rpy`: degrees, as in a URDF; `axes`: where x, y, z of the child point, in the parent.
Eigen::Matrix3d rotationOf(const YAML::Node& edge) {
  if (edge["axes"]) {
    Eigen::Matrix3d R;
    for (int k = 0; k < 3; ++k) R.col(k) = axisOf(edge["axes"][k].as<std::string>());
    if (std::abs(R.determinant() - 1) > 1e-9) throw std::runtime_error("axes: not right-handed");
    return R;
  }
  const auto rpy = edge["rpy"].as<std::vector<double>>();
  return (Eigen::AngleAxisd(rpy.at(2) * kDegree, Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rpy.at(1) * kDegree, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.at(0) * kDegree, Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

/// T_a_b through the edges, whichever way they lie.
SE3 chain(const std::vector<TfEdge>& edges, const std::string& a, const std::string& b) {
  const auto toRoot = [&](std::string frame) {
    std::pair<std::string, SE3> out{frame, SE3()};  // root, T_root_frame
    for (bool climbed = true; climbed;) {
      climbed = false;
      for (const TfEdge& e : edges)
        if (e.child == out.first && !climbed) {
          out = {e.parent, e.T_parent_child * out.second};
          climbed = true;
        }
    }
    return out;
  };
  const auto [root_a, T_root_a] = toRoot(a);
  const auto [root_b, T_root_b] = toRoot(b);
  if (root_a != root_b) throw std::runtime_error("tf: " + a + " and " + b + " are not connected");
  return T_root_a.inverse() * T_root_b;
}

std::string source(const YAML::Node& row, const char* what) {
  if (!row["source"]) throw std::runtime_error(std::string(what) + ": no source");
  return row["source"].as<std::string>();
}

DriverLaunch launchFrom(const YAML::Node& node) {
  DriverLaunch out;
  out.package = node["package"].as<std::string>();
  out.file = node["file"].as<std::string>();
  for (const auto& branch : node["branches"]) {
    source(branch.second, "launch");
    out.branches[branch.first.as<std::string>()] = branch.second["arguments"].as<Strings>();
  }
  return out;
}

void readStreams(const YAML::Node& node, DriverCamera* camera) {
  SensorConfig& s = camera->published;
  const auto stream = [&](const char* role, std::string* topic, std::string* frame) {
    const YAML::Node row = node[role];
    if (!row) return row;
    source(row, role);
    *topic = row["topic"].as<std::string>();
    *frame = row["frame"].as<std::string>();
    camera->types.push_back(row["type"].as<std::string>());
    return row;
  };
  const YAML::Node color = stream("color", &s.topics.color, &camera->frames.color);
  s.topics.color_info = color["info"].as<std::string>();
  s.color_encoding = color["encoding"].as<std::string>();
  s.color_rate = color["rate"].as<double>();
  s.camera.width = color["size"][0].as<int>();
  s.camera.height = color["size"][1].as<int>();
  s.camera.fx = s.camera.fy = 0.55 * s.camera.width;  // as wide as such cameras are
  s.camera.cx = 0.5 * s.camera.width - 0.5;
  s.camera.cy = 0.5 * s.camera.height - 0.5;
  s.camera.model = DistortionModel::kRadTan;
  s.camera.distortion = node["distortion"].as<std::vector<double>>();
  const YAML::Node depth = stream("depth", &s.topics.depth, &camera->frames.depth);
  s.topics.depth_info = depth["info"].as<std::string>();
  s.depth_encoding = depth["encoding"].as<std::string>();
  s.depth_rate = depth["rate"].as<double>();
  s.depth_scale = depth["scale"].as<double>();
  const auto geometry = depth["geometry"].as<std::string>();
  if (geometry != "colour" && geometry != "undistorted") throw std::runtime_error("depth/geometry: " + geometry);
  s.depth_undistorted = geometry == "undistorted";
  const YAML::Node imu = stream("imu", &s.topics.imu, &camera->frames.imu),
                   gyro = stream("gyro", &s.topics.gyro, &camera->frames.gyro),
                   accel = stream("accel", &s.topics.accel, &camera->frames.accel);
  if (const YAML::Node clock = imu ? imu : gyro) {
    s.imu_rate = clock["rate"].as<double>();
    s.time_offset = clock["stamp_late"].as<double>(0.0);
  }
  if (accel) camera->accel_rate = accel["rate"].as<double>();
}

void readTf(const YAML::Node& tf, DriverCamera* camera) {
  std::vector<TfEdge> all;
  for (const auto& row : tf) {
    source(row, "tf");
    const auto xyz = row["xyz"].as<std::vector<double>>();
    all.push_back({row["parent"].as<std::string>(), row["child"].as<std::string>(),
                   SE3(rotationOf(row), Eigen::Vector3d(xyz.at(0), xyz.at(1), xyz.at(2)))});
    if (row["published"].as<bool>(true)) camera->edges.push_back(all.back());
    for (const std::string& frame : {all.back().parent, all.back().child}) camera->all_frames.push_back(frame);
  }
  if (!camera->published.topics.hasInertial()) return;  // the body that is tracked is the colour camera
  const std::string imu = camera->published.topics.imu.empty() ? camera->frames.gyro : camera->frames.imu;
  camera->published.T_imu_cam = chain(all, imu, camera->frames.color);
}

DriverCamera cameraFrom(const std::string& name, const YAML::Node& node, const YAML::Node& launches) {
  DriverCamera camera;
  camera.name = name;
  camera.sensor = node["sensor"].as<std::string>(name);
  camera.published.name = camera.sensor;
  camera.launch = launchFrom(launches[node["launch"].as<std::string>()]);
  camera.ns = node["namespace"].as<std::string>("");
  camera.needs = node["needs"].as<Strings>();
  readStreams(node, &camera);
  readTf(node["tf"], &camera);
  return camera;
}

std::string slurp(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  return std::string((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
}

}  // namespace

DriverBagOptions DriverCamera::bag() const {
  DriverBagOptions options;
  options.sensor = published;
  options.frames = frames;
  options.edges = edges;
  options.accel_rate = accel_rate;
  return options;
}

std::vector<DriverCamera> driverCameras() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(DRIVER_TABLES)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<DriverCamera> out;
  for (const fs::path& file : files) {
    const YAML::Node root = YAML::LoadFile(file.string());
    for (const auto& entry : root["cameras"]) {
      const auto name = entry.first.as<std::string>();
      try {
        out.push_back(cameraFrom(name, entry.second, root["launch"]));
      } catch (const std::exception& error) {
        throw std::runtime_error(file.string() + ": " + name + ": " + error.what());
      }
    }
  }
  return out;
}

LaunchInclude readLaunch(const std::string& path, const DriverLaunch& driver) {
  const std::string text = std::regex_replace(slurp(path), std::regex("<!--[^]*?-->"), "");
  const std::string included = "file=\"$(find " + driver.package + ")/" + driver.file + "\"";
  const std::size_t begin = text.find(included);
  if (begin == std::string::npos) throw std::runtime_error(path + ": does not include " + included);
  const std::size_t end = text.find("</include>", begin);
  const std::string before = text.substr(0, begin), block = text.substr(begin, end - begin);
  Strings ours;
  const std::regex declared("<arg name=\"([^\"]+)\" default=\"([^\"]*)\""),
      given("<arg name=\"([^\"]+)\" value=\"([^\"]*)\"");
  for (std::sregex_iterator it(before.begin(), before.end(), declared), last; it != last; ++it)
    ours[(*it)[1]] = (*it)[2];
  LaunchInclude out;
  out.sensor = ours["sensor"];
  std::smatch ns;
  if (std::regex_search(before, ns, std::regex("<group[^>]* ns=\"([^\"]*)\">\\s*<include $"))) out.ns = ns[1];
  for (std::sregex_iterator it(block.begin(), block.end(), given), last; it != last; ++it) {
    std::string value = (*it)[2];
    std::smatch ours_name;
    if (std::regex_match(value, ours_name, std::regex("\\$\\(arg ([^)]+)\\)"))) value = ours.at(ours_name[1]);
    out.passed[(*it)[1]] = value;
  }
  return out;
}

}  // namespace vip_slam::test_support
