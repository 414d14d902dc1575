// SPDX-License-Identifier: BSD-3-Clause
// Homographies built from a map: what happens to wrongly associated views, whichever keyframe is the host.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "optimisation/wall.h"
#include "vip_slam_backend/map/map_checker.h"
#include "vip_slam_backend/solver/ba_solver.h"

using namespace vip_slam;

TEST(PlaneFactors, EveryViewOfAPlanePointBecomesAPair) {
  for (const bool shared : {false, true}) {
    Wall wall;
    EXPECT_EQ(wall.pairs(shared), Wall::kLandmarks * (Wall::kKeyframes - 1));
    EXPECT_FALSE(wall.isPoint(5, shared));
  }
}

TEST(PlaneFactors, AWrongViewIsLeftOut) {
  for (const bool shared : {false, true}) {
    Wall wall(5, [](int k) { return k == 6 ? 8.0 : 0.0; });
    EXPECT_EQ(wall.pairs(shared), Wall::kLandmarks * (Wall::kKeyframes - 1) - 1);
  }
}

TEST(PlaneFactors, AWrongViewNeitherPullsItsLandmarkNorStays) {
  Wall wall(5, [](int k) { return k == 6 ? 10.0 : 0.0; });  // the poses are true, so the solver need not run
  BuiltProblem built = buildProblem(wall.map, globalScope(wall.map), wall.settings);
  storeProblem(built, ImuNoise(), &wall.map);
  EXPECT_EQ(checkMap(wall.map), "");
  EXPECT_LT((wall.map.landmark(5).p_W - Wall::point(4)).norm(), 0.003);  // the mean of all views would be 8 mm off
  EXPECT_EQ(removeOutliers(built, wall.settings.measurement.outlier_chi2, &wall.map).size(), 1u);
  EXPECT_EQ(checkMap(wall.map), "");
  for (const MapObservation& o : wall.map.landmark(5).observations) EXPECT_NE(o.keyframe, 7u);
  // A view that agrees with the optimised poses is no outlier.
  built.refused.front().observation.x -= 10.0 / Wall::kFocal;
  built.refused.front().keyframe = 6;
  EXPECT_EQ(removeOutliers(built, wall.settings.measurement.outlier_chi2, &wall.map).size(), 0u);
  EXPECT_EQ(checkMap(wall.map), "");
}

TEST(PlaneFactors, AWrongHostMakesItAPointOfItsOwn) {
  Wall wall(5, [](int k) { return k == 0 ? 8.0 : 0.0; });
  EXPECT_TRUE(wall.isPoint(5, false));
  EXPECT_EQ(wall.pairs(false), (Wall::kLandmarks - 1) * (Wall::kKeyframes - 1));
}

TEST(PlaneFactors, ATrackThatDisagreesWithThePlaneEverywhereMakesItAPoint) {
  for (const bool shared : {false, true}) {
    Wall wall(5, [](int k) { return 6.0 * k; });
    EXPECT_TRUE(wall.isPoint(5, shared));
  }
}

TEST(PlaneFactors, SharedHostsGiveFewerFactors) {
  Wall wall;
  wall.settings.shared_hosts = true;
  const std::size_t shared = buildProblem(wall.map, globalScope(wall.map), wall.settings).problem.homographies.size();
  EXPECT_EQ(shared, std::size_t(Wall::kKeyframes - 1));  // one keyframe hosts all
}

// The first two and the last two of eight views are not hosts, in the second track of a landmark neither.
TEST(PlaneFactors, HostsComeFromTheMiddleOfATrack) {
  Wall wall;
  for (int k = 4; k < Wall::kKeyframes; ++k) wall.track(k, 5, 900);  // views 0 to 3 and 4 to 7
  wall.settings.shared_hosts = true;
  const auto hosts = [&wall](bool middle) {
    wall.settings.middle_hosts = middle;
    std::set<int> frames;
    for (const BaHomography& h : buildProblem(wall.map, globalScope(wall.map), wall.settings).problem.homographies)
      frames.insert(h.i);
    return frames;
  };
  for (const int frame : hosts(true)) EXPECT_TRUE(frame >= 1 && frame <= 6) << frame;
  EXPECT_EQ(hosts(true).count(1) + hosts(true).count(2) > 0, true);
  EXPECT_EQ(hosts(false).count(Wall::kKeyframes - 1), 1u);
}

