// SPDX-License-Identifier: BSD-3-Clause
// Options of the plane module: name, default, range and meaning in one place.
#pragma once

#include "vip_slam_core/util/options.h"
#include "vip_slam_planes/growth/cell_grid.h"

namespace vip_slam {

struct PlaneMeshOptions {
  double spacing = 16.0;
  double min_altitude_ratio = 0.12;
  double max_incidence_deg = 79.0;
  double max_level_incidence_deg = 84.0;
  double max_edge = 1.2;
  double gap_sigmas = 5.0;

  void visit(OptionVisitor& v) {
    v.field("spacing", spacing, 4.0, 64.0,
            "distance of the mesh's depth-grid nodes where features are sparse, px of 640; finer in smaller images");
    v.field("min_altitude_ratio", min_altitude_ratio, 0.01, 0.5,
            "triangles with a smaller altitude over longest side (3D) are dropped");
    v.field("max_incidence_deg", max_incidence_deg, 30.0, 89.0,
            "triangles whose normal is further from the viewing ray are dropped, degrees");
    v.field("max_level_incidence_deg", max_level_incidence_deg, 30.0, 89.0,
            "the same for level ones, degrees: tables across a room are seen at 80, and depth is looked up to 84");
    v.field("max_edge", max_edge, 0.1, 10.0, "triangles with a longer side are dropped, m");
    v.field("gap_sigmas", gap_sigmas, 2.0, 20.0,
            "a side whose middle lies this many depth sigmas off the measured depth crosses a depth edge");
  }
};

struct PlaneDetectionOptions {
  double gravity_deg = 10.0;
  double height_bin = 0.05;
  double distance_bin = 0.05;
  double angle_bin_deg = 3.0;
  double min_area = 0.15;
  double min_width = 0.25;
  double max_rms = 0.02;
  double max_tilt_deg = 2.5;
  int keyframes = 10;
  int min_keyframes = 2;
  bool general = false;

  void visit(OptionVisitor& v) {
    v.field("gravity_deg", gravity_deg, 1.0, 30.0,
            "a triangle is horizontal or vertical within this angle of gravity, degrees");
    v.field("height_bin", height_bin, 0.01, 0.5, "bins of the histogram of horizontal triangles, m");
    v.field("distance_bin", distance_bin, 0.01, 0.5, "bins of the histogram of vertical triangles, m");
    v.field("angle_bin_deg", angle_bin_deg, 0.5, 20.0, "bins of the histogram of vertical triangles, degrees");
    v.field("min_area", min_area, 0.01, 10.0, "smallest area that starts a plane in one image, m^2");
    v.field("min_width", min_width, 0.0, 2.0, "narrower strips do not start a plane, m");
    v.field("max_rms", max_rms, 0.001, 0.2, "largest distance of a new plane's points beyond depth noise, RMS, m");
    v.field("max_tilt_deg", max_tilt_deg, 0.5, 20.0,
            "surfaces that lean more than this from horizontal or vertical are slanted, degrees");
    v.field("keyframes", keyframes, 1, 100, "last keyframes whose left-over triangles may start a plane together");
    v.field("min_keyframes", min_keyframes, 2, 100, "keyframes that must agree on such a plane");
    v.field("general", general, "also detect planes that are neither horizontal nor vertical");
  }
};

struct PlaneGrowthOptions {
  double angle_deg = 10.0;
  double distance = 0.05;
  double cell = 0.1;
  double gap = 0.3;
  double min_move = 0.05;
  double min_turn_deg = 3.0;
  int min_hits = 1;

  void visit(OptionVisitor& v) {
    v.field("angle_deg", angle_deg, 1.0, 30.0,
            "largest angle between a plane and a triangle that joins it, degrees; up to 25 where noise explains it");
    v.field("distance", distance, 0.005, 0.5,
            "largest distance of a triangle that joins a plane, m; up to twice that where noise explains it");
    v.field("cell", cell, 0.02, 1.0, "side of the cells that record a plane's covered area, m");
    v.field("gap", gap, 0.0, 5.0, "triangles further than this from a plane's covered area do not join it, m");
    v.field("min_move", min_move, 0.0, 1.0, "frames nearer than this to the last one that grew planes are skipped, m");
    v.field("min_turn_deg", min_turn_deg, 0.0, 45.0, "... unless the camera turned by this, degrees");
    v.field("min_hits", min_hits, 1, kMaxHits, "sightings that make a cell part of the plane");
  }
};

struct PlaneMergingOptions {
  double angle_deg = 10.0;
  double distance = 0.10;
  double gap = 0.4;
  double chance = 0.028;
  double overlap = 0.3;
  double max_rms = 0.02;

