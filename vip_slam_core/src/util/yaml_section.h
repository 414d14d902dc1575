// SPDX-License-Identifier: BSD-3-Clause
// Strict reading of YAML maps: every key must be known, every value have its type and lie within its range. Errors are
// std::runtime_error that begin with the key's full name ("imu/rate: ...").
#pragma once

#include <cmath>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "util/text.h"
#include "vip_slam_core/geometry/rigid_check.h"
#include "vip_slam_core/geometry/se3.h"

namespace vip_slam {

/// A map whose every key must be read: a key that is left over is unknown and an error.
class Section {
 public:
  Section(YAML::Node node, std::string name) : node_(std::move(node)), name_(std::move(name)) {
    if (!node_.IsMap())
      throw std::runtime_error((name_.empty() ? "file" : name_) + ": " + shape(node_, "entries") + ", expected a map");
    std::set<std::string> keys;
    for (const auto& entry : node_) {
      if (!keys.insert(entry.first.Scalar()).second)
        throw std::runtime_error(full(entry.first.Scalar()) + ": stands there twice, expected once");
    }
  }
  bool has(const std::string& key) {
    known_.insert(key);
    return static_cast<bool>(node_[key]);
  }
  std::string full(const std::string& key) const { return name_.empty() ? key : name_ + "/" + key; }
  YAML::Node need(const std::string& key) {
    if (!has(key)) throw std::runtime_error(full(key) + ": missing, expected a value" + likeIt(key));
    return node_[key];
  }
  /// A finite number within [min, max].
  void number(const std::string& key, double& value, double min, double max, bool required = true) {
    if (!required && !has(key)) return;
    get(key, value);
    if (!(value >= min && value <= max)) {
      throw std::runtime_error(full(key) + ": is " + formatDouble(value) + ", expected " + formatDouble(min) + " to " +
                               formatDouble(max));
    }
  }
  void choice(const std::string& key, std::string& value, const std::vector<std::string>& choices) {
    get(key, value);
    std::string expected;
    for (const std::string& name : choices) {
      if (name == value) return;
      expected += (expected.empty() ? "" : ", ") + name;
    }
    throw std::runtime_error(full(key) + ": is '" + value + "', expected one of " + expected);
  }
  Section section(const std::string& key) { return Section(need(key), full(key)); }

  template <class T>
  void get(const std::string& key, T& value, bool required = true) {
    if (!required && !has(key)) return;
    const YAML::Node node = need(key);
    try {
      value = node.as<T>();
    } catch (const YAML::Exception&) {
      throw std::runtime_error(full(key) + ": is '" + (node.IsScalar() ? node.Scalar() : "a list") + "', expected " +
                               expectedType(value));
    }
  }
  template <int N>
  void matrix(const std::string& key, Eigen::Matrix<double, N, N>& M, bool required = true) {
    if (!required && !has(key)) return;
    const YAML::Node node = need(key);
    const std::string n = std::to_string(N), numbers = "expected " + n + " numbers";
    if (!node.IsSequence() || node.size() != N)
      throw std::runtime_error(full(key) + ": " + shape(node, "rows") + ", expected " + n + " rows of " + n +
                               " numbers");
    for (int r = 0; r < N; ++r) {
      const std::string row = full(key) + ": row " + std::to_string(r + 1) + ": ";
      if (!node[r].IsSequence() || node[r].size() != N)
        throw std::runtime_error(row + shape(node[r], "entries") + ", " + numbers);
      for (int c = 0; c < N; ++c) {
        if (!node[r][c].IsScalar())
          throw std::runtime_error(row + "entry " + std::to_string(c + 1) + " is a list, " + numbers);
        if (!parseDouble(node[r][c].Scalar(), &M(r, c)))
          throw std::runtime_error(row + "'" + node[r][c].Scalar() + "', " + numbers);
      }
    }
  }
  /// `notes` receives that a rounded rotation was made exact.
  void pose(const std::string& key, SE3& T, std::vector<std::string>* notes, bool required = true) {
    if (!required && !has(key)) return;
    Eigen::Matrix4d M;
    matrix(key, M);
    const RigidTransform rigid = rigidTransform(M);
    if (!rigid.problem.empty()) throw std::runtime_error(full(key) + ": not a rigid transform: " + rigid.problem);
    if (!rigid.note.empty()) notes->push_back(full(key) + ": " + rigid.note);
    T = rigid.T;
  }
  void finish() const {
    for (const auto& entry : node_)
      if (!known_.count(entry.first.Scalar())) throw std::runtime_error(full(entry.first.Scalar()) + ": unknown key");
  }

 private:
  /// A key of the map that may be meant by a missing one, in words.
  std::string likeIt(const std::string& key) const {
    for (const auto& entry : node_) {
      const std::string& other = entry.first.Scalar();
      if (!known_.count(other) && editDistance(key, other) <= key.size() / 4)
        return "; '" + full(other) + "' is no key, is it meant?";
    }
    return "";
  }
  /// What stands there instead of a list of `entries`.
  static std::string shape(const YAML::Node& node, const std::string& entries) {
    if (node.IsSequence()) return std::to_string(node.size()) + " " + entries;
    return node.IsScalar() ? "'" + node.Scalar() + "'" : "a map";
  }
  static const char* expectedType(bool) { return "true or false"; }
  static const char* expectedType(int) { return "a whole number"; }
  static const char* expectedType(double) { return "a number"; }
  static const char* expectedType(const std::string&) { return "a text"; }
  static const char* expectedType(const std::vector<double>&) { return "a list of numbers"; }

  YAML::Node node_;
  std::string name_;
  std::set<std::string> known_;
};

}  // namespace vip_slam
