// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "map_file_format.h"
#include "vip_slam_backend/map_io/byte_stream.h"
#include "vip_slam_backend/map_io/map_file.h"
#include "vip_slam_backend/util/crc32.h"
#include "vip_slam_core/imu/gyro_correction.h"
#include "vip_slam_core/util/atomic_file.h"

namespace vip_slam {
namespace {

// Reading normalises the quaternion, and by rounding some rotations would drift over repeated saving and loading. So
// three coefficients are rounded to a grid some bits coarser than double precision, and the fourth, a large one, is
// computed from them: the next save then gives the same four numbers.
Eigen::Vector4d settled(const Eigen::Quaterniond& rotation) {
  constexpr double kGrid = 0x1p-49, kLarge = 0.4;  // one of four is at least a half
  Eigen::Vector4d q = rotation.coeffs();
  int large = 0;
  while (large < 3 && std::abs(q(large)) < kLarge) ++large;
  double rest = 1.0;
  for (int k = 0; k < 4; ++k) {
    if (k == large) continue;
    q(k) = std::round(q(k) / kGrid) * kGrid;
    rest -= q(k) * q(k);
  }
  q(large) = std::copysign(std::sqrt(rest), q(large));
  return q;
}

void write(ByteWriter& out, const SE3& T) {
  out.vector(settled(T.rotation()));
  out.vector(T.t());
}

void write(ByteWriter& out, const CameraIntrinsics& camera) {
  for (const int v : {camera.width, camera.height}) out.put(static_cast<std::uint32_t>(v));
  for (const double v : {camera.fx, camera.fy, camera.cx, camera.cy}) out.put(v);
  out.put(static_cast<std::uint8_t>(camera.model));
  out.put(static_cast<std::uint32_t>(camera.distortion.size()));
  for (const double v : camera.distortion) out.put(v);
}

void write(ByteWriter& out, const NavState& s) {
  out.put(s.t);
  write(out, s.T_W_I);
  out.vector(s.v_W);
  out.vector(s.bias_gyro);
  out.vector(s.bias_accel);
}

void write(ByteWriter& out, const DepthGrid& grid) {
  for (const int v : {grid.stride, grid.offset, grid.cols, grid.rows}) out.put(static_cast<std::uint16_t>(v));
  for (const float z : grid.z) {
    const double units = std::round(z / map_file::kDepthUnit);
    out.put(static_cast<std::uint16_t>(units >= 0 && units <= 65535 ? units : 0));
  }
}

void write(ByteWriter& out, const Ring& ring) {
  out.put(static_cast<std::uint32_t>(ring.size()));
  for (const Eigen::Vector3d& p : ring) out.vector(p);
}

void write(ByteWriter& out, const MapPlane& plane) {
  const PlaneEstimate& e = plane.estimate;
  out.put(e.id);
  out.put(static_cast<std::uint8_t>(e.kind));
  out.put(static_cast<std::uint8_t>(plane.optimised));
  out.vector(e.plane.n);
  out.put(e.plane.d);
  out.put(e.area);
  out.put(e.keyframes);
  out.put(static_cast<std::uint32_t>(e.polygons.size()));
  for (const PlanePolygon& polygon : e.polygons) {
    write(out, polygon.outer);
    out.put(static_cast<std::uint32_t>(polygon.holes.size()));
    for (const Ring& hole : polygon.holes) write(out, hole);
  }
}

void write(ByteWriter& out, const PlaneObservation& observation) {
  out.put(observation.plane);
  for (int r = 0; r < 4; ++r)
    for (int c = r; c < 4; ++c) out.put(observation.G(r, c));
  out.put(observation.weight_scale);
  out.put(static_cast<std::uint32_t>(observation.points.size()));
  for (const PlaneSample& p : observation.points) {
    out.vector(p.p_C);
    out.put(p.sigma);
  }
}

// Index of each landmark in the file, and its tracks that were written so far.
struct LandmarkNumbers {
  std::unordered_map<LandmarkId, std::uint32_t> index;
  std::vector<std::vector<LandmarkId>> tracks;