  void visit(OptionVisitor& v) {
    v.field("angle_deg", angle_deg, 0.5, 30.0, "largest angle between planes that are merged, degrees");
    v.field("distance", distance, 0.01, 0.5,
            "largest distance of each one's boundary points to the other, m; twice that where depth noise explains it");
    v.field("gap", gap, 0.0, 5.0, "pieces no further apart than this are next to each other, m");
    v.field("chance", chance, 0.0, 1.0,
            "beyond: largest product of the gap and of the distance off the larger plane, per area of the smaller one");
    v.field("overlap", overlap, 0.05, 1.0, "share of the smaller area covered by both that makes them one surface");
    v.field("max_rms", max_rms, 0.002, 0.2, "what the joint fit may add to each one's RMS when they do not overlap, m");
  }
};

struct PlaneObservationOptions {
  double voxel = 0.12;
  int max_points = 200;
  int min_points = 12;
  double inlier_sigmas = 3.0;

  void visit(OptionVisitor& v) {
    v.field("voxel", voxel, 0.01, 1.0, "samples of one keyframe on one plane are this far apart, m");
    v.field("max_points", max_points, 20, 5000, "samples kept per keyframe and plane");
    v.field("min_points", min_points, 3, 1000, "fewer samples make no observation");
    v.field("inlier_sigmas", inlier_sigmas, 1.0, 10.0, "samples further off the local surface are left out, sigmas");
  }
};

struct PointAssociationOptions {
  double candidate_distance = 0.10;
  int min_keyframes = 4;
  double pixel_sigma = 0.25;
  double similar_px = 0.5;
  double max_error_px = 4.0;
  double max_distance = 0.03;
  int max_failures = 3;

  void visit(OptionVisitor& v) {
    v.field("candidate_distance", candidate_distance, 0.01, 1.0, "largest distance of a candidate to the plane, m");
    v.field("min_keyframes", min_keyframes, 2, 12, "keyframes that must see a candidate before it is decided on");
    v.field("pixel_sigma", pixel_sigma, 0.1, 10.0,
            "one sigma of a feature's position, px; at least, the front end tells it");
    v.field("similar_px", similar_px, 0.05, 10.0,
            "what forcing a point onto the plane may add to its reprojection error, RMS, px");
    v.field("max_error_px", max_error_px, 0.5, 50.0, "largest reprojection error of a plane point, px");
    v.field("max_distance", max_distance, 0.002, 0.5,
            "largest distance of the free point to the plane beyond noise, m");
    v.field("max_failures", max_failures, 1, 50, "failed tests that end a candidacy");
  }
};

struct PlaneSupportOptions {
  int min_keyframes = 2;
  int min_views = 3;
  double view_distance = 0.1;
  double sure_area = 1.0;
  double min_area = 0.03;
  double see_through = 0.10;
  int patience = 8;

  void visit(OptionVisitor& v) {
    v.field("min_keyframes", min_keyframes, 1, 20, "keyframes that must have seen a plane before it is published");
    v.field("min_views", min_views, 1, 100, "... or one keyframe, and growth frames from as many places further on");
    v.field("view_distance", view_distance, 0.0, 5.0, "such places are this far apart, m");
    v.field("sure_area", sure_area, 0.0, 100.0, "... unless its area is at least this, m^2");
    v.field("min_area", min_area, 0.0, 10.0,
            "smaller planes are not published, and those that shrink below it disappear, m^2");
    v.field("see_through", see_through, 0.02, 1.0, "depth measured this far behind a plane speaks against it, m");
    v.field("patience", patience, 1, 1000, "keyframes that may look at an unconfirmed plane without confirming it");
  }
};

struct PlaneMapperOptions {
  PlaneMeshOptions mesh;
  PlaneDetectionOptions detection;
  PlaneGrowthOptions growth;
  PlaneMergingOptions merging;
  PlaneObservationOptions observation;
  PointAssociationOptions association;
  PlaneSupportOptions support;

  void visit(OptionVisitor& v) {
    v.group("mesh", mesh);
    v.group("detection", detection);
    v.group("growth", growth);
    v.group("merging", merging);
    v.group("observation", observation);
    v.group("association", association);
    v.group("support", support);
  }
};

}  // namespace vip_slam
