// SPDX-License-Identifier: BSD-3-Clause
// A back end whose map is checked after every operation.
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>

#include "vip_slam_backend/back_end.h"
#include "vip_slam_backend/map/map_checker.h"

namespace vip_slam {

class CheckedBackEnd : public BackEnd {
 public:
  using BackEnd::BackEnd;

  MapUpdate addKeyframe(KeyframePtr keyframe) { return checked(BackEnd::addKeyframe(std::move(keyframe)), "keyframe"); }
  void applyPlaneUpdate(const PlaneUpdate& update) {
    BackEnd::applyPlaneUpdate(update);
    check("plane update");
  }
  GbaJob startGlobalBa() { return checked(BackEnd::startGlobalBa(), "start of a global adjustment"); }
  MapUpdate merge(const GbaResult& result) { return checked(BackEnd::merge(result), "global adjustment"); }
  std::optional<MapUpdate> mapWaiting() { return checked(BackEnd::mapWaiting(), "end of waiting"); }
  MapUpdate finish() { return checked(BackEnd::finish(), "end"); }
  MapUpdate loadMap(const std::string& path) { return checked(BackEnd::loadMap(path), "loading"); }
  void reset() {
    BackEnd::reset();
    check("reset");
  }
  void setLocalisationMode(bool on) {
    BackEnd::setLocalisationMode(on);
    check("change of mode");
  }

 private:
  void check(const char* after) const { EXPECT_EQ(checkMap(map()), "") << "after " << after; }
  template <class Result>
  Result checked(Result result, const char* after) const {
    check(after);
    return result;
  }
};

}  // namespace vip_slam