// The second half of one landmark's views belong to another track, that of a corner slightly offset from the first.
TEST(PlaneFactors, AnotherTrackIsAPointOfItsOwnTiedByOneView) {
  const auto beside = [](int k) { return k < 5 ? 0.0 : 0.7; };
  for (const bool shared : {false, true})
    for (const Variant variant : {Variant::kVip, Variant::kVi}) {
      Wall wall(5, beside);
      Wall one(5, beside);
      for (int k = 5; k < Wall::kKeyframes; ++k) wall.track(k, 5, 900);
      wall.settings.variant = one.settings.variant = variant;
      wall.settings.shared_hosts = one.settings.shared_hosts = shared;
      // Without robust loss, which would change the costs compared here.
      wall.settings.measurement.huber = one.settings.measurement.huber = 0;
      BuiltProblem split = buildProblem(wall.map, globalScope(wall.map), wall.settings);
      BuiltProblem joint = buildProblem(one.map, globalScope(one.map), one.settings);
      if (variant == Variant::kVi) {
        EXPECT_EQ(split.points.size(), joint.points.size() + 1);
        EXPECT_EQ(split.problem.observations.size(), joint.problem.observations.size() + 1);
        EXPECT_EQ(std::count(split.points.begin(), split.points.end(), 5), 2);
      } else {
        EXPECT_EQ(wall.pairs(shared), one.pairs(shared));  // one view fewer (the second host), one pair more (the tie)
        EXPECT_EQ(split.plane_points, joint.plane_points);
      }
      // Each track is consistent in itself; only the tie between them has a cost.
      for (BuiltProblem* built : {&split, &joint}) {
        for (BaFrame& frame : built->problem.frames) frame.fixed = true;
        built->problem.gauges.clear();
        built->problem.motion_priors.clear();
        built->problem.imu.clear();
        built->problem.point_to_plane.clear();
        EXPECT_TRUE(makeSolver("ceres")->solve(built->problem, SolverOptions()).usable);
      }
      const double between = wall.settings.measurement.between_tracks_sigma;
      EXPECT_LT(evaluateCost(split.problem), 0.5 * 0.7 * 0.7 / (between * between));
      EXPECT_GT(evaluateCost(joint.problem), 3 * evaluateCost(split.problem));
    }
}

// A sliding view is in no pair, and a sliding host has no pairs; the rest of the landmark's views stay.
TEST(PlaneFactors, TracksThatSlideTellNothingAboutThePlane) {
  Wall wall;
  const int all = wall.pairs(true);
  wall.slide({2}, 5);
  EXPECT_EQ(wall.pairs(true), all - 1);
  EXPECT_FALSE(wall.isPoint(5, true));
  Wall everywhere;
  everywhere.slide({0, 1, 2, 3, 4, 5, 6, 7}, 5);
  EXPECT_EQ(everywhere.pairs(true), all - (Wall::kKeyframes - 1));
}

// A view that is two pixels off gets almost no weight compared with the others, though it is no outlier yet.
TEST(PlaneFactors, PairsFarOffWeighLittle) {
  const auto information = [](double shift) {
    Wall wall(5, [shift](int k) { return k == 6 ? shift : 0.0; });
    wall.settings.measurement.gate_sigma = 2;
    double sum = 0;
    for (const BaHomography& h : buildProblem(wall.map, globalScope(wall.map), wall.settings).problem.homographies)
      if (h.j == 6) sum += h.sums[5];  // of the squared weights
    return sum;
  };
  const double one = information(0) / Wall::kLandmarks;
  EXPECT_NEAR(information(2.0), (Wall::kLandmarks - 1) * one, 0.01 * one);
  EXPECT_GT(information(0.05), (Wall::kLandmarks - 0.3) * one);
}

// A track with wrong views gets less weight in its other views too, the less the more views are wrong.
TEST(PlaneFactors, ATrackCountsAsItsPairsAgree) {
  const auto information = [](int wrong) {  // of the pairs with view 1; it and the host, view 0, are correct
    Wall wall(5, [wrong](int k) { return k > 7 - wrong ? 0.19 : 0.0; });
    wall.settings.shared_hosts = false;
    double sum = 0;
    for (const BaHomography& h : buildProblem(wall.map, globalScope(wall.map), wall.settings).problem.homographies)
      if (h.j == 1) sum += h.sums[5];  // of the squared weights
    return sum;
  };
  const double all = information(0), one = all / Wall::kLandmarks;
  EXPECT_LT(information(3), all - 0.1 * one);
  EXPECT_LT(information(4), information(3) - 0.1 * one);
  EXPECT_GT(information(4), all - one);
}

