// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_ros/plane_conversions.h"

#include <stdexcept>

#include "vip_slam_ros/geometry_conversions.h"

namespace vip_slam {
namespace {

vip_slam_msgs::Ring toRingMsg(const Ring& ring) {
  vip_slam_msgs::Ring msg;
  msg.points.reserve(ring.size());
  for (const auto& p : ring) msg.points.push_back(toPointMsg(p));
  return msg;
}

Ring fromRingMsg(const vip_slam_msgs::Ring& msg) {
  Ring ring;
  ring.reserve(msg.points.size());
  for (const auto& p : msg.points) ring.push_back(fromMsg(p));
  return ring;
}

}  // namespace

vip_slam_msgs::Plane toMsg(const PlaneEstimate& plane) {
  vip_slam_msgs::Plane msg;
  msg.id = plane.id;
  msg.kind = static_cast<std::uint8_t>(plane.kind);
  msg.normal = toVectorMsg(plane.plane.n);
  msg.distance = plane.plane.d;
  for (const auto& polygon : plane.polygons) {
    vip_slam_msgs::PlanePolygon piece;
    piece.outer = toRingMsg(polygon.outer);
    for (const auto& hole : polygon.holes) piece.holes.push_back(toRingMsg(hole));
    msg.polygons.push_back(std::move(piece));
  }
  msg.area = plane.area;
  msg.keyframes = plane.keyframes;
  return msg;
}

PlaneEstimate fromMsg(const vip_slam_msgs::Plane& msg) {
  PlaneEstimate plane;
  plane.id = msg.id;
  plane.kind = static_cast<PlaneKind>(msg.kind);
  // Assigned rather than normalised again, so that a round trip is bit-exact.
  plane.plane.n = fromMsg(msg.normal);
  plane.plane.d = msg.distance;
  for (const auto& piece : msg.polygons) {
    PlanePolygon polygon;
    polygon.outer = fromRingMsg(piece.outer);
    for (const auto& hole : piece.holes) polygon.holes.push_back(fromRingMsg(hole));
    plane.polygons.push_back(std::move(polygon));
  }
  plane.area = msg.area;
  plane.keyframes = msg.keyframes;
  return plane;
}

vip_slam_msgs::PlaneHost toMsg(const PlaneHost& host) {
  vip_slam_msgs::PlaneHost msg;
  msg.keyframe = host.keyframe;
  msg.epoch = host.epoch;
  msg.map_camera = toPoseMsg(host.T_map_C);
  return msg;
}

std::vector<StoredPlane> fromMsg(const std::vector<vip_slam_msgs::Plane>& planes,
                                 const std::vector<vip_slam_msgs::PlaneHost>& hosts) {
  if (hosts.size() != planes.size()) {
    throw std::invalid_argument("Control.hosts: " + std::to_string(hosts.size()) + ", expected one for each of the " +
                                std::to_string(planes.size()) + " Control.planes");
  }
  std::vector<StoredPlane> result;
  result.reserve(planes.size());
  for (std::size_t i = 0; i < planes.size(); ++i) {
    result.push_back({fromMsg(planes[i]), {hosts[i].keyframe, hosts[i].epoch, fromMsg(hosts[i].map_camera)}});
  }
  return result;
}

vip_slam_msgs::PlaneObservation toMsg(const PlaneObservation& observation) {
  vip_slam_msgs::PlaneObservation msg;
  msg.keyframe = observation.keyframe;
  msg.plane = observation.plane;
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(msg.g.data()) = observation.G;
  msg.weight_scale = observation.weight_scale;
  msg.depth_correction = observation.camera_correction.offset;
  msg.depth_curve = observation.camera_correction.curve.added;
  msg.depth_scale = observation.camera_correction.scale;
  msg.bearing_correction = toArray(observation.camera_correction.bearing);
  msg.depth_shift = toArray(observation.camera_correction.shift);
  msg.points.reserve(4 * observation.points.size());
  for (const auto& point : observation.points) {
    msg.points.insert(msg.points.end(), {point.p_C.x(), point.p_C.y(), point.p_C.z(), point.sigma});
  }
  return msg;
}

PlaneObservation fromMsg(const vip_slam_msgs::PlaneObservation& msg) {
  if (msg.points.size() % 4 != 0) {
    throw std::invalid_argument("plane " + std::to_string(msg.plane) + ", seen by keyframe " +
                                std::to_string(msg.keyframe) + ": " + std::to_string(msg.points.size()) +
                                " values of points, expected four per point");
  }
  PlaneObservation observation;
  observation.keyframe = msg.keyframe;
  observation.plane = msg.plane;
  observation.G = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(msg.g.data());
  observation.weight_scale = msg.weight_scale;
  observation.camera_correction = {msg.depth_correction,
                                   {msg.depth_curve},
                                   bearingFromArray(msg.bearing_correction),
                                   shiftFromArray(msg.depth_shift),
                                   msg.depth_scale};
  observation.points.reserve(msg.points.size() / 4);
  for (std::size_t i = 0; i < msg.points.size(); i += 4) {
    observation.points.push_back({{msg.points[i], msg.points[i + 1], msg.points[i + 2]}, msg.points[i + 3]});
  }
  return observation;
}

vip_slam_msgs::PlaneUpdate toMsg(const PlaneUpdate& update, const std::string& map_frame) {
  vip_slam_msgs::PlaneUpdate msg;
  msg.header.stamp = toStamp(update.t);
  msg.header.frame_id = map_frame;
  msg.revision = update.revision;
  for (const auto& merge : update.merges) {
    vip_slam_msgs::PlaneMerge m;
    m.from = merge.from;
    m.into = merge.into;
    msg.merges.push_back(m);
  }
  msg.removed = update.removed;
  for (const auto& plane : update.planes) msg.planes.push_back(toMsg(plane));
  for (const auto& observation : update.observations) msg.observations.push_back(toMsg(observation));
  for (const auto& [landmark, plane] : update.associated) {
    vip_slam_msgs::LandmarkPlane pair;
    pair.landmark = landmark;
    pair.plane = plane;
    msg.associated.push_back(pair);
  }
  msg.dissociated = update.dissociated;
  return msg;
}

PlaneUpdate fromMsg(const vip_slam_msgs::PlaneUpdate& msg, std::vector<std::string>* refused) {
  PlaneUpdate update;
  update.t = msg.header.stamp.toSec();
  update.revision = msg.revision;
  for (const auto& merge : msg.merges) update.merges.push_back({merge.from, merge.into});
  update.removed = msg.removed;
  update.planes.reserve(msg.planes.size());
  for (const auto& plane : msg.planes) update.planes.push_back(fromMsg(plane));
  update.observations.reserve(msg.observations.size());
  for (const auto& observation : msg.observations) {
    try {
      update.observations.push_back(fromMsg(observation));
    } catch (const std::invalid_argument& error) {
      refused->push_back(error.what());
    }
  }
  for (const auto& pair : msg.associated) update.associated.emplace_back(pair.landmark, pair.plane);
  update.dissociated = msg.dissociated;
  return update;
}

vip_slam_msgs::PlaneMap toPlaneMapMsg(const std::vector<PlaneEstimate>& planes, double t, std::uint64_t revision,
                                      const std::string& map_frame) {
  vip_slam_msgs::PlaneMap msg;
  msg.header.stamp = toStamp(t);
  msg.header.frame_id = map_frame;
  msg.revision = revision;
  for (const auto& plane : planes) msg.planes.push_back(toMsg(plane));
  return msg;
}

}  // namespace vip_slam
