// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_phone/wire/record.h"

#include <cmath>

namespace vip_slam::phone {
namespace {

constexpr double kGravity = 9.80665;  // m/s^2 per g, CoreMotion's unit

Eigen::Vector3d vectorAt(const Bytes& bytes, std::size_t at, const char* what) {
  const Eigen::Vector3d v(bytes.little<float>(at), bytes.little<float>(at + 4), bytes.little<float>(at + 8));
  if (!v.allFinite()) throw WireError(std::string("record: ") + what + " is not a number");
  return v;
}

/// The protocol tells the unit (microseconds) and not the type: an integer read as a float, or the other way round, is
/// never plausible.
double exposureAt(const Bytes& bytes, std::size_t at) {
  const auto plausible = [](double us) { return us >= 5 && us <= 500000; };
  const double integer = bytes.little<std::uint32_t>(at), real = bytes.little<float>(at);
  return plausible(integer) ? 1e-6 * integer : plausible(real) ? 1e-6 * real : 0;
}

IntrinsicsRecord intrinsics(const Bytes& bytes) {
  IntrinsicsRecord out;
  CameraIntrinsics& camera = out.camera;
  camera.fx = bytes.little<float>(24);
  camera.fy = bytes.little<float>(28);
  camera.cx = bytes.little<float>(32);
  camera.cy = bytes.little<float>(36);
  const double width = bytes.little<float>(40), height = bytes.little<float>(44);
  if (!(width >= 16 && width <= 8192 && height >= 16 && height <= 8192))
    throw WireError("record: intrinsics of an image of " + std::to_string(width) + " x " + std::to_string(height));
  camera.width = static_cast<int>(std::lround(width));
  camera.height = static_cast<int>(std::lround(height));
  const std::string wrong = camera.validate();
  if (!wrong.empty()) throw WireError("record: intrinsics: " + wrong);
  out.exposure = exposureAt(bytes, 60);
  out.snapshot = bytes[1] & 1;
  return out;
}

PoseRecord pose(const Bytes& bytes) {
  PoseRecord out;
  const Eigen::Vector3d p = vectorAt(bytes, 24, "position");
  Eigen::Quaterniond q(bytes.little<float>(60), bytes.little<float>(48), bytes.little<float>(52),
                       bytes.little<float>(56));
  if (!(std::abs(q.norm() - 1) < 0.01)) throw WireError("record: the pose's quaternion is not of length 1");
  q.normalize();
  // ARKit's camera looks along -z with y up; optical axes look along z with y down.
  const Eigen::Quaterniond half_turn(0, 1, 0, 0);
  out.T_world_cam = SE3(q * half_turn, p);
  const float tracking = bytes.little<float>(36);
  out.tracking = tracking == 2.f ? 2 : tracking == 1.f ? 1 : 0;
  out.moved = bytes[1] != 0;
  return out;
}

FormatRecord format(const Bytes& bytes) {
  FormatRecord out;
  out.width = bytes.little<std::uint16_t>(28);
  out.height = bytes.little<std::uint16_t>(30);
  out.rate = bytes.little<float>(32);
  const double readout = bytes.little<float>(36);
  if (readout > 0 && readout < 0.1) out.readout = readout;  // NaN: not known
  out.arkit = bytes[41] == 1;
  return out;
}

}  // namespace

Record parseRecord(const Bytes& bytes) {
  if (bytes.size() != kRecordBytes)
    throw WireError("record of " + std::to_string(bytes.size()) + " bytes, expected " + std::to_string(kRecordBytes));
  Record record;
  record.sequence = bytes.little<std::uint16_t>(2);
  record.host_time = bytes.little<double>(8);
  record.unix_time = bytes.little<double>(16);
  // Beyond 2^40 s a double is no longer good to a millisecond, and no clock gets there.
  if (!(std::abs(record.host_time) < 1e12 && std::abs(record.unix_time) < 1e12))
    throw WireError("record: a stamp is not a time");
  const auto accel = [&] { return Eigen::Vector3d(-kGravity * vectorAt(bytes, 36, "acceleration")); };
  switch (bytes[0]) {
    case 1:
      record.what = ImuRecord{vectorAt(bytes, 24, "rate of turn"), accel()};
      break;
    case 2:
      record.what = ImuRecord{vectorAt(bytes, 24, "rate of turn"), {}};
      break;
    case 3:
      record.what = ImuRecord{{}, accel()};
      break;
    case 5:
      record.what = intrinsics(bytes);
      break;
    case 9:
      record.what = pose(bytes);
      break;
    case 11:
      record.what = format(bytes);
      break;
    default:
      break;
  }
  return record;
}

}  // namespace vip_slam::phone
