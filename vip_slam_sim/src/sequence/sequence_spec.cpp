// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/sequence/sequence_spec.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

#include <yaml-cpp/yaml.h>

#include "vip_slam_sim/scene/scene.h"
#include "vip_slam_sim/sequence/camera_model_error.h"

namespace vip_slam {

void MotionOptions::visit(OptionVisitor& v) {
  v.field("type", type, {"path", "orbit", "rotate", "still", "file"}, "kind of motion");
  v.field("waypoints", waypoints, {}, "path: 'x,y[,z]; ...', with 'turn DEGREES' and 'pause SECONDS' in between, m");
  v.field("vibration", vibration, {"none", "rotors", "hand"},
          "fast shake of body, camera and IMU, as measured on a drone and a phone");
  v.field("style", style, {"handheld", "drone", "smooth"}, "what shakes the camera");
  v.field("file", file, {}, "file: TUM or EuRoC poses of the body");
  v.field("duration", duration, 0, 3600, "length, s; 0: as long as the path or file");
  v.field("hold", hold, 0, 600, "standing still at the start, s");
  v.field("start_at", start_at, 0, 600, "cut off that much of the start (a moving start), s");
  v.field("speed", speed, 0.01, 5, "cruising speed (path), peak speed (orbit), m/s");
  v.field("height", height, 0.2, 10, "camera height of waypoints without z, m");
  v.field("max_rate", max_rate, 0.01, 6, "orbit, rotate: peak turning rate, rad/s");
  v.field("yaw_swing", yaw_swing, 0, 90, "path: looking left and right, amplitude, deg");
  v.field("pitch", pitch, -80, 80, "mean pitch of the camera, up positive, deg");
  v.field("turn_rate", turn_rate, 5, 180, "path: rate of 'turn', deg/s");
  v.field("x", x, -1000, 1000, "middle of orbit; place of rotate and still; offset of file, m");
  v.field("y", y, -1000, 1000, "see x");
  v.field("z", z, -1000, 1000, "see x");
  v.field("yaw", yaw, -360, 360, "heading at the start of orbit, rotate, still; turn of file, deg");
  v.field("file_roll", file_roll, -360, 360,
          "file: turns the body about its z axis; 90 for EuRoC, whose x axis points up while ours points right, deg");
  v.field("extent_x", extent_x, 0, 50, "orbit: half extent, m");
  v.field("extent_y", extent_y, 0, 50, "orbit: half extent, m");
  v.field("extent_z", extent_z, 0, 10, "orbit: half extent, m");
  v.field("check_collisions", check_collisions, "refuse a motion that touches the scene");
  v.field("clearance", clearance, 0.0, 2, "least distance of the camera from everything, m");
}

void CameraOptions::visit(OptionVisitor& v) {
  v.field("width", width, 64, 4096, "px");
  v.field("height", height, 48, 4096, "px");
  v.field("fx", fx, 10, 10000, "px");
  v.field("fy", fy, 10, 10000, "px");
  v.field("cx", cx, 0, 4096, "px");
  v.field("cy", cy, 0, 4096, "px");
  v.field("model", model, {"none", "radtan", "equidistant"}, "distortion model");
  v.field("k1", k1, -2, 2, "distortion");
  v.field("k2", k2, -2, 2, "distortion");
  v.field("p1", p1, -1, 1, "tangential distortion (radtan)");
  v.field("p2", p2, -1, 1, "tangential distortion (radtan)");
  v.field("k3", k3, -2, 2, "distortion");
  v.field("k4", k4, -2, 2, "distortion (equidistant)");
  v.field("rate", rate, 0.5, 120, "images per second");
  v.field("model_error", model_error, 0, 10,
          "how far the true camera is from the stated one, root mean square over the image, px");
}

CameraIntrinsics CameraOptions::intrinsics() const {
  CameraIntrinsics c;
  c.width = width;
  c.height = height;
  c.fx = fx;
  c.fy = fy;
  c.cx = cx;
  c.cy = cy;
  c.model = distortionModelFromName(model);
  if (c.model == DistortionModel::kRadTan) c.distortion = {k1, k2, p1, p2, k3};
  if (c.model == DistortionModel::kEquidistant) c.distortion = {k1, k2, k3, k4};
  return c;
}

void DepthOptions::visit(OptionVisitor& v) {
  v.field("model", model, {"proportional", "structured_light", "stereo", "tof"},
          "label of the noise, for the sensor file");
  v.field("a", a, 0, 1, "sigma = a + b z + c z^2, m");
  v.field("b", b, 0, 1, "see a");
  v.field("c", c, 0, 1, "see a, 1/m");
  v.field("min_range", min_range, 0, 10, "nearer readings are invalid, m");
  v.field("max_range", max_range, 0.5, 100, "farther readings are invalid, m");
  v.field("dropout", dropout, 0, 0.9, "share of readings lost at random, in small clumps");
  v.field("edge_hole", edge_hole, 0, 1, "chance that a pixel beside a depth edge is lost or flies between");
  v.field("grazing_limit", grazing_limit, 0, 1, "readings fade out below this cosine of ray and normal");
  v.field("dark_limit", dark_limit, 0, 1, "readings fade out below this brightness");
  v.field("bias_floor", bias_floor, 0, 0.1, "stated in the sensor file: least error that a surface's pixels share, m");
  v.field("bias_amplitude", bias_amplitude, 0, 0.1, "cyclic distance error (ToF wiggling), m");
  v.field("white", white, 0, 10, "the noise that pixels do not share, in sigmas");
  v.field("scale", scale, 0.5, 2, "readings over true depth");
  v.field("offset", offset, -1, 1, "added to readings, m");
  v.field("surface_error", surface_error, 0, 20,
          "error that a surface has as a whole in an image, in sigmas; it grows with incidence");
  v.field("warp", warp, 0, 20, "error that changes over the image and with time, in sigmas");
  v.field("fixed_warp", fixed_warp, 0, 20, "error that changes over the image and stays, in sigmas");
  v.field("shared_px", shared_px, 2, 10000, "warps: correlation falls to 1/e over so many px");
  v.field("shared_time", shared_time, 0.01, 1000, "surface_error, warp: correlation falls to 1/e within, s");
  v.field("disparity_step", disparity_step, 0, 4, "steps of the disparity behind the depth, px; 0: none");
  v.field("disparity_baseline", disparity_baseline, 0.005, 1, "between the two eyes, or eye and projector, m");
  v.field("fattening", fattening, 0, 20, "foreground grows over the background by up to so many px");
  v.field("coarse", coarse, 1, 8, "depth is measured at every so many px and blended in between");
  v.field("multipath", multipath, 0, 1, "time of flight: reflectance of surfaces by which light makes a detour");
  v.field("registered", registered, "depth pixels belong to the colour camera");
  v.field("baseline", baseline, 0, 0.2, "not registered: depth camera to the left of the colour camera, m");
  v.field("lag", lag, -0.05, 0.05, "depth is taken so much later than colour, by a global shutter, s");
}

void ImuOptions::visit(OptionVisitor& v) {
  v.field("rate", rate, 50, 2000, "Hz");
  v.field("gyro_noise_density", gyro_noise_density, 0, 1, "rad/s/sqrt(Hz)");
  v.field("gyro_random_walk", gyro_random_walk, 0, 1, "rad/s^2/sqrt(Hz)");
  v.field("accel_noise_density", accel_noise_density, 0, 1, "m/s^2/sqrt(Hz)");
  v.field("accel_random_walk", accel_random_walk, 0, 1, "m/s^3/sqrt(Hz)");
  v.field("stated_noise", stated_noise, 0.01, 100, "noise densities in the sensor file over the sensor's own");
  v.field("gyro_bias", gyro_bias, 0, 1, "initial bias per axis, one sigma, rad/s");
  v.field("accel_bias", accel_bias, 0, 5, "initial bias per axis, one sigma, m/s^2");
  v.field("scale_error", scale_error, 0, 0.2, "scale error per axis, one sigma");
  v.field("misalignment", misalignment, 0, 0.2, "what one axis measures of another, one sigma, rad");
  v.field("gyro_drift", gyro_drift, 0, 1, "bias that comes with warming up, per axis, one sigma, rad/s");
  v.field("accel_drift", accel_drift, 0, 5, "bias that comes with warming up, per axis, one sigma, m/s^2");
  v.field("warm_up", warm_up, 1, 10000, "time constant of warming up, s");
  v.field("g_sensitivity", g_sensitivity, 0, 0.1,
          "what the gyro measures of specific force, one sigma, rad/s per m/s^2");
  v.field("present", present, "false: no IMU, the body is the camera");
  v.field("time_offset", time_offset, -0.5, 0.5, "t_imu = t_image + time_offset, s");
}

void EffectOptions::visit(OptionVisitor& v) {
  v.field("auto_exposure", auto_exposure,
          "exposure follows the scene, late by a third of a second; exposure_time is the longest, gain and noise do "
          "the rest");
  v.field("exposure", exposure, 0.05, 20, "gain of the image at exposure_time");
  v.field("exposure_drift", exposure_drift, 0, 0.5, "slow change of gain, amplitude");
  v.field("exposure_jump", exposure_jump, 1, 10, "gain before over gain after a sudden change, or the other way");
  v.field("exposure_jump_interval", exposure_jump_interval, 0.05, 1000, "between sudden changes of gain, s");
  v.field("vignetting", vignetting, 0, 0.9, "darkening in the corners");
  v.field("read_noise", read_noise, 0, 30, "one sigma in black, grey levels");
  v.field("shot_noise", shot_noise, 0, 30, "one sigma added in white, grey levels");
  v.field("exposure_time", exposure_time, 0, 0.1, "s; sets motion blur");
  v.field("motion_blur", motion_blur, "blur along the optical flow");
  v.field("gloss", gloss, 0, 1, "how much of a polished surface's reflections the shiniest surfaces have");
  v.field("jpeg", jpeg, 0, 100, "quality of the JPEG that the image went through; 0: none");
  v.field("rolling_shutter", rolling_shutter, 0, 0.1, "time from first to last row, s; 0: global shutter");
}

void PasserOptions::visit(OptionVisitor& v) {
  v.field("count", count, 0, 20, "bodies that move before the camera");
  v.field("way", way, {"to_and_fro", "across"}, "how they move: all the time, or once across the view each interval");
  v.field("width", width, 0.1, 10, "m");
  v.field("height", height, 0.1, 10, "m");
  v.field("distance", distance, 0.4, 20, "from the camera, m");
  v.field("speed", speed, 0.01, 10, "largest speed, m/s");
  v.field("start", start, 0, 3600, "when the first appears, s");
  v.field("interval", interval, 0.5, 1000, "across: from one passage to the next, s");
}

void SequenceSpec::visit(OptionVisitor& v) {
  std::string scenes =
      "scene to fly through, or the file of a scanned room (.json; beside the sequence's file, or $NAME/... by a "
      "variable of the environment):";
  for (const std::string& known : sceneNames()) scenes += " " + known;
  v.field("scene", scene, {}, scenes);
  v.field("seed", seed, 0, 1000000, "of all noise");
  v.field("start_time", start_time, 0, 4e9, "stamp of the trajectory's start, s");
  v.group("motion", motion);
  v.group("camera", camera);
  v.group("depth", depth);
  v.group("imu", imu);
  v.group("effects", effects);
  v.group("passers", passers);
}

SE3 SequenceSpec::T_imu_cam() const {
  if (!imu.present) return SE3();
  return SE3(expQuaternion(Eigen::Vector3d(0.010, -0.018, 0.014)), Eigen::Vector3d(0.021, -0.008, 0.012));
}

CameraIntrinsics SequenceSpec::trueCamera() const {
  return CameraModelError(camera.model_error, seed).trueCamera(camera.intrinsics());
}

SensorConfig SequenceSpec::sensorConfig() const {
  SensorConfig s;
  s.name = "sim_" + name;
  s.topics.color = "/camera/color/image_raw";
  s.topics.color_info = "/camera/color/camera_info";
  s.topics.depth = depth.registered ? "/camera/aligned_depth_to_color/image_raw" : "/camera/depth/image_rect_raw";
  s.topics.depth_info = depth.registered ? "/camera/aligned_depth_to_color/camera_info" : "/camera/depth/camera_info";
  if (imu.present) s.topics.imu = "/camera/imu";
  s.depth_registered = depth.registered;
  s.color_rate = s.depth_rate = camera.rate;
  s.imu_rate = imu.rate;
  s.rolling_shutter = effects.rolling_shutter;
  s.depth_rolling_shutter = depth.separate() ? 0 : effects.rolling_shutter;
  s.intrinsics_from_camera_info = false;
  s.camera = camera.intrinsics();
  if (!depth.registered) {
    s.depth_camera = s.camera;
    s.depth_camera.model = DistortionModel::kNone;
    s.depth_camera.distortion.clear();
    s.T_color_depth = SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-depth.baseline, 0, 0));
  }
  s.T_imu_cam = T_imu_cam();
  s.imu_noise.gyro_noise_density = imu.stated_noise * imu.gyro_noise_density;
  s.imu_noise.gyro_random_walk = imu.gyro_random_walk;
  s.imu_noise.accel_noise_density = imu.stated_noise * imu.accel_noise_density;
  s.imu_noise.accel_random_walk = imu.accel_random_walk;
  s.imu_noise.gyro_correction_sigma = std::max({1e-3, imu.scale_error, imu.misalignment});
  s.depth_noise.type = depthSensorTypeFromName(depth.model);
  s.depth_noise.a = std::max(depth.a, 0.0005);  // at least the rounding to millimetres in 16UC1
  s.depth_noise.b = depth.b;
  s.depth_noise.c = depth.c;
  s.depth_noise.bias_floor = depth.bias_floor;
  s.depth_noise.min_range = depth.min_range;
  s.depth_noise.max_range = depth.max_range;
  s.time_offset = imu.time_offset;
  return s;
}

