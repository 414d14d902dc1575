// SPDX-License-Identifier: BSD-3-Clause
// Map files (.vsm): everything that a later session needs to relocalise and to continue mapping.
//
// Layout, little-endian: "VIPMAP" 0 0 | u32 version = 7 | u32 reserved = 0 | u64 payload bytes | payload | u32 CRC-32
// of all before it. Version 1 (without the features' pixel_sigma), version 2 (without track numbers within a landmark),
// version 3 (without the odometry's motion), version 4 (without the camera), version 5 (without the scale of the IMU's
// noise) and version 6 (without those of its random walks) are read, too. The payload holds the vocabulary's id, the
// camera, planes, keyframes (state, features with descriptors, depth grid in mm, IMU samples, plane observations),
// landmarks and loops.
//
// The same map gives the same bytes: landmarks and epochs are renumbered in ascending order when written, the tracks of
// a landmark in the order of their first views. When read, landmarks get ids from kLoadedLandmarks on and epochs from
// kLoadedEpochs on, so that they never collide with those of the running odometry. Tracks get ids that differ from
// those of landmarks, since a landmark that is found again starts another track. Keyframe and plane ids are kept.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vip_slam_backend/map/map.h"
#include "vip_slam_core/camera/camera_model.h"

namespace vip_slam {

/// First id of a loaded landmark; times a track's number within a landmark plus the landmark's id: that track's id.
constexpr LandmarkId kLoadedLandmarks = LandmarkId(1) << 40;
/// Offset between the landmark ids of maps loaded one after the other, since tracks of the front end outlive a map.
constexpr LandmarkId kLoadedApart = LandmarkId(1) << 51;
constexpr std::uint32_t kLoadedEpochs = 0x80000000u;

struct StoredMap {
  Map map;
  std::vector<std::pair<KeyframeId, KeyframeId>> loops;  ///< (query, match)
  std::uint64_t vocabulary_id = 0;         ///< of the session that stored it; words are made anew on loading
  std::optional<CameraIntrinsics> camera;  ///< of the features and depth grids; empty in older files
};

std::string serialiseMap(const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops,
                         std::uint64_t vocabulary_id, const std::optional<CameraIntrinsics>& camera = {});
/// Throws std::runtime_error "source: what, expected what" on anything that is not a whole, undamaged, consistent map
/// of this version. Allocates no more than a small multiple of `size`. Landmarks get ids from `first_landmark` on.
StoredMap parseMap(const std::uint8_t* data, std::size_t size, const std::string& source, const ImuNoise& noise,
                   LandmarkId first_landmark = kLoadedLandmarks);

/// Whole or not at all. Throws std::runtime_error naming the path.
void saveMapFile(const std::string& path, const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops,
                 std::uint64_t vocabulary_id, const std::optional<CameraIntrinsics>& camera = {});
StoredMap loadMapFile(const std::string& path, const ImuNoise& noise, LandmarkId first_landmark = kLoadedLandmarks);

/// Throws std::runtime_error "path: made with ..., but the camera is ..." when places of the map would not be
/// recognised with `camera`: another image size or lens model, a focal length that differs by more than 5 %, or a
/// principal point by more than 5 % of the width. A map without a camera is accepted.
void requireCamera(const StoredMap& stored, const CameraIntrinsics& camera, const std::string& path);

}  // namespace vip_slam
