// SPDX-License-Identifier: BSD-3-Clause
// Constants shared by writer and reader of map files.
#pragma once

#include <cstddef>
#include <cstdint>

namespace vip_slam {
namespace map_file {

constexpr char kMagic[8] = {'V', 'I', 'P', 'M', 'A', 'P', 0, 0};
constexpr std::uint32_t kVersion = 7;
/// Oldest readable version. Version 1 lacks the features' pixel_sigma, up to 2 a landmark has a single track, up to 3
/// there is no odometry motion, up to 4 no camera, up to 5 no scale of the IMU's noise, up to 6 none
/// of its random walks.
constexpr std::uint32_t kOldestVersion = 1;
constexpr float kPixelSigmaOfVersion1 = 0.3f;  ///< average sigma of tracks, px
constexpr std::size_t kHeader = 8 + 4 + 4 + 8;
constexpr std::uint32_t kNoIndex = 0xFFFFFFFFu;
constexpr std::size_t kMaxTracks = 255;  ///< largest number of a track within a landmark
constexpr double kDepthUnit = 0.001;     ///< metres per unit of a stored depth grid

// Smallest sizes of elements in bytes, to reject counts that exceed the file.
constexpr std::size_t kFeatureBytes = 7 * 4 + 2 + 32 + 4;
constexpr std::size_t kImuBytes = 7 * 8;
constexpr std::size_t kPlaneSampleBytes = 4 * 4;
constexpr std::size_t kPointBytes = 3 * 8;
constexpr std::size_t kLandmarkBytes = 3 * 8 + 8 + 4 + 4 + 32;
constexpr std::size_t kKeyframeBytes = 8 + 8 + 4 + 1 + 2 * 17 * 8 + 7 * 8;
constexpr std::size_t kPlaneBytes = 8 + 1 + 1 + 4 * 8 + 8 + 4 + 4;

}  // namespace map_file
}  // namespace vip_slam