  // Number of the feature's track within the landmark, from 1 on; 0: no track or no landmark, not needed later.
  std::uint8_t track(const Feature& f, LandmarkId landmark) {
    if (f.id == kNoLandmark || landmark == kNoLandmark) return 0;
    std::vector<LandmarkId>& known = tracks[index.at(landmark)];
    const auto at = std::find(known.begin(), known.end(), f.id);
    const std::size_t number = static_cast<std::size_t>(at - known.begin()) + 1;
    constexpr auto last = std::numeric_limits<std::uint8_t>::max();
    if (at == known.end() && number <= last) known.push_back(f.id);
    return static_cast<std::uint8_t>(std::min<std::size_t>(number, last));
  }
};

void write(ByteWriter& out, const MapKeyframe& kf, std::uint32_t epoch, LandmarkNumbers* numbers) {
  const TrackedFrame& frame = kf.data->frame;
  out.put(kf.id());
  out.put(frame.t);
  out.put(epoch);
  out.put(static_cast<std::uint8_t>(frame.status.state));
  write(out, kf.state);
  write(out, frame.state);
  write(out, kf.T_I_C);
  out.put(frame.time_offset);
  out.put(static_cast<std::uint8_t>(kf.loop_keyframe));
  out.put(static_cast<std::uint8_t>(frame.zero_velocity));
  out.put(kf.previous);
  out.put(static_cast<std::uint32_t>(frame.features.size()));
  for (std::size_t k = 0; k < frame.features.size(); ++k) {
    const Feature& f = frame.features[k];
    const LandmarkId landmark = kf.landmarks[k];
    out.vector(f.pixel);
    out.vector(f.xy);
    out.put(f.pixel_sigma);
    out.put(f.depth);
    out.put(f.depth_sigma);
    out.put(f.angle);
    out.put(f.octave);
    out.put(numbers->track(f, landmark));
    out.bytes(f.descriptor.data(), f.descriptor.size());
    out.put(landmark == kNoLandmark ? map_file::kNoIndex : numbers->index.at(landmark));
  }
  write(out, frame.depth_grid);
  out.put(static_cast<std::uint8_t>(kf.motion.known()));
  if (kf.motion.known()) {
    write(out, kf.motion.T_a_b);
    for (int r = 0; r < 6; ++r)
      for (int c = r; c < 6; ++c) out.put(kf.motion.covariance(r, c));
  }
  out.put(kf.imu_noise_scale.density);
  out.put(kf.imu_noise_scale.gyro_walk);
  out.put(kf.imu_noise_scale.accel_walk);
  const std::size_t samples = kf.previous != 0 && kf.imu ? kf.imu->size() : 0;
  out.put(static_cast<std::uint32_t>(samples));
  const std::vector<ImuSample> scaled =
      samples > 0 ? withGyroCorrection(*kf.imu, kf.gyro_correction) : std::vector<ImuSample>();
  for (const ImuSample& s : scaled) {
    out.put(s.t);
    out.vector(s.gyro);
    out.vector(s.accel);
  }
  out.put(static_cast<std::uint32_t>(kf.planes.size()));
  for (const auto& entry : kf.planes) write(out, entry.second);
}

}  // namespace

std::string serialiseMap(const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops,
                         std::uint64_t vocabulary_id, const std::optional<CameraIntrinsics>& camera) {
  ByteWriter out;
  map_file::Header header;
  out.bytes(&header, sizeof header);
  out.put(vocabulary_id);
  out.put(static_cast<std::uint8_t>(camera.has_value()));
  if (camera) write(out, *camera);
  out.put(static_cast<std::uint32_t>(map.planes().size()));
  for (const auto& entry : map.planes()) write(out, entry.second);

  const std::vector<LandmarkId> landmarks = map.landmarkIds();
  LandmarkNumbers numbers;
  for (std::size_t k = 0; k < landmarks.size(); ++k) numbers.index[landmarks[k]] = static_cast<std::uint32_t>(k);
  numbers.tracks.resize(landmarks.size());
  std::unordered_map<std::uint32_t, std::uint32_t> epochs;
  out.put(static_cast<std::uint32_t>(map.keyframes().size()));
  for (const auto& entry : map.keyframes()) {
    const auto epoch = epochs.emplace(entry.second.data->frame.epoch, static_cast<std::uint32_t>(epochs.size())).first;
    write(out, entry.second, epoch->second, &numbers);
  }
  out.put(static_cast<std::uint32_t>(landmarks.size()));
  for (const LandmarkId id : landmarks) {
    const MapLandmark& l = map.landmark(id);
    out.vector(l.p_W);
    out.put(l.plane);
    out.put(l.visible);
    out.put(l.found);
    out.bytes(l.descriptor.data(), l.descriptor.size());
  }
  std::vector<std::pair<KeyframeId, KeyframeId>> kept;
  for (const auto& loop : loops)
    if (map.hasKeyframe(loop.first) && map.hasKeyframe(loop.second)) kept.push_back(loop);
  out.put(static_cast<std::uint32_t>(kept.size()));
  for (const auto& loop : kept) {
    out.put(loop.first);
    out.put(loop.second);
  }

  std::string bytes = out.take();
  header.payload_bytes = bytes.size() - sizeof header;
  std::memcpy(&bytes[0], &header, sizeof header);
  const std::uint32_t crc = crc32(bytes.data(), bytes.size());
  bytes.append(reinterpret_cast<const char*>(&crc), sizeof crc);
  return bytes;
}

void saveMapFile(const std::string& path, const Map& map, const std::vector<std::pair<KeyframeId, KeyframeId>>& loops,
                 std::uint64_t vocabulary_id, const std::optional<CameraIntrinsics>& camera) {
  const std::string bytes = serialiseMap(map, loops, vocabulary_id, camera);
  AtomicFile file(path, true);
  file.stream().write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.commit();
}

}  // namespace vip_slam
