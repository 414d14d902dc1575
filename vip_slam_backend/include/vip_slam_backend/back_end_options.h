// SPDX-License-Identifier: BSD-3-Clause
// Options of the back end: name, default, range and meaning in one place.
#pragma once

#include <string>

#include "vip_slam_backend/loop/loop_options.h"
#include "vip_slam_core/util/options.h"

namespace vip_slam {

/// The paper's four systems (section "Ablation Study").
enum class Variant { kVi, kViP, kViCp, kVip };
/// "vi", "vi_p", "vi_cp", "vip"; throws std::invalid_argument on others.
Variant variantFromName(const std::string& name);
const char* variantName(Variant variant);

struct MeasurementOptions {
  double pixel_sigma = 0.05;
  double max_pixel_sigma = 1.5;
  double gate_sigma = 0.4;
  double matched_pixel_sigma = 1.0;
  double between_tracks_sigma = 0.45;
  double huber = 1.0;
  double depth_huber = 2.0;
  double depth_sigma_scale = 1.0;
  double outlier_chi2 = 9.0;
  double plane_prior_deg = 0.5;
  double surface_sigma = 0.006;
  bool use_odometry = true;

  void visit(OptionVisitor& v) {
    v.field("pixel_sigma", pixel_sigma, 0.05, 10.0,
            "a tracked feature's sigma as told by the front end counts for at least this, px");
    v.field("max_pixel_sigma", max_pixel_sigma, 0.1, 10.0, "and for at most this, px");
    v.field("gate_sigma", gate_sigma, 0.1, 10.0, "outliers are judged against at least this sigma, px");
    v.field("matched_pixel_sigma", matched_pixel_sigma, 0.1, 10.0,
            "one sigma of an untracked ORB corner of octave 0, px; 1.4 times as much with each octave");
    v.field("between_tracks_sigma", between_tracks_sigma, 0.01, 10.0,
            "how far a track's corner lies beside the point its landmark's other tracks show, px where it began");
    v.field("huber", huber, 0.5, 20.0, "reprojection residuals above this many sigmas weigh less");
    v.field("depth_huber", depth_huber, 0.5, 20.0, "depth residuals above this many sigmas weigh less");
    v.field("depth_sigma_scale", depth_sigma_scale, 0.1, 20.0, "factor on the depth sigma given by the front end");
    v.field("outlier_chi2", outlier_chi2, 2.0, 100.0, "an observation above this squared error (sigmas) is removed");
    v.field("plane_prior_deg", plane_prior_deg, 0.01, 10.0, "one sigma of horizontal and vertical planes, degrees");
    v.field("surface_sigma", surface_sigma, 1e-5, 0.1,
            "how far points lie beside their plane before the recording tells, one sigma, m");
    v.field("use_odometry", use_odometry,
            "the odometry's motion between successive keyframes, which knows the images and depth in between, counts");
  }
};

struct LocalBaOptions {
  int window = 20;
  int max_iterations = 10;
  double max_seconds = 0.2;
  int max_fixed_keyframes = 40;
  bool shared_hosts = true;
  bool middle_hosts = true;

  void visit(OptionVisitor& v) {
    v.field("window", window, 3, 100, "newest keyframes that are optimised");
    v.field("max_iterations", max_iterations, 1, 100, "Levenberg-Marquardt iterations");
    v.field("max_seconds", max_seconds, 0.0, 10.0, "time limit; 0 or lockstep: none");
    v.field("max_fixed_keyframes", max_fixed_keyframes, 0, 1000, "older keyframes that hold the window's landmarks");
    v.field("shared_hosts", shared_hosts,
            "few keyframes host the homographies of many plane points, instead of first views");
    v.field("middle_hosts", middle_hosts,
            "shared hosts see their points in the middle of the points' tracks: more hosts, less of their noise");
  }
};

struct GlobalBaOptions {
  int max_iterations = 100;
  double max_seconds = 2.0;
  bool at_end = true;
  bool shared_hosts = true;
  bool middle_hosts = true;

