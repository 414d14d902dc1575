// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/io/rgbd_folder.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include <Eigen/SVD>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_core/geometry/so3.h"
#include "vip_slam_core/util/formatted.h"
#include "vip_slam_core/util/size_text.h"
#include "vip_slam_core/util/stamp_unit.h"

namespace vip_slam {
namespace {

namespace fs = std::filesystem;

constexpr double kMaxSkew = 0.02;            // s, between colour and depth of one frame
constexpr double kMaxOffOrthonormal = 0.05;  // of a rotation that is written with few digits

std::vector<double> numbersOf(const fs::path& path, std::size_t expected) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error(path.string() + ": cannot be read");
  std::vector<double> values;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      char* end = nullptr;
      values.push_back(std::strtod(word.c_str(), &end));
      if (*end != '\0' || !std::isfinite(values.back()))
        throw std::runtime_error(path.string() + ":" + std::to_string(number) + ": '" + word + "', expected a number");
    }
  }
  if (values.size() != expected)
    throw std::runtime_error(path.string() + ": expected " + std::to_string(expected) + " numbers, found " +
                             std::to_string(values.size()));
  return values;
}

/// The colour camera that 7-Scenes does not calibrate: a Kinect v1's, 25 mm to the right of the infrared camera by
/// construction. The rest is measured on 240 frames of its kitchen, by a bundle adjustment of corner tracks in colour
/// and the depth of each view with all poses free: focal lengths of 526 to 536 px fit alike, each half of the frames
/// gives a turn of about one degree about both axes and 26 to 33 ms of readout. Its robust cost is 9 % less than with
/// the nominal 525 px, image centre, no turn and no readout.
namespace colour_of_kinect {
constexpr double kBaseline = 0.025;                                   // m
constexpr double kFocal = 530.0, kCentreX = 329.7, kCentreY = 250.8;  // px of 640 x 480
constexpr double kTurnDeg[3] = {1.2, -0.94, 0.12};                    // rotation vector of T_color_depth
constexpr double kReadout = 0.031;                                    // s
}  // namespace colour_of_kinect

/// Makes the folder's camera the depth camera, adds a colour camera next to it and converts the poses to that.
void separateColour(RgbdFolder* folder) {
  namespace colour = colour_of_kinect;
  folder->depth_registered = false;
  folder->depth_camera = folder->camera;
  const double scale = folder->camera.width / 640.0;
  folder->camera.fx = folder->camera.fy = colour::kFocal * scale;
  folder->camera.cx = colour::kCentreX * scale;
  folder->camera.cy = colour::kCentreY * scale;
  folder->colour_readout = colour::kReadout;
  const Eigen::Vector3d turn = Eigen::Vector3d(colour::kTurnDeg) * kDegree;
  folder->T_color_depth = SE3(expSO3(turn), Eigen::Vector3d(-colour::kBaseline, 0, 0));
  for (StampedPose& p : folder->T_W_C) p.T_W_B = p.T_W_B * folder->T_color_depth.inverse();
}

RgbdFolder openSevenScenes(const fs::path& folder, double rate) {
  RgbdFolder out;
  std::vector<std::pair<long, fs::path>> found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    long n;
    char rest[32];
    if (std::sscanf(name.c_str(), "frame-%ld.%31s", &n, rest) == 2 && std::string(rest).rfind("color.", 0) == 0)
      found.emplace_back(n, entry.path());
  }
  std::sort(found.begin(), found.end());
  for (const auto& [n, colour] : found) {
    const std::string stem = formatted("frame-%06ld", n);
    const double t = static_cast<double>(n - found.front().first) / rate;
    const fs::path depth = folder / (stem + ".depth.png"), pose = folder / (stem + ".pose.txt");
    if (!fs::exists(depth)) throw std::runtime_error(depth.string() + ": missing");
    out.frames.push_back({t, t, colour.string(), depth.string()});
    const std::vector<double> m = numbersOf(pose, 16);
    const Eigen::Matrix4d T = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(m.data());
    const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
    const double off = (R * R.transpose() - Eigen::Matrix3d::Identity()).norm();
    if (off > kMaxOffOrthonormal)
      throw std::runtime_error(pose.string() +
                               formatted(": the first three columns are off a rotation by %.2g, expected at most %g",
                                         off, kMaxOffOrthonormal));
    out.T_W_C.push_back({t, SE3(nearestRotation(R), T.topRightCorner<3, 1>())});
  }
  const std::vector<double> k = numbersOf(folder / "camera-intrinsics.txt", 9);
  out.camera.fx = k[0];
  out.camera.fy = k[4];
  out.camera.cx = k[2];
  out.camera.cy = k[5];
  return out;
}

std::vector<std::pair<double, std::string>> readList(const fs::path& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error(path.string() + ": cannot be read");
  std::vector<std::pair<double, std::string>> out;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (line.empty() || line[0] == '#') continue;
    const std::string where = path.string() + ":" + std::to_string(number) + ": ";
    std::stringstream s(line);
    double t;
    std::string file;
    if (!(s >> t >> file)) throw std::runtime_error(where + "'" + line + "', expected 'stamp file'");
    if (!out.empty() && t == out.back().first) continue;  // some public recordings repeat lines
    if (!out.empty() && t < out.back().first)
      throw std::runtime_error(where + formatted("stamp %.6f does not follow %.6f", t, out.back().first));
    if (!std::isfinite(t)) throw std::runtime_error(where + "the stamp is not finite");
    out.emplace_back(t, file);
  }
  if (!out.empty()) {
    const double unit = secondsPerUnit(out.front().first, out.back().first, out.size());
    for (auto& [t, file] : out) t *= unit;
  }
  return out;
}