namespace {

YAML::Node loadYaml(const std::string& path) {
  if (!std::filesystem::exists(path)) throw std::runtime_error(path + ": no such file");
  try {
    return YAML::LoadFile(path);
  } catch (const YAML::Exception& e) {
    throw std::runtime_error(path + ": " + e.what());
  }
}

using Pairs = std::vector<std::pair<std::string, std::string>>;

void flatten(const YAML::Node& node, const std::string& prefix, const std::string& where, Pairs* out) {
  for (const auto& item : node) {
    const std::string key = prefix + item.first.as<std::string>();
    if (item.second.IsMap())
      flatten(item.second, key + "/", where, out);
    else if (item.second.IsScalar())
      out->emplace_back(key, item.second.Scalar());
    else
      throw std::runtime_error(where + ": " + key + ": expected one value");
  }
}

YAML::Node loadLibrary(const std::string& path) {
  const YAML::Node library = loadYaml(path);
  if (!library.IsMap() || !library["sequences"] || !library["sequences"].IsMap())
    throw std::runtime_error(path + ": sequences: expected a map of named sequences");
  return library;
}

/// Applies the sequences on which the node is based, then the node's own values, which therefore win.
void applySequence(const YAML::Node& library, const YAML::Node& node, const std::string& where, int depth,
                   SequenceSpec* spec) {
  if (!node.IsMap()) throw std::runtime_error(where + ": expected a map of keys");
  if (depth > 8) throw std::runtime_error(where + ": base: goes round in circles");
  YAML::Node own = YAML::Clone(node);
  if (own["base"]) {
    const auto base = own["base"].as<std::string>();
    const YAML::Node parent = library["sequences"][base];
    if (!parent) throw std::runtime_error(where + ": base: '" + base + "' is not a known sequence");
    applySequence(library, parent, where, depth + 1, spec);
    own.remove("base");
  }
  Pairs values;
  flatten(own, "", where, &values);
  try {
    setOptions(*spec, values);
  } catch (const std::invalid_argument& e) {
    throw std::runtime_error(where + ": " + e.what());
  }
}

/// A scene that is a file: relative to the folder of the sequence's file. `$NAME/` is filled in where the environment
/// has it, and stays otherwise: a library may name rooms that are not on this machine.
void resolveScene(const std::filesystem::path& file, const std::string& where, SequenceSpec* spec) {
  std::string& scene = spec->scene;
  if (std::filesystem::path(scene).extension() != ".json") {
    std::string known;
    for (const std::string& n : sceneNames()) {
      if (n == scene) return;
      known += ", " + n;
    }
    throw std::runtime_error(where + ": scene: '" + scene + "', expected the file of a scanned room (.json)" + known);
  }
  if (scene.front() == '$') {
    const std::size_t end = std::min(scene.find('/'), scene.size());
    if (const char* folder = std::getenv(scene.substr(1, end - 1).c_str())) scene = folder + scene.substr(end);
  } else if (std::filesystem::path(scene).is_relative()) {
    scene = (file.parent_path() / scene).lexically_normal().string();
  }
}

}  // namespace

std::vector<std::string> sequenceNames(const std::string& library) {
  std::vector<std::string> names;
  for (const auto& item : loadLibrary(library)["sequences"]) names.push_back(item.first.as<std::string>());
  return names;
}

SequenceSpec loadSequence(const std::string& name_or_file, const std::string& library) {
  const YAML::Node shipped = loadLibrary(library);
  SequenceSpec spec;
  const std::filesystem::path path(name_or_file);
  if (path.extension() == ".yaml" || path.extension() == ".yml") {
    applySequence(shipped, loadYaml(name_or_file), name_or_file, 0, &spec);
    resolveScene(path, name_or_file, &spec);
    spec.name = path.stem().string();
    return spec;
  }
  const YAML::Node node = shipped["sequences"][name_or_file];
  if (!node) {
    std::string known;
    for (const std::string& n : sequenceNames(library)) known += (known.empty() ? "" : ", ") + n;
    throw std::runtime_error("sequence '" + name_or_file + "' is not known, expected a .yaml file or one of: " + known);
  }
  applySequence(shipped, node, library + ": " + name_or_file, 0, &spec);
  resolveScene(library, name_or_file, &spec);
  spec.name = name_or_file;
  return spec;
}

}  // namespace vip_slam