  void visit(OptionVisitor& v) {
    v.field("max_iterations", max_iterations, 2, 1000, "Levenberg-Marquardt iterations, of both rounds together");
    v.field("max_seconds", max_seconds, 0.0, 600.0, "time limit; 0 or lockstep: none");
    v.field("at_end", at_end, "run one at the end of the data");
    v.field("shared_hosts", shared_hosts,
            "few keyframes host the homographies of many plane points, instead of first views");
    v.field("middle_hosts", middle_hosts,
            "shared hosts see their points in the middle of the points' tracks: more hosts, less of their noise");
  }
};

struct ReobservationOptions {
  int keyframes = 30;
  double radius = 8.0;
  int max_hamming = 50;
  double ratio = 0.85;
  double merge_chi2 = 9.0;

  void visit(OptionVisitor& v) {
    v.field("keyframes", keyframes, 0, 500, "covisible and nearby keyframes whose landmarks are looked for");
    v.field("radius", radius, 1.0, 100.0, "search radius around the projection, px");
    v.field("max_hamming", max_hamming, 10, 128, "largest descriptor distance, bits");
    v.field("ratio", ratio, 0.3, 1.0, "best over second-best descriptor distance");
    v.field("merge_chi2", merge_chi2, 2.0, 100.0, "gate on joining two tracks into one landmark");
  }
};

/// A small map is kept whole: even a redundant keyframe has pixels measured to a tenth of a pixel and depth on planes,
/// and a landmark with two views still ties two keyframes. Larger maps are culled, so that a robot which stays in one
/// room for hours does not run out of memory, or of time long before: among keyframes that all see the same landmarks
/// the cost of a global adjustment grows with the cube of their number.
struct CullingOptions {
  bool enabled = true;
  int above_keyframes = 1000;
  int above_covisible = 120;
  double redundancy = 0.9;
  double max_imu_seconds = 3.0;

  void visit(OptionVisitor& v) {
    v.field("enabled", enabled, "remove redundant keyframes and poor landmarks from large maps");
    v.field("above_keyframes", above_keyframes, 0, 1000000, "maps of up to this many keyframes are kept whole");
    v.field("above_covisible", above_covisible, 10, 1000000,
            "... but for those that share landmarks with more than so many others, in maps of three times as many");
    v.field("redundancy", redundancy, 0.5, 1.0,
            "fraction of landmarks seen by three other keyframes that makes one redundant");
    v.field("max_imu_seconds", max_imu_seconds, 0.5, 10.0,
            "longest IMU factor that culling may leave, in a crowd up to ten times as long");
  }
};

struct BackEndOptions {
  std::string variant = "vip";
  std::string solver = "structured";
  bool loop_closing = true;
  bool depth_curve = true;
  bool disparity = false;
  bool lockstep = false;
  MeasurementOptions measurement;
  LocalBaOptions local_ba;
  GlobalBaOptions global_ba;
  ReobservationOptions reobservation;
  CullingOptions culling;
  LoopOptions loop;

  void visit(OptionVisitor& v) {
    v.field("variant", variant, {"vi", "vi_p", "vi_cp", "vip"}, "which of the paper's systems runs");
    v.field("solver", solver, {"structured", "ceres"},
            "the structure-aware Levenberg-Marquardt or the Ceres reference");
    v.field("loop_closing", loop_closing, "recognise places and close loops");
    v.field("depth_curve", depth_curve,
            "find out from planes seen from near and far what the depth camera reads wrong at which distance");
    v.field("disparity", disparity,
            "likewise of a stereo or structured-light camera, whose disparities may all be off; with depth errors that "
            "surfaces share it finds errors that are not there");
    v.field("lockstep", lockstep, "ignore time limits so that two runs give the same bits");
    v.group("measurement", measurement);
    v.group("local_ba", local_ba);
    v.group("global_ba", global_ba);
    v.group("reobservation", reobservation);
    v.group("culling", culling);
    v.group("loop", loop);
  }
};

}  // namespace vip_slam
