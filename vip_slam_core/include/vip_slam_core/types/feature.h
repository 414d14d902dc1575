// SPDX-License-Identifier: BSD-3-Clause
// Identifiers and image features that the front end passes to planes and back end.
#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

namespace vip_slam {

using KeyframeId = std::uint64_t;
using PlaneId = std::uint64_t;
/// A landmark's id is the id of the track that first saw it.
using LandmarkId = std::int64_t;
constexpr LandmarkId kNoLandmark = -1;

using Descriptor = std::array<std::uint8_t, 32>;  ///< 256-bit ORB
/// Number of differing bits.
int hammingDistance(const Descriptor& a, const Descriptor& b);

/// By how much an octave of the corners' image pyramid is smaller than the one before.
constexpr double kOctaveScale = 1.4;

struct Feature {
  LandmarkId id = kNoLandmark;  ///< track id; kNoLandmark for a corner that was detected but is not tracked
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  ///< distorted pixel, colour image
  Eigen::Vector2f xy = Eigen::Vector2f::Zero();     ///< undistorted normalised coordinates (z = 1)
  float pixel_sigma = 0;                            ///< one sigma of pixel in each direction, px; 0 = not reported
  float depth = 0;                                  ///< z in the camera, metres; 0 = no safe depth
  float depth_sigma = 0;                            ///< one sigma of depth, metres
  float angle = 0;                                  ///< ORB orientation, radians
  std::uint8_t octave =
      0;  ///< of the pyramid in which the corner was found; its pixel is known to kOctaveScale^octave px
  std::uint32_t age = 0;  ///< number of images that the track has survived
  Descriptor descriptor{};
};

}  // namespace vip_slam
