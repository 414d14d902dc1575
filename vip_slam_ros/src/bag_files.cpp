// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/bag_files.h"

#include <glob.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>

#include "vip_slam_core/util/formatted.h"

namespace vip_slam {
namespace {

namespace fs = std::filesystem;

bool endsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

std::vector<std::string> bagsInFolder(const std::string& folder) {
  std::vector<std::string> bags;
  for (const auto& entry : fs::directory_iterator(folder))
    if (endsWith(entry.path().string(), ".bag") && !entry.is_directory()) bags.push_back(entry.path().string());
  if (!bags.empty()) return bags;
  const std::string active = std::any_of(fs::directory_iterator(folder), fs::directory_iterator(),
                                         [](const auto& e) { return endsWith(e.path().string(), ".bag.active"); })
                                 ? "; a .bag.active was cut off: rosbag reindex, then rename it"
                                 : "";
  throw std::runtime_error(folder + ": no bag (*.bag) in this folder" + active);
}

std::vector<std::string> bagsOfPattern(const std::string& pattern) {
  glob_t found;
  std::vector<std::string> bags;
  if (::glob(pattern.c_str(), 0, nullptr, &found) == 0) bags.assign(found.gl_pathv, found.gl_pathv + found.gl_pathc);
  ::globfree(&found);
  if (bags.empty()) throw std::runtime_error(pattern + ": no file matches, expected bags");
  return bags;
}

/// The bags that the inputs stand for, each once.
std::set<std::string> resolve(const std::vector<std::string>& inputs) {
  std::set<std::string> paths, seen;
  const auto add = [&](const std::string& path) {
    if (seen.insert(fs::weakly_canonical(path).string()).second) paths.insert(path);
  };
  std::vector<std::string> searched;
  for (const std::string& input : inputs) {
    std::error_code none;
    if (fs::is_directory(input, none)) {
      for (const std::string& bag : bagsInFolder(input)) searched.push_back(bag);
    } else if (!fs::exists(input, none) && input.find_first_of("*?[") != std::string::npos) {
      for (const std::string& bag : bagsOfPattern(input)) searched.push_back(bag);
    } else {
      add(input);
    }
  }
  for (const std::string& bag : searched)
    if (searched.size() == 1 || !endsWith(bag, ".orig.bag")) add(bag);
  if (paths.empty()) throw std::runtime_error("no bag given");
  return paths;
}

}  // namespace

void openBag(const std::string& path, rosbag::Bag* bag) {
  if (!fs::exists(path)) throw std::runtime_error(path + ": no such file, expected a bag");
  std::ifstream file(path, std::ios::binary);
  std::string first;
  if (!std::getline(file, first) || first.rfind("#ROSBAG V", 0) != 0)
    throw std::runtime_error(path + ": not a readable bag, expected a file that rosbag recorded");
  try {
    bag->open(path, rosbag::bagmode::Read);
  } catch (const std::exception& error) {
    throw std::runtime_error(path + ": not a readable bag: " + error.what() +
                             "; if the recording was cut off, run: rosbag reindex " + path);
  }
}

BagSet::BagSet(const std::vector<std::string>& inputs) {
  for (const std::string& path : resolve(inputs)) {
    Part part;
    part.path = path;
    part.bag = std::make_unique<rosbag::Bag>();
    openBag(path, part.bag.get());
    rosbag::View all(*part.bag);
    part.empty = all.size() == 0;
    if (!part.empty) part.begin = all.getBeginTime(), part.end = all.getEndTime();
    bags_.push_back(std::move(part));
  }
  std::stable_sort(bags_.begin(), bags_.end(), [](const Part& a, const Part& b) { return a.begin < b.begin; });
  if (std::all_of(bags_.begin(), bags_.end(), [](const Part& p) { return p.empty; }))
    throw std::runtime_error(name() + (bags_.size() == 1 ? ": an empty bag" : ": all empty"));
}

std::unique_ptr<rosbag::View> BagSet::view(const std::vector<std::string>& topics, const ros::Time& begin,
                                           const ros::Time& end) const {
  auto view = std::make_unique<rosbag::View>();
  for (const Part& part : bags_) {
    if (topics.empty())
      view->addQuery(*part.bag, begin, end);
    else
      view->addQuery(*part.bag, rosbag::TopicQuery(topics), begin, end);
  }
  return view;
}

std::string BagSet::name() const {
  if (bags_.size() == 1) return bags_.front().path;
  return bags_.front().path + formatted(" and %zu more", bags_.size() - 1);
}

std::string BagSet::paths() const {
  std::string text;
  for (const Part& part : bags_) text += (text.empty() ? "" : ", ") + part.path;
  return text;
}

std::string BagSet::description() const {
  constexpr double kGap = 1.0;  // s
  std::string text = formatted("%zu bags in order of time:", bags_.size());
  ros::Time end;
  for (const Part& part : bags_) {
    text += (&part == &bags_.front() ? " " : ", ") + fs::path(part.path).filename().string();
    if (part.empty) {
      text += " (empty)";
      continue;
    }
    text += formatted(" (%.1f s", (part.end - part.begin).toSec());
    if (!end.isZero() && (part.begin - end).toSec() > kGap)
      text += formatted(", %.1f s after the end of those before", (part.begin - end).toSec());
    text += ")";
    end = std::max(end, part.end);
  }
  return text;
}

}  // namespace vip_slam
