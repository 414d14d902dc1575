// SPDX-License-Identifier: BSD-3-Clause
// Temporarily poor images, and objects that enter the view: tracks stay on their points.
#include <map>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "test_camera.h"
#include "vip_slam_frontend/tracking/feature_tracker.h"
#include "vip_slam_frontend/tracking/landmark_matcher.h"
#include "vip_slam_frontend/tracking/orb_extractor.h"

namespace vip_slam {
namespace {

constexpr double kWall = 2.0, kStep = 0.004;

/// A camera that goes sideways before a textured wall.
class DisturbanceTest : public ::testing::Test {
 protected:
  DisturbanceTest() : tracker_(TrackingOptions(), testCamera(), DepthNoise(), nullptr), texture_(1200, 1600, CV_8U) {
    cv::RNG random(7);
    random.fill(texture_, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(texture_, texture_, cv::Size(), 3.0);
    cv::normalize(texture_, texture_, 0, 255, cv::NORM_MINMAX);
  }
  static SE3 pose(int k) { return SE3(Eigen::Matrix3d::Identity(), Eigen::Vector3d(kStep * k, 0, 0)); }
  /// Shift of the image since image 0, px.
  static double shift(int k) { return kFocal / kWall * kStep * k; }
  cv::Mat image(int k, double gain = 1.0) const {
    const cv::Matx23d M(1, 0, 480 - shift(0) + shift(k), 0, 1, 360);  // where the view begins on the texture
    cv::Mat view, noise(480, 640, CV_32F);
    cv::warpAffine(texture_, view, M, cv::Size(640, 480), cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
    view.convertTo(view, CV_32F, gain);
    cv::RNG random(static_cast<std::uint64_t>(k) + 1);
    random.fill(noise, cv::RNG::NORMAL, 0, 1.0);
    view += noise;
    view.convertTo(view, CV_8U);
    return view;
  }
  void show(int k, const cv::Mat& gray, cv::Mat depth = cv::Mat(480, 640, CV_32F, cv::Scalar(kWall))) {
    const SE3 motion = k == 0 ? SE3() : pose(k).inverse() * pose(k - 1);
    tracker_.track(gray, depth, {motion, 0, 0}, true, pose(k), nullptr, k);
    if (k > 0) return;
    tracker_.replenish(pose(0), true, 0);
    for (const Track& track : tracker_.tracks()) {
      first_[track.feature.id] = track.feature.pixel.cast<double>();
      reference_[track.feature.id] = track.reference.get();
    }
  }
  /// Distance from where the track's point is seen now, px.
  double error(const Track& track, int k) const {
    const Eigen::Vector2d truth = first_.at(track.feature.id) - Eigen::Vector2d(shift(k), 0);
    return (track.feature.pixel.cast<double>() - truth).norm();
  }

  FeatureTracker tracker_;
  cv::Mat texture_;
  std::map<LandmarkId, Eigen::Vector2d> first_;
  std::map<LandmarkId, const ReferenceImage*> reference_;
};

TEST_F(DisturbanceTest, ABrightAreaThatEntersIsNoChangeOfTheExposure) {
  constexpr int kEnters = 40;  // px an image
  for (int k = 0; k < 6; ++k) {
    cv::Mat gray = image(k, 0.55);
    if (k > 0) gray.colRange(640 - kEnters * k, 640).setTo(255);
    show(k, gray);
  }
  std::size_t beside = 0, left = 0;
  for (const auto& [id, pixel] : first_) beside += pixel.x() < 640 - 5 * kEnters - 30;
  for (const Track& track : tracker_.tracks()) left += first_.at(track.feature.id).x() < 640 - 5 * kEnters - 30;
  EXPECT_GT(beside, 60u);
  EXPECT_GT(left, beside * 9 / 10);
}

// The exposure changes so much that a third of the image is saturated, or motion blurs three images: tracks recover at
// their original points, with the same accuracy.
TEST_F(DisturbanceTest, TracksComeBackToWhatTheyBeganWith) {
  for (const bool blurred : {false, true}) {
    SCOPED_TRACE(blurred ? "blurred" : "saturated");
    tracker_.clear();
    first_.clear();
    reference_.clear();
    for (int k = 0; k < 12; ++k) {
      cv::Mat gray = image(k);
      const bool disturbed = k >= 4 && k < 7;
      if (disturbed && blurred) cv::blur(gray, gray, cv::Size(11, 1));
      if (disturbed && !blurred) gray = image(k, 2.0);
      show(k, gray);
      for (const Track& track : tracker_.tracks()) {
        if (disturbed && track.missed > 0) EXPECT_GT(track.feature.pixel_sigma, 0.4f);
      }
    }
    int same = 0, off = 0;
    for (const Track& track : tracker_.tracks()) {
      if (track.reference.get() != reference_.at(track.feature.id)) continue;
      ++same;
      off += error(track, 11) > 0.1;
    }
    EXPECT_GT(same, static_cast<int>(first_.size() * 6 / 10)) << "of " << first_.size();
    EXPECT_LT(off, same / 20);
  }
}

TEST_F(DisturbanceTest, AHoleInTheDepthLeavesAPatchWide) {
  for (int k = 0; k < 10; ++k) {
    cv::Mat depth(480, 640, CV_32F, cv::Scalar(kWall));
    cv::RNG random(static_cast<std::uint64_t>(k) + 50);
    for (int i = 0; k > 0 && i < 60; ++i) {
      cv::circle(depth, {random.uniform(0, 640), random.uniform(0, 480)}, 5, cv::Scalar(0), -1);
    }
    show(k, image(k), depth);
  }
  int inside = 0, wide = 0;
  for (const Track& track : tracker_.tracks()) {
    const Eigen::Vector2f p = track.feature.pixel;
    if (p.x() < 30 || p.y() < 30 || p.x() > 610 || p.y() > 450) continue;
    ++inside;
    wide += track.surface.wide;
  }
  EXPECT_GT(inside, 80);
  EXPECT_GT(wide, inside * 95 / 100);
}

TEST_F(DisturbanceTest, DepthCarriesOverImagesWithoutIt) {
  for (int k = 0; k < 12; ++k) {
    const SE3 motion = k == 0 ? SE3() : pose(k).inverse() * pose(k - 1);
    const cv::Mat depth = k % 3 == 0 ? cv::Mat(480, 640, CV_32F, cv::Scalar(kWall)) : cv::Mat();
    const TrackingResult result = tracker_.track(image(k), depth, {motion, 0.002, 0.033}, true, pose(k), nullptr, k);
    if (k == 0) tracker_.replenish(pose(0), true, 0);
    if (k > 0) EXPECT_TRUE(result.pose_ok) << k;
    for (const Track& track : tracker_.tracks()) {
      EXPECT_EQ(track.feature.depth > 0, k % 3 == 0);  // as passed to the filter
      EXPECT_NEAR(track.carried_depth, kWall, 1e-3);
    }
  }
}

// Retires all tracks, whose patches are off by `variance`, px^2; returns their landmarks as the map has them.
MapUpdate retireAll(const FeatureTracker& tracker, const OrbExtractor& orb, double variance, LandmarkMatcher* matcher) {
  MapUpdate update;
  std::vector<Feature> features;
  for (const Track& track : tracker.tracks()) features.push_back(track.feature);
  orb.describe(tracker.gray(), &features);
  for (std::size_t i = 0; i < features.size(); ++i) {
    Track track = tracker.tracks()[i];
    track.feature.age = 10;
    track.reference_variance = variance;
    matcher->retire(track);
    LandmarkEstimate landmark;
    landmark.id = track.feature.id;
    landmark.p_W = kWall * track.feature.xy.cast<double>().homogeneous();
    landmark.observations = 5;
    landmark.descriptor = features[i].descriptor;
    update.landmarks.push_back(landmark);
  }
  return update;
}

// A landmark found by its descriptor has a sigma of a pixel, and keeps it when its patch is found again later.
TEST_F(DisturbanceTest, APatchFoundAgainIsAsUnsureAsItsReference) {
  show(0, image(0));
  LandmarkMatcher matcher(TrackingOptions(), testCamera());
  const OrbExtractor orb(300);
  matcher.apply(retireAll(tracker_, orb, 1.0, &matcher));
  tracker_.clear();
  // Seen from a shorter distance.
  const SE3 near(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, 0, kWall / 6));
  cv::Mat enlarged;
  const double scale = 1.2;
  const cv::Matx23d M(scale, 0, kCx - scale * kCx, 0, scale, kCy - scale * kCy);
  cv::warpAffine(image(0), enlarged, M, cv::Size(640, 480));
  tracker_.track(enlarged, cv::Mat(480, 640, CV_32F, cv::Scalar(kWall / scale)), {SE3(), 0, 0}, true, near, nullptr, 1);
  ASSERT_GT(matcher.reacquire(&tracker_, orb, near, near), 10);
  for (const Track& track : tracker_.tracks()) {
    EXPECT_GT(track.feature.pixel_sigma, 1.1f);
    EXPECT_NEAR(track.magnification, scale, 0.05);
    EXPECT_FALSE(track.texture.isZero());
  }
}

// When there are too many patches the one that was retired first goes, whatever its id: an old landmark that was found
// again and lost again keeps its patch.
TEST_F(DisturbanceTest, PatchesOfLandmarksFoundAgainAreKept) {
  show(0, image(0));
  LandmarkMatcher matcher(TrackingOptions(), testCamera());
  ASSERT_GT(tracker_.tracks().size(), 50u);
  const Track one = tracker_.tracks()[0];
  LandmarkId other = 1000000;
  const auto retireOthers = [&](int count) {
    for (int k = 0; k < count; ++k) {
      Track track = one;
      track.feature.id = other++;
      track.feature.age = 10;
      matcher.retire(track);
    }
  };
  retireOthers(8000);  // full
  const OrbExtractor orb(300);
  const MapUpdate update = retireAll(tracker_, orb, 0.0, &matcher);
  retireOthers(100);
  matcher.apply(update);
  tracker_.clear();
  tracker_.track(image(0), cv::Mat(480, 640, CV_32F, cv::Scalar(kWall)), {SE3(), 0, 0}, true, SE3(), nullptr, 1);
  ASSERT_GT(matcher.reacquire(&tracker_, orb, SE3(), SE3()), 10);
  // Found by their patches; by descriptor alone the sigma is a pixel.
  for (const Track& track : tracker_.tracks()) EXPECT_LT(track.feature.pixel_sigma, 0.8f);
}

}  // namespace
}  // namespace vip_slam
