// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "map_file_format.h"
#include "vip_slam_backend/map/map_limits.h"
#include "vip_slam_backend/map_io/byte_stream.h"
#include "vip_slam_backend/map_io/map_file.h"
#include "vip_slam_backend/util/crc32.h"

namespace vip_slam {
namespace {

using map_file::Version;

double finite(ByteReader& in, const char* what) {
  const auto v = in.get<double>(what);
  if (!std::isfinite(v)) in.fail(std::string(what) + " is not a finite number");
  return v;
}

template <class Vector>
Vector finiteVector(ByteReader& in, const char* what) {
  const Vector v = in.vector<Vector>(what);
  if (!v.allFinite()) in.fail(std::string(what) + " is not finite");
  return v;
}

bool flag(ByteReader& in, const char* what) {
  const auto v = in.get<std::uint8_t>(what);
  if (v > 1) in.fail(std::string(what) + " is " + std::to_string(v) + ", expected 0 or 1");
  return v != 0;
}

SE3 readPose(ByteReader& in, const char* what) {
  const auto q = finiteVector<Eigen::Vector4d>(in, what);
  const auto t = finiteVector<Eigen::Vector3d>(in, what);
  if (std::abs(q.norm() - 1.0) > map_limits::kRounding)
    in.fail(std::string(what) + ": rotation is not a unit quaternion");
  return SE3(Eigen::Quaterniond(q(3), q(0), q(1), q(2)), t);
}

CameraIntrinsics readCamera(ByteReader& in) {
  CameraIntrinsics camera;
  const auto width = in.get<std::uint32_t>("camera"), height = in.get<std::uint32_t>("camera");
  if (width > 0xFFFF || height > 0xFFFF) in.fail("camera: image is larger than any");
  camera.width = static_cast<int>(width);
  camera.height = static_cast<int>(height);
  for (double* v : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) *v = finite(in, "camera");
  const auto model = in.get<std::uint8_t>("camera model");
  if (model > 2) in.fail("camera model " + std::to_string(model) + ", expected 0 to 2");
  camera.model = static_cast<DistortionModel>(model);
  const std::size_t coefficients = in.count("distortion coefficients");
  for (std::size_t k = 0; k < coefficients; ++k) camera.distortion.push_back(finite(in, "distortion"));
  const std::string problem = camera.validate();
  if (!problem.empty()) in.fail("camera: " + problem);
  return camera;
}

NavState readState(ByteReader& in, const char* what) {
  NavState s;
  s.t = finite(in, what);
  s.T_W_I = readPose(in, what);
  s.v_W = finiteVector<Eigen::Vector3d>(in, what);
  s.bias_gyro = finiteVector<Eigen::Vector3d>(in, what);
  s.bias_accel = finiteVector<Eigen::Vector3d>(in, what);
  return s;
}

DepthGrid readGrid(ByteReader& in) {
  DepthGrid grid;
  grid.stride = in.get<std::uint16_t>("depth grid");
  grid.offset = in.get<std::uint16_t>("depth grid");
  grid.cols = in.get<std::uint16_t>("depth grid");
  grid.rows = in.get<std::uint16_t>("depth grid");
  const std::size_t nodes = static_cast<std::size_t>(grid.cols) * static_cast<std::size_t>(grid.rows);
  if (nodes > in.left() / 2) in.fail("depth grid of " + std::to_string(nodes) + " nodes does not fit into the file");
  if (nodes > 0 && grid.stride == 0) in.fail("depth grid without a stride");
  grid.z.resize(nodes);
  for (float& z : grid.z) z = static_cast<float>(in.get<std::uint16_t>("depth grid") * map_file::kDepthUnit);
  return grid;
}

Ring readRing(ByteReader& in) {
  Ring ring;
  const std::size_t points = in.count("polygon points");
  for (std::size_t k = 0; k < points; ++k) ring.push_back(finiteVector<Eigen::Vector3d>(in, "polygon point"));
  return ring;
}

void readPlane(ByteReader& in, Map& map) {
  PlaneEstimate e;
  e.id = in.get<std::uint64_t>("plane id");
  if (map.hasPlane(e.id)) in.fail("plane " + std::to_string(e.id) + " twice");
  const auto kind = in.get<std::uint8_t>("plane kind");
  if (kind > 2) in.fail("plane kind " + std::to_string(kind) + ", expected 0 to 2");
  e.kind = static_cast<PlaneKind>(kind);
  const bool optimised = flag(in, "plane flag");
  e.plane.n = finiteVector<Eigen::Vector3d>(in, "plane normal");
  if (std::abs(e.plane.n.norm() - 1.0) > map_limits::kRounding) in.fail("plane normal is not a unit vector");
  e.plane.d = finite(in, "plane distance");
  e.area = finite(in, "plane area");
  e.keyframes = in.get<std::uint32_t>("plane keyframes");
  const std::size_t polygons = in.count("polygons");
  for (std::size_t k = 0; k < polygons; ++k) {
    PlanePolygon polygon;
    polygon.outer = readRing(in);
    const std::size_t holes = in.count("holes");
    for (std::size_t h = 0; h < holes; ++h) polygon.holes.push_back(readRing(in));
    e.polygons.push_back(std::move(polygon));
  }
  map.setPlane(e);
  if (optimised) map.setPlaneParameters(e.id, e.plane);
}

PlaneObservation readObservation(ByteReader& in, KeyframeId keyframe) {
  PlaneObservation o;
  o.keyframe = keyframe;
  o.plane = in.get<std::uint64_t>("plane observation");
  for (int r = 0; r < 4; ++r)
    for (int c = r; c < 4; ++c) o.G(r, c) = o.G(c, r) = finite(in, "plane observation");
  o.weight_scale = finite(in, "plane observation");
  const std::size_t points = in.count("plane points");
  for (std::size_t k = 0; k < points; ++k) {
    PlaneSample p;
    p.p_C = in.vector<Eigen::Vector3f>("plane point");
    p.sigma = in.get<float>("plane point");
    o.points.push_back(p);
  }
  return o;
}

Feature readFeature(ByteReader& in, Version version, LandmarkId first_landmark, std::uint32_t* landmark) {
  Feature f;
  f.pixel = in.vector<Eigen::Vector2f>("feature");
  f.xy = in.vector<Eigen::Vector2f>("feature");
  if (version >= Version::kPixelSigma) f.pixel_sigma = in.get<float>("feature");
  f.depth = in.get<float>("feature");
  f.depth_sigma = in.get<float>("feature");
  f.angle = in.get<float>("feature");
  if (!std::isfinite(f.angle)) in.fail("feature angle is not finite");
  f.octave = in.get<std::uint8_t>("feature");
  const int track = version < Version::kTracks ? flag(in, "feature flag") : in.get<std::uint8_t>("feature track");
  in.bytes(f.descriptor.data(), f.descriptor.size(), "feature");
  *landmark = in.get<std::uint32_t>("feature");
  if (track > 0 && *landmark != map_file::kNoIndex) f.id = first_landmark + *landmark + track * kLoadedLandmarks;
  return f;
}

RelativeMotion readMotion(ByteReader& in) {
  RelativeMotion motion;
  motion.T_a_b = readPose(in, "odometry's motion");
  for (int r = 0; r < 6; ++r)
    for (int c = r; c < 6; ++c) motion.covariance(r, c) = motion.covariance(c, r) = finite(in, "odometry's covariance");
  if (!motion.known() || !motion.isUsable()) in.fail("the covariance of the odometry's motion is none");
  return motion;
}

// Observations with the index of their landmark, in the order of the file.
using Sightings = std::vector<std::pair<std::uint32_t, MapObservation>>;

// Reads one keyframe into the map; its observations into `seen`.
void readKeyframe(ByteReader& in, Version version, LandmarkId first_landmark, const ImuNoise& noise, Map& map,
                  Sightings& seen) {
  auto data = std::make_shared<Keyframe>();
  TrackedFrame& frame = data->frame;
  data->id = in.get<std::uint64_t>("keyframe id");
  if (data->id <= map.newestKeyframe()) in.fail("keyframe " + std::to_string(data->id) + " is out of order");
  if (!map.empty() && data->id - map.keyframes().begin()->first > map_limits::kWidestIds)
    in.fail("keyframe " + std::to_string(data->id) + " is too far from the first, " +
            std::to_string(map.keyframes().begin()->first));
  frame.t = finite(in, "keyframe stamp");
  const auto epoch = in.get<std::uint32_t>("keyframe epoch");
  if (epoch > map.keyframes().size()) in.fail("epoch " + std::to_string(epoch) + " is out of order");
  frame.epoch = kLoadedEpochs + epoch;
  const auto status = in.get<std::uint8_t>("keyframe status");
  if (status > 4) in.fail("tracking state " + std::to_string(status) + ", expected 0 to 4");
  frame.status.state = static_cast<TrackingState>(status);
  const NavState state = readState(in, "keyframe state");
  frame.state = readState(in, "odometry state");
  frame.T_I_C = readPose(in, "extrinsics");
  frame.time_offset = finite(in, "time offset");
  const bool loop_keyframe = flag(in, "loop flag");
  frame.zero_velocity = flag(in, "standstill flag");
  const auto previous = in.get<std::uint64_t>("previous keyframe");
  frame.keyframe = data->id;
  data->previous = previous;
  const std::size_t features = in.count("features");
  for (std::uint32_t k = 0; k < features; ++k) {
    std::uint32_t landmark;
    frame.features.push_back(readFeature(in, version, first_landmark, &landmark));
    if (landmark != map_file::kNoIndex) seen.push_back({landmark, {data->id, k}});
  }
  frame.depth_grid = readGrid(in);
  if (version >= Version::kMotion && flag(in, "motion flag")) data->motion = readMotion(in);
  ImuNoiseScale& scale = data->imu_noise_scale;
  if (version >= Version::kNoiseScale) scale.density = finite(in, "scale of the IMU's noise");
  if (version >= Version::kWalkScales) {
    scale.gyro_walk = finite(in, "scale of the gyroscope's random walk");
    scale.accel_walk = finite(in, "scale of the accelerometer's random walk");
  }
  std::vector<ImuSample> imu;
  const std::size_t samples = in.count("IMU samples");
  for (std::size_t k = 0; k < samples; ++k) {
    ImuSample sample;
    sample.t = finite(in, "IMU sample");
    sample.gyro = finiteVector<Eigen::Vector3d>(in, "IMU sample");
    sample.accel = finiteVector<Eigen::Vector3d>(in, "IMU sample");
    imu.push_back(sample);
  }
  map.restoreKeyframe(data, state, previous, imu, noise).loop_keyframe = loop_keyframe;
  const std::size_t planes = in.count("plane observations");
  for (std::size_t k = 0; k < planes; ++k) {
    const PlaneObservation observation = readObservation(in, data->id);
    if (!map.setPlaneObservation(observation))
      in.fail("observation of plane " + std::to_string(observation.plane) + " is unusable");
  }
}

void readLandmark(ByteReader& in, LandmarkId id, std::vector<MapObservation>&& seen, Map& map) {
  MapLandmark landmark;
  landmark.id = id;
  landmark.p_W = finiteVector<Eigen::Vector3d>(in, "landmark position");
  landmark.plane = in.get<std::uint64_t>("landmark plane");
  landmark.visible = in.get<std::uint32_t>("landmark");
  landmark.found = in.get<std::uint32_t>("landmark");
  in.bytes(landmark.descriptor.data(), landmark.descriptor.size(), "landmark");
  landmark.observations = std::move(seen);
  map.restoreLandmark(landmark);
}

void readPayload(ByteReader& in, Version version, LandmarkId first_landmark, const ImuNoise& noise, StoredMap* stored) {
  Map& map = stored->map;
  stored->vocabulary_id = in.get<std::uint64_t>("vocabulary id");
  if (version >= Version::kCamera && flag(in, "camera flag")) stored->camera = readCamera(in);
  const std::size_t planes = in.count("planes");
  for (std::size_t k = 0; k < planes; ++k) readPlane(in, map);
  const std::size_t keyframes = in.count("keyframes");
  Sightings seen;
  for (std::size_t k = 0; k < keyframes; ++k) readKeyframe(in, version, first_landmark, noise, map, seen);
  const std::size_t landmarks = in.count("landmarks");
  std::stable_sort(seen.begin(), seen.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  if (!seen.empty() && seen.back().first >= landmarks)
    in.fail("keyframes see more landmarks than the " + std::to_string(landmarks) + " stored");
  auto next = seen.begin();
  for (std::uint32_t k = 0; k < landmarks; ++k) {
    std::vector<MapObservation> views;
    for (; next != seen.end() && next->first == k; ++next) views.push_back(next->second);
    readLandmark(in, first_landmark + k, std::move(views), map);
  }
  const std::size_t loops = in.count("loops");
  for (std::size_t k = 0; k < loops; ++k) {
    const auto query = in.get<std::uint64_t>("loop"), match = in.get<std::uint64_t>("loop");
    if (!map.hasKeyframe(query) || !map.hasKeyframe(match)) in.fail("a loop joins keyframes that are not there");
    stored->loops.emplace_back(query, match);
  }
  if (in.left() != 0) in.fail(std::to_string(in.left()) + " bytes too many");
  map.takeChanges();
}

}  // namespace

StoredMap parseMap(const std::uint8_t* data, std::size_t size, const std::string& source, const ImuNoise& noise,
                   LandmarkId first_landmark) {
  ByteReader in(data, size, source);
  const map_file::Header expected;
  map_file::Header header;
  if (size < sizeof header + 4) in.fail("too short for a map file (" + std::to_string(size) + " bytes)");
  in.bytes(&header, sizeof header, "header");
  if (std::memcmp(header.magic, expected.magic, sizeof header.magic) != 0)
    in.fail("not a map file, expected it to start with VIPMAP");
  const auto number = [](Version version) { return std::to_string(static_cast<std::uint32_t>(version)); };
  if (header.version < Version::kFirst || header.version > expected.version)
    in.fail("map file version " + number(header.version) + ", expected " + number(Version::kFirst) + " to " +
            number(expected.version));
  if (header.reserved != 0) in.fail("reserved field is not 0");
  if (header.payload_bytes != in.left() - 4)
    in.fail("payload of " + std::to_string(in.left() - 4) + " bytes, expected " + std::to_string(header.payload_bytes) +
            " (truncated?)");
  std::uint32_t crc;
  std::memcpy(&crc, data + size - 4, 4);
  if (crc32(data, size - 4) != crc) in.fail("checksum is wrong, the file is damaged");

  ByteReader payload(data + sizeof header, static_cast<std::size_t>(header.payload_bytes), source);
  StoredMap stored;
  try {
    readPayload(payload, header.version, first_landmark, noise, &stored);
  } catch (const MapError& e) {
    payload.fail(e.what());
  }
  return stored;
}

StoredMap loadMapFile(const std::string& path, const ImuNoise& noise, LandmarkId first_landmark) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  if (!in) throw std::runtime_error(path + ": cannot be opened, expected a map file");
  // A folder can be opened, but its reported size is meaningless.
  if (std::filesystem::is_directory(path)) throw std::runtime_error(path + ": is a folder, expected a map file");
  std::string bytes(static_cast<std::size_t>(std::max<std::streamoff>(0, in.tellg())), '\0');
  in.seekg(0);
  in.read(&bytes[0], static_cast<std::streamsize>(bytes.size()));
  if (!in) throw std::runtime_error(path + ": cannot be read");
  return parseMap(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), path, noise, first_landmark);
}

}  // namespace vip_slam
