// SPDX-License-Identifier: BSD-3-Clause
// Options of place recognition, loop verification and the pose-plane graph.
#pragma once

#include <string>

#include "vip_slam_core/util/options.h"

namespace vip_slam {

/// Verification that two keyframes show the same place, and their relative pose. Shared by loop closing and
/// relocalisation.
struct PlaceVerificationOptions {
  int max_hamming = 64;
  double ratio = 0.85;
  int matched_keyframes = 5;
  int min_matches = 6;
  int ransac_iterations = 400;
  double ransac_px = 4.0;
  int min_ransac_inliers = 6;
  int guided_keyframes = 10;
  double guided_radius = 10.0;
  double inlier_px = 3.0;
  double max_sigma_position = 0.05;
  double min_depth_agreement = 0.6;
  double max_see_through = 0.12;

  void visit(OptionVisitor& v) {
    v.field("max_hamming", max_hamming, 10, 128, "largest descriptor distance of a match, bits");
    v.field("ratio", ratio, 0.3, 1.0, "best over second-best descriptor distance");
    v.field("matched_keyframes", matched_keyframes, 1, 100,
            "keyframes around a candidate that are matched by descriptor");
    v.field("min_matches", min_matches, 4, 500, "descriptor matches needed to try a pose");
    v.field("ransac_iterations", ransac_iterations, 10, 10000, "samples drawn by the pose RANSAC");
    v.field("ransac_px", ransac_px, 0.5, 20.0, "inlier threshold of the RANSAC, px");
    v.field("min_ransac_inliers", min_ransac_inliers, 4, 500, "inliers needed to go on to guided matching");
    v.field("guided_keyframes", guided_keyframes, 1, 100, "keyframes around the match whose landmarks are looked for");
    v.field("guided_radius", guided_radius, 1.0, 50.0, "search radius around a projected landmark, px");
    v.field("inlier_px", inlier_px, 0.5, 20.0, "largest reprojection error of a final inlier, px per octave scale");
    v.field("max_sigma_position", max_sigma_position, 0.001, 1.0, "largest one-sigma of the relative position, m");
    v.field("min_depth_agreement", min_depth_agreement, 0.0, 1.0, "fraction of common depth that must agree");
    v.field("max_see_through", max_see_through, 0.0, 1.0,
            "fraction of common depth that may lie behind the other's surface");
  }
};

struct PoseGraphOptions {
  double odometry_sigma_position = 0.015;
  double odometry_sigma_yaw_deg = 0.10;
  double odometry_drift = 0.01;
  double loop_sigma_position = 0.02;
  double loop_sigma_angle_deg = 0.3;
  int covisible_edge = 60;
  double min_log_odds = 2.3;
  int max_iterations = 50;

  void visit(OptionVisitor& v) {
    v.field("odometry_sigma_position", odometry_sigma_position, 1e-4, 1.0,
            "drift of position, m per square root of metre");
    v.field("odometry_sigma_yaw_deg", odometry_sigma_yaw_deg, 1e-3, 10.0,
            "drift of yaw, degrees per square root of metre");
    v.field("odometry_drift", odometry_drift, 0.0, 0.1,
            "one sigma of the drift that is common to the whole way of a loop, as a share of the way");
    v.field("loop_sigma_position", loop_sigma_position, 1e-4, 1.0, "smallest one-sigma of a loop edge's position, m");
    v.field("loop_sigma_angle_deg", loop_sigma_angle_deg, 1e-3, 10.0,
            "smallest one-sigma of a loop edge's angles, degrees");
    v.field("covisible_edge", covisible_edge, 10, 1000, "shared landmarks that make an edge between two keyframes");
    v.field("min_log_odds", min_log_odds, -20.0, 100.0,
            "natural logarithm of how much more probable a loop must be than a place that looks alike");
    v.field("max_iterations", max_iterations, 1, 1000, "Levenberg-Marquardt iterations");
  }
};

struct RelocalisationOptions {
  int candidates = 8;
  int rivals = 32;
  int keyframes = 5;
  double seconds = 2.0;
  int ransac_iterations = 1000;
  int min_seed_inliers = 8;
  int min_points = 12;
  int sure_points = 20;
  double min_evidence = 300;
  double sure_evidence = 600;
  double min_covered = 0.25;
  double ambiguity = 0.25;
  double resemblance = 0.6;

  void visit(OptionVisitor& v) {
    v.field("candidates", candidates, 1, 100, "views of the map tried per keyframe");
    v.field("rivals", rivals, 0, 1000, "further views tried before a place is believed");
    v.field("keyframes", keyframes, 1, 50, "newest keyframes that are judged together");
    v.field("seconds", seconds, 0.0, 10.0, "age of the oldest of them, s");
    v.field("ransac_iterations", ransac_iterations, 10, 10000, "samples drawn per place");
    v.field("min_seed_inliers", min_seed_inliers, 4, 500, "descriptor matches that agree, to look at a place at all");
    v.field("min_points", min_points, 6, 1000, "distinct points of the map that must be found again");
    v.field("min_evidence", min_evidence, 0.0, 1e6,
            "points times share of image cells and of landmarks explained, over the share of depth that contradicts");
    v.field("sure_points", sure_points, 6, 1000, "below it the next keyframe must come to the same place");
    v.field("sure_evidence", sure_evidence, 0.0, 1e6, "the same for the evidence");
    v.field("min_covered", min_covered, 0.0, 1.0, "share of the features that must be in sight of the map");
    v.field("ambiguity", ambiguity, 0.0, 1.0, "refused when another place has more than this fraction of the evidence");
    v.field("resemblance", resemblance, 0.0, 10.0,
            "the next keyframe must come to it, too, when another place has more than this fraction of the points");
  }
};

struct LoopOptions {
  std::string vocabulary;
  double min_seconds = 10.0;
  int max_shared = 12;
  int candidates = 4;
  double relative_score = 0.25;
  int consistency = 1;
  PlaceVerificationOptions verification;
  PoseGraphOptions graph;
  RelocalisationOptions relocalisation;

  void visit(OptionVisitor& v) {
    v.field("vocabulary", vocabulary, {}, "vocabulary file (ours or ORB-SLAM text); empty: the shipped one");
    v.field("min_seconds", min_seconds, 0.0, 1000.0, "a loop joins keyframes at least this far apart in time, s");
    v.field("max_shared", max_shared, 0, 1000, "keyframes sharing more landmarks than this are joined already");
    v.field("candidates", candidates, 1, 50, "places verified per keyframe");
    v.field("relative_score", relative_score, 0.0, 1.0, "smallest score over the score of the keyframe before");
    v.field("consistency", consistency, 0, 10, "keyframes before that must have pointed to the same place");
    v.group("verification", verification);
    v.group("graph", graph);
    v.group("relocalisation", relocalisation);
  }
};

}  // namespace vip_slam