std::vector<double> stampsOf(const std::vector<std::pair<double, std::string>>& list) {
  std::vector<double> stamps;
  for (const auto& [t, file] : list) stamps.push_back(t);
  return stamps;
}

RgbdFolder openTum(const fs::path& folder) {
  RgbdFolder out;
  out.T_W_C = readTum((folder / "groundtruth.txt").string());
  const auto colour = readList(folder / "rgb.txt"), depth = readList(folder / "depth.txt");
  if (depth.empty()) throw std::runtime_error((folder / "depth.txt").string() + ": no image");
  for (const auto& [c, d] : pairInOrder(stampsOf(colour), stampsOf(depth), kMaxSkew))
    out.frames.push_back(
        {colour[c].first, depth[d].first, (folder / colour[c].second).string(), (folder / depth[d].second).string()});
  return out;
}

}  // namespace

// Dynamic programming over both lists. A colour image that stays alone costs as much as a pair at the largest
// difference, so that all are paired that can be, and then as closely as possible.
std::vector<std::pair<std::size_t, std::size_t>> pairInOrder(const std::vector<double>& colour,
                                                             const std::vector<double>& depth, double tolerance) {
  enum Step : char { kAlone, kSkipDepth, kPair };
  const std::size_t n = colour.size(), m = depth.size();
  std::vector<std::vector<Step>> step(n + 1, std::vector<Step>(m + 1, kSkipDepth));
  std::vector<double> before(m + 1, 0.0), cost(m + 1);
  for (std::size_t i = 1; i <= n; ++i) {
    for (std::size_t j = 0; j <= m; ++j) {
      cost[j] = before[j] + tolerance * tolerance;
      step[i][j] = kAlone;
      if (j == 0) continue;
      const double skew = depth[j - 1] - colour[i - 1], together = before[j - 1] + skew * skew;
      if (std::abs(skew) <= tolerance && together <= cost[j]) cost[j] = together, step[i][j] = kPair;
      if (cost[j - 1] <= cost[j]) cost[j] = cost[j - 1], step[i][j] = kSkipDepth;
    }
    std::swap(before, cost);
  }
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t i = n, j = m; i > 0;) {
    const Step s = step[i][j];
    if (s == kPair) pairs.emplace_back(i - 1, j - 1);
    i -= s != kSkipDepth;
    j -= s != kAlone;
  }
  std::reverse(pairs.begin(), pairs.end());
  return pairs;
}

namespace {

/// The images of a TUM layout tell their unit; its own recordings have the data set's.
DepthFactor factorOf(const RgbdFolder& folder, const std::string& path) {
  constexpr std::size_t kLookedAt = 12;
  if (fs::absolute(path + "/.").lexically_normal().parent_path().filename().string().find("freiburg") !=
      std::string::npos)
    return {5000, true, "the data set's own"};
  std::vector<cv::Mat> images;
  for (std::size_t i = 0; i < folder.frames.size(); i += std::max<std::size_t>(1, folder.frames.size() / kLookedAt)) {
    const cv::Mat image = cv::imread(folder.frames[i].depth, cv::IMREAD_UNCHANGED);
    if (image.type() == CV_16UC1) images.push_back(image);
  }
  return guessDepthFactor(images);
}

}  // namespace

RgbdFolder openRgbdFolder(const std::string& folder, double rate, bool registered, double depth_factor) {
  if (!fs::is_directory(folder)) throw std::runtime_error(folder + ": no such directory");
  const bool tum = fs::exists(fs::path(folder) / "rgb.txt");
  RgbdFolder out = tum ? openTum(folder) : openSevenScenes(folder, rate);
  if (out.frames.size() < 2)
    throw std::runtime_error(
        folder + ": expected frame-N.color.* with depth and pose, or rgb.txt with depth.txt and groundtruth.txt");
  const cv::Mat first = cv::imread(out.frames.front().colour, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  if (first.empty()) throw std::runtime_error(out.frames.front().colour + ": not an image");
  out.camera.width = first.cols;
  out.camera.height = first.rows;
  if (depth_factor > 0) {
    out.depth_scale = 1.0 / depth_factor;
  } else if (tum) {
    out.depth_guess = factorOf(out, folder);
    out.depth_scale = 1.0 / out.depth_guess->units_per_metre;
  }
  if (!tum && !registered) separateColour(&out);
  return out;
}

void loadRgbdFrame(const RgbdFolder& folder, const RgbdFrame& frame, cv::Mat* rgb, cv::Mat* depth_mm) {
  const cv::Mat bgr = cv::imread(frame.colour, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  if (bgr.empty()) throw std::runtime_error(frame.colour + ": not an image");
  const cv::Mat raw = cv::imread(frame.depth, cv::IMREAD_UNCHANGED);
  if (raw.empty()) throw std::runtime_error(frame.depth + ": not an image");
  if (raw.type() != CV_16UC1)
    throw std::runtime_error(frame.depth + ": is " + cv::typeToString(raw.type()) + ", expected 16-bit grey");
  if (raw.size() != bgr.size())
    throw std::runtime_error(frame.depth + ": is " + sizeText(raw.size()) + ", expected " + sizeText(bgr.size()) +
                             " as " + frame.colour);
  cv::cvtColor(bgr, *rgb, cv::COLOR_BGR2RGB);
  raw.convertTo(*depth_mm, CV_16U, folder.depth_scale * 1000);
  depth_mm->setTo(0, raw == 65535);
}

}  // namespace vip_slam
