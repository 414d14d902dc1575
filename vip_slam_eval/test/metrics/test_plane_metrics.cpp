// SPDX-License-Identifier: BSD-3-Clause
// Plane maps with known faults.
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>

#include "vip_slam_core/geometry/angle.h"
#include "vip_slam_eval/metrics/association_metrics.h"
#include "vip_slam_eval/metrics/plane_metrics.h"
#include "vip_slam_eval/metrics/polygon_overlap.h"

namespace vip_slam {
namespace {

// A rectangle on a plane with corner o and sides a, b; its normal is a x b.
TruePlane rectangle(PlaneId id, const Eigen::Vector3d& o, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  TruePlane plane;
  plane.id = id;
  plane.plane = Plane::fromPointNormal(o, a.cross(b));
  const double up = std::abs(plane.plane.n.z());
  plane.kind = up > 0.9999 ? PlaneKind::kHorizontal : up < 0.01 ? PlaneKind::kVertical : PlaneKind::kGeneral;
  plane.polygons.push_back({{o, o + a, o + a + b, o + b}, {}});
  plane.area = a.cross(b).norm();
  return plane;
}

const Eigen::Vector3d X(1, 0, 0), Y(0, 1, 0), Z(0, 0, 1), O(0, 0, 0);

std::vector<TruePlane> room() {
  return {rectangle(1, O, 4 * X, 3 * Y),                                // floor
          rectangle(2, O, 3 * Y, 2.5 * Z),                              // wall x = 0, seen from +x
          rectangle(3, 3 * Y, 4 * X, 2.5 * Z),                          // wall y = 3, seen from -y
          rectangle(4, Eigen::Vector3d(1, 1, 0.7), 0.8 * X, 0.8 * Y)};  // table, 0.64 m^2
}

TEST(FlatRegionTest, AreasWithHoles) {
  PlaneEstimate floor = rectangle(1, O, 4 * X, 3 * Y);
  floor.polygons[0].holes.push_back({{1, 1, 0}, {2, 1, 0}, {2, 2, 0}, {1, 2, 0}});
  const FlatRegion region(floor.polygons, floor.plane);
  EXPECT_NEAR(region.area(), 11.0, 0.02);
  EXPECT_TRUE(region.contains(planeCoordinates(floor.plane, {0.5, 0.5, 0})));
  EXPECT_FALSE(region.contains(planeCoordinates(floor.plane, {1.5, 1.5, 0})));
  EXPECT_FALSE(region.contains(planeCoordinates(floor.plane, {5, 1, 0})));
  const FlatRegion half(rectangle(2, O, 2 * X, 3 * Y).polygons, floor.plane);
  EXPECT_NEAR(FlatRegion::overlap(region, half), 5.0, 0.02);
  EXPECT_EQ(FlatRegion::overlap(region, FlatRegion(rectangle(3, 10 * X, X, Y).polygons, floor.plane)), 0.0);
}

TEST(PlaneMetricsTest, TheTruthItselfIsPerfect) {
  const auto truth = room();
  const PlaneMetrics m = planeMetrics(truth, {truth.begin(), truth.end()});
  EXPECT_EQ(m.expected, 3u);  // the table is below 1 m^2
  EXPECT_EQ(m.found, 3u);
  EXPECT_EQ(m.recall, 1.0);
  EXPECT_EQ(m.duplicates, 0u);
  EXPECT_EQ(m.false_planes, 0u);
  EXPECT_LT(m.normal.max, 1e-6);
  EXPECT_LT(m.distance.max, 1e-9);
}

TEST(PlaneMetricsTest, ErrorsOfNormalAndDistanceAreMeasured) {
  std::vector<PlaneEstimate> estimate = {rectangle(7, {0, 0, 0.03}, 4 * X, 3 * Y)};
  PlaneMetrics m = planeMetrics(room(), estimate);
  EXPECT_NEAR(m.distance.max, 0.03, 1e-9);
  const double tilt = 0.03;  // about the floor's middle, so that the distance stays
  const SE3 about = SE3(Eigen::Quaterniond::Identity(), {2, 1.5, 0}) * SE3(expQuaternion(tilt * X), O) *
                    SE3(Eigen::Quaterniond::Identity(), {-2, -1.5, 0});
  m = planeMetrics(room(), transformPlanes(about, {rectangle(7, O, 4 * X, 3 * Y)}));
  ASSERT_EQ(m.matches[0].truth, 1u);
  EXPECT_NEAR(m.normal.max, tilt / kDegree, 1e-6);
  EXPECT_LT(m.distance.max, 1e-6);
}

TEST(PlaneMetricsTest, MissedDuplicatedAndInventedPlanes) {
  std::vector<PlaneEstimate> estimate = {
      rectangle(1, O, 2 * X, 3 * Y),                           // floor, one half
      rectangle(2, 2 * X, 2 * X, 3 * Y),                       // floor, other half: a duplicate
      rectangle(3, O, 3 * Y, 2.5 * Z),                         // wall
      rectangle(4, Eigen::Vector3d(0, 0, 1.5), 4 * X, 3 * Y),  // nothing there
      rectangle(5, Eigen::Vector3d(10, 0, 0), 4 * X, 3 * Y)};  // floor's height, but outside the floor
  const PlaneMetrics m = planeMetrics(room(), estimate);
  EXPECT_EQ(m.expected, 3u);
  EXPECT_EQ(m.found, 2u);
  EXPECT_EQ(m.duplicates, 1u);
  EXPECT_EQ(m.false_planes, 2u);
  EXPECT_EQ(m.truths[0].represented_by, 2u);
  EXPECT_NEAR(m.truths[0].covered_area, 12.0, 0.05);
  EXPECT_FALSE(m.truths[2].found);
}

TEST(PlaneMetricsTest, SlantedPlanesAreNotExpectedAndMustNotBeForced) {
  const TruePlane ramp = rectangle(5, {0, 0, 0}, {2, 0, 0.2}, 2 * Y);
  EXPECT_EQ(planeMetrics({ramp}, {}).expected, 0u);
  PlaneMetrics m = planeMetrics({ramp}, {ramp});
  EXPECT_EQ(m.forced_planes, 0u);
  EXPECT_EQ(m.false_planes, 0u);
  m = planeMetrics({ramp}, {rectangle(1, {0, 0, 0.1}, 2 * X, 2 * Y)});  // 5.7 degrees off
  EXPECT_EQ(m.forced_planes, 1u);
}

TEST(PlaneMetricsTest, OnlyLargeInventionsAreLarge) {
  const PlaneMetrics m =
      planeMetrics(room(), {rectangle(1, {1, 1, 1.5}, 0.6 * X, 0.6 * Y), rectangle(2, {2, 1, 1.9}, 0.8 * X, 0.8 * Y)});
  EXPECT_EQ(m.false_planes, 2u);
  EXPECT_EQ(m.large_false_planes, 1u);
}

TEST(PlaneMetricsTest, OppositeSidesAreDifferentPlanes) {
  PlaneEstimate floor_from_below = rectangle(1, O, 3 * Y, 4 * X);
  const PlaneMetrics m = planeMetrics(room(), {floor_from_below});
  EXPECT_EQ(m.false_planes, 1u);
  EXPECT_EQ(m.found, 0u);
}

TEST(PlaneMetricsTest, OneEstimateMayStandForSeveralTrueOnesInItsPlane) {
  const std::vector<TruePlane> tables = {rectangle(1, O, 1.5 * X, 1.5 * Y), rectangle(2, 3 * X, 1.5 * X, 1.5 * Y)};
  PlaneEstimate both = tables[0];
  both.polygons.push_back(tables[1].polygons[0]);
  const PlaneMetrics m = planeMetrics(tables, {both});
  EXPECT_EQ(m.found, 2u);
  EXPECT_EQ(m.duplicates, 0u);
  EXPECT_EQ(m.false_planes, 0u);
}

TEST(PlaneMetricsTest, OnlyWhatWasInViewIsExpected) {
  std::vector<TruePlane> truth = room();
  truth[0].seen_seconds = 1.0;  // too short
  truth[0].seen_area = 10;
  truth[1].seen_seconds = 10;
  truth[1].seen_area = 0.5;  // too little
  const PlaneMetrics m = planeMetrics(truth, {});
  EXPECT_EQ(m.expected, 1u);
  EXPECT_EQ(m.recall, 0.0);
  EXPECT_EQ(planeMetrics({}, {}).recall, 1.0);
}

TEST(AssociationMetricsTest, PrecisionAndRecall) {
  const std::vector<TruePlane> truth = room();
  const PlaneMetrics planes = planeMetrics(truth, {rectangle(10, O, 4 * X, 3 * Y), rectangle(11, O, 3 * Y, 2.5 * Z)});
  const std::vector<LabelledPoint> points = {
      {1, {1, 1, 0.01}, 10, 4},  // right
      {2, {2, 2, 0.30}, 10, 9},  // floats above the floor
      {3, {0, 1, 1.0}, 11, 5},   // right
      {4, {0, 2, 1.0}, 10, 4},   // a wall point tied to the floor
      {5, {3, 1, 0.0}, 0, 4},    // on the floor, not tied
      {6, {2, 3, 1.0}, 0, 4},    // on the wall that was not found
      {7, {8, 1, 0.0}, 10, 4},   // the floor's height outside of it
      {8, {3, 2, 0.0}, 0, 3}};   // on the floor, not tied, not seen often enough to be
  const AssociationMetrics m = associationMetrics(points, truth, planes);
  EXPECT_EQ(m.labelled, 5u);
  EXPECT_EQ(m.correct, 2u);
  EXPECT_DOUBLE_EQ(m.precision, 0.4);
  EXPECT_EQ(m.on_found_planes, 4u);
  EXPECT_DOUBLE_EQ(m.recall, 0.5);
}

TEST(LabelledPointsFile, RoundTripAndErrors) {
  const std::string path = ::testing::TempDir() + "points.csv";
  writeLabelledPoints(path, {{5, {1, -2, 0.25}, 3, 7}, {6, {0, 0, 1}, 0, 2}});
  const auto points = readLabelledPoints(path);
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].id, 5);
  EXPECT_EQ(points[0].plane, 3u);
  EXPECT_EQ(points[0].keyframes, 7);
  EXPECT_LT((points[0].p_W - Eigen::Vector3d(1, -2, 0.25)).norm(), 1e-9);
  std::ofstream(path) << "id,x,y,z,plane,keyframes\n1,2,3,4,5,6\n1,2,nan,4,5,6\n";
  try {
    readLabelledPoints(path);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("points.csv:3:"), std::string::npos) << error.what();
  }
  std::remove(path.c_str());
}

}  // namespace
}  // namespace vip_slam