// The offset between the corners of two tracks arose at twice the distance, so it is twice as many pixels here.
TEST(PlaneFactors, CornersOfTwoTracksLieFartherApartWhenSeenFromNearer) {
  const auto weight = [](double z) {  // of the tie
    Wall wall(0);
    for (int k = 5; k < Wall::kKeyframes; ++k) {
      wall.track(k, 5, 900);
      NavState state = wall.map.keyframe(k + 1).state;
      state.T_W_I = SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1 * k, 0, k == 5 ? 0 : 3.0 - z));
      wall.map.setState(k + 1, state, ImuNoise());
    }
    wall.settings.variant = Variant::kVi;
    const BuiltProblem built = buildProblem(wall.map, globalScope(wall.map), wall.settings);
    double least = 1e9;
    for (const BaObservation& o : built.problem.observations) least = std::min(least, o.weight);
    return least;
  };
  EXPECT_NEAR(weight(1.5), 0.5 * weight(3.0), 0.01 * weight(3.0));
}

TEST(PlaneFactors, DepthPointsBesideThePlaneAreLeftOut) {
  for (const int wrong : {0, 6, 15, 20}) {  // of 20 points, on a cupboard 8 cm before the wall; others are 1 cm off
    Wall wall;
    PlaneObservation seen;
    seen.plane = 1;
    seen.keyframe = 2;
    Eigen::Matrix4d right = Eigen::Matrix4d::Zero();
    for (int k = 0; k < 20; ++k) {
      const bool before = k < wrong;
      seen.points.push_back({Eigen::Vector3f(0.1f * (k % 5), 0.1f * (k / 5), before ? 2.93f : 3.01f), 0.005f});
      const Eigen::Vector4d p = seen.points.back().p_C.cast<double>().homogeneous();
      seen.G += p * p.transpose() / (0.005f * 0.005f);
      if (!before) right += p * p.transpose() / (0.005f * 0.005f);
    }
    ASSERT_TRUE(wall.map.setPlaneObservation(seen));
    for (const Variant variant : {Variant::kVip, Variant::kViP}) {
      wall.settings.variant = variant;
      const BaProblem problem = buildProblem(wall.map, globalScope(wall.map), wall.settings).problem;
      int points = 0;
      Eigen::Matrix4d G = Eigen::Matrix4d::Zero();
      for (const BaPointToPlane& f : problem.point_to_plane)
        if (f.frame == 1) points += f.points, G += f.G;
      for (const BaPlaneSample& f : problem.plane_samples) {
        if (f.frame != 1) continue;
        ++points;
        G += f.weight * f.weight * f.p_C.homogeneous() * f.p_C.homogeneous().transpose();
      }
      if (wrong == 15) {
        EXPECT_EQ(points, 0) << variantName(variant);  // it is not known which of the two is the wall
        continue;
      }
      if (wrong == 20) right = seen.G;  // one surface: the keyframe is off, not the points
      EXPECT_EQ(points, wrong == 20 ? 20 : 20 - wrong) << variantName(variant);
      EXPECT_LT((G - right).norm(), 1e-6 * right.norm()) << variantName(variant);
    }
  }
}

// Whatever a plane was sampled with: its distance has the variance that the front end learnt, white^2 / N + shared^2.
TEST(PlaneFactors, DepthIsWorthWhatTheFrontEndLearnt) {
  for (const DepthNoiseParts& parts : {DepthNoiseParts{0.04, 0.0}, DepthNoiseParts{0.25, 0.5}}) {
    for (const double scale : {1.0, 0.1}) {
      Wall wall(0, [](int) { return 0.0; }, parts);
      PlaneObservation seen;
      seen.plane = 1;
      seen.keyframe = 2;
      seen.weight_scale = scale;
      for (int k = 0; k < 20; ++k) {
        seen.points.push_back({Eigen::Vector3f(0.1f * float(k % 5), 0.1f * float(k / 5), 3.0f), 0.01f});
        const Eigen::Vector4d p = seen.points.back().p_C.cast<double>().homogeneous();
        seen.G += scale * p * p.transpose() / (0.01 * 0.01);
      }
      ASSERT_TRUE(wall.map.setPlaneObservation(seen));
      const BaProblem problem = buildProblem(wall.map, globalScope(wall.map), wall.settings).problem;
      double information = 0;
      for (const BaPointToPlane& f : problem.point_to_plane)
        if (f.frame == 1) information += f.G(3, 3);
      // Another keyframe sees the wall half a second before: half of the shared error is the same.
      const double variance = 0.005 * 0.005 * (parts.white / 20 + 1.5 * parts.shared);
      EXPECT_NEAR(information * variance, 1, 1e-3) << parts.shared << ' ' << scale;
    }
  }
}
