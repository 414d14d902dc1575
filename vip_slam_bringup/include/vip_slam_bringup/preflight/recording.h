// SPDX-License-Identifier: BSD-3-Clause
// Data of a sensor from a bag or live topics, reduced to what the checks need. It depends on neither bag nor master, so
// that the checks can be tested on synthetic recordings.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <geometry_msgs/TransformStamped.h>

#include "vip_slam_core/geometry/se3.h"
#include "vip_slam_core/imu/gyro_range.h"
#include "vip_slam_core/sensor/sensor_config.h"
#include "vip_slam_ros/one_frame.h"
#include "vip_slam_ros/stream_time/stream_time.h"

namespace vip_slam {

struct StreamRecord {
  std::vector<double> stamps;    ///< in order of arrival, seconds; of header stamps what StreamTime makes of them
  std::vector<double> arrivals;  ///< record or receive times, seconds
  std::string type;              ///< ROS type of the messages, "sensor_msgs/Image"
  std::set<std::string> encodings;
  std::set<std::pair<int, int>> sizes;  ///< (width, height)
  std::string frame_id;                 ///< of the first message
  OneFrame one_frame;                   ///< what has another frame_id is in no other member
  std::size_t ahead = 0;                ///< messages left out, stamped later than the next
  std::size_t unusable = 0;             ///< messages that could not be decoded
  std::string unusable_reason;
  std::size_t decoded = 0;   ///< messages whose pixels were decoded
  std::size_t repeated = 0;  ///< of these, with the pixels of the one before while the sensor rotates
};

struct StampedVector {
  double t = 0;
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
};

/// A corner seen in two successive images, in pixels: whatever the camera is taken to be.
struct PixelTrack {
  Eigen::Vector2f from, to;
  float z = 0;  ///< metres, depth at its pixel of the first image; 0: none
};
struct PixelStep {
  double t0 = 0, t1 = 0;
  std::vector<PixelTrack> tracks;
};

/// The same with a camera.
struct CornerTrack {
  Eigen::Vector3f point;   ///< metres, in the colour camera when its row of the first image was read
  Eigen::Vector2f image;   ///< normalised coordinates in the second image
  float row_from, row_to;  ///< its rows, -0.5 at the upper border of the image, 0.5 at the lower
};

/// Motion of the camera between two images.
struct RotationStep {
  double t0 = 0, t1 = 0;
  Eigen::Vector3d rate_C = Eigen::Vector3d::Zero();  ///< mean rotation rate, rad/s, in the colour optical frame
  std::vector<CornerTrack> tracks;                   ///< corners with depth
  std::optional<SE3> T_now_before;                   ///< by these corners; empty: too few agree
};

/// The unit of depth is set anew.
struct DepthUnitChange {
  double t = 0;       ///< of the first image in the new unit, seconds
  double factor = 1;  ///< its readings over those in the unit before
};

/// What the colour camera might be instead of what is taken for it.
struct CameraReading {
  CameraIntrinsics camera;
  std::string what;  ///< "its coefficients are those of equidistant"
};

struct DepthSample {
  double valid = 0;      ///< share of pixels with a value
  double usable = 0;     ///< share of pixels within the sensor file's range
  double median = 0;     ///< metres, of those with a value
  double spread = 0;     ///< metres, farthest minus nearest of those
  bool swapped = false;  ///< neighbours are far more alike with the two bytes of each value changed over
};

struct BrightnessSample {
  double mean = 0;    ///< grey levels
  double spread = 0;  ///< one sigma of the pixels, grey levels
};

/// Strength of the image's edges at depth edges, grey levels, one mean per image (depth_edges.h).
struct DepthEdgeRecord {
  std::size_t edges = 0;                          ///< pixels in all
  std::vector<double> as_colour, as_undistorted;  ///< taking depth pixels for those of the image; of one without lens
};

/// Where the image's edges lie beside those of depth (edge_shift.h).
struct EdgeShift {
  double t = 0;                                     ///< of the first image, seconds
  int images = 0;                                   ///< 0: nothing is known
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();  ///< right and down, px, that the two fit best with
  double sigmas = 0;                                ///< height of that fit above those of all shifts
  double unmoved = 1;                               ///< fit without a shift, as a share of the best
};
struct EdgeShiftRecord {
  std::vector<EdgeShift> seconds;  ///< one a second
  EdgeShift all, near, far;        ///< of all edges, of the nearer half and of the farther half
  double nearer = 1;               ///< inverse depth of the nearer half over that of the farther
};

struct Recording {
  SensorConfig sensor;  ///< the expected configuration
  bool live = false;
  std::map<std::string, std::string> topics;  ///< all existing topics: topic -> type
  StreamRecord color, depth, color_info, depth_info, imu, gyro, accel;
  std::vector<ClockStep> clock_steps;
  std::vector<double> restarts;  ///< s by which time ran back, where it began anew; stamps go on from before
  CameraIntrinsics color_camera, depth_camera;             ///< from camera_info; width 0: none seen
  double color_focal_from = 0, color_focal_to = 0;         ///< least and largest fx of all camera_info, px
  std::string color_camera_error, depth_camera_error;      ///< why camera_info is unusable
  std::string color_camera_note;                           ///< what is unusual in it
  std::vector<StampedVector> gyro_samples, accel_samples;  ///< united and split streams alike
  GyroRange gyro_range;
  std::vector<PixelStep> pixel_steps;
  std::vector<RotationStep> rotations;         ///< of pixel_steps, with the camera as configured
  std::vector<CameraReading> camera_readings;  ///< others of the same camera_info or sensor file
  std::vector<DepthSample> depths;
  double missing_reading = 0;                       ///< metres, written instead of "no reading"; 0: none
  std::vector<DepthUnitChange> depth_unit_changes;  ///< depth is in the first unit throughout, but for `depths`
  DepthEdgeRecord depth_edges;                      ///< of registered depth
  EdgeShiftRecord edge_shifts;                      ///< the same
  std::string gray_note;                            ///< of 16-bit grey that does not fill 16 bits
  std::vector<BrightnessSample> brightness;         ///< of some colour images
  std::vector<geometry_msgs::TransformStamped> tf;  ///< newest transform of each edge
};

}  // namespace vip_slam
