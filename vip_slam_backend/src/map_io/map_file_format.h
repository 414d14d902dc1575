// What writer and reader of map files share.
#pragma once

#include <cstddef>
#include <cstdint>

namespace vip_slam {
namespace map_file {

constexpr char kMagic[8] = {'V', 'I', 'P', 'M', 'A', 'P', 0, 0};
constexpr std::uint32_t kVersion = 6;
/// Without the features' pixel_sigma; until 2 one track a landmark, until 3 no motion of the odometry, until 4 no
/// camera, until 5 no scale of the IMU's noise.
constexpr std::uint32_t kOldestVersion = 1;
constexpr float kPixelSigmaOfVersion1 = 0.3f;  ///< what tracks were worth on average, px
constexpr std::size_t kHeader = 8 + 4 + 4 + 8;
constexpr std::uint32_t kNoIndex = 0xFFFFFFFFu;
constexpr std::size_t kMostTracks = 255;  ///< of one landmark that are told apart
constexpr double kDepthUnit = 0.001;      ///< metres per unit of a stored depth grid

// Smallest sizes of elements, to refuse counts that cannot be true.
constexpr std::size_t kFeatureBytes = 7 * 4 + 2 + 32 + 4;
constexpr std::size_t kImuBytes = 7 * 8;
constexpr std::size_t kPlanePointBytes = 4 * 4;
constexpr std::size_t kPointBytes = 3 * 8;
constexpr std::size_t kLandmarkBytes = 3 * 8 + 8 + 4 + 4 + 32;
constexpr std::size_t kKeyframeBytes = 8 + 8 + 4 + 1 + 2 * 17 * 8 + 7 * 8;
constexpr std::size_t kPlaneBytes = 8 + 1 + 1 + 4 * 8 + 8 + 4 + 4;

}  // namespace map_file
}  // namespace vip_slam
