// SPDX-License-Identifier: BSD-3-Clause
// Tracking pieces on small synthetic images with known motion.
#include <cmath>
#include <map>
#include <random>

#include <gtest/gtest.h>
#include <Eigen/Dense>
#include <opencv2/imgproc.hpp>

#include "test_camera.h"
#include "vip_slam_core/types/sliding_tracks.h"
#include "vip_slam_frontend/tracking/corner_detector.h"
#include "vip_slam_frontend/tracking/feature_tracker.h"
#include "vip_slam_frontend/tracking/orb_extractor.h"
#include "vip_slam_frontend/tracking/outlier_rejection.h"
#include "vip_slam_frontend/tracking/patch_alignment.h"
#include "vip_slam_frontend/tracking/pixel_noise.h"

namespace vip_slam {
namespace {

/// Smooth random texture on the plane z = 2 of the world, seen from a camera at `t` without rotation.
cv::Mat render(const cv::Mat& texture, const Eigen::Vector3d& t, double noise, unsigned seed) {
  const double z = 2.0 - t.z();
  cv::Mat_<float> mx(480, 640), my(480, 640);
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const double x = (u - kCx) / kFocal * z + t.x(), y = (v - kCy) / kFocal * z + t.y();
      mx(v, u) = static_cast<float>(x * 200 + texture.cols / 2);
      my(v, u) = static_cast<float>(y * 200 + texture.rows / 2);
    }
  }
  cv::Mat image;
  cv::remap(texture, image, mx, my, cv::INTER_CUBIC, cv::BORDER_REFLECT);
  cv::Mat noisy;
  image.convertTo(noisy, CV_16S);
  cv::Mat n(image.size(), CV_16S);
  cv::RNG random(seed);
  random.fill(n, cv::RNG::NORMAL, 0, noise);
  noisy += n;
  noisy.convertTo(image, CV_8U);
  return image;
}

cv::Mat makeTexture() {
  cv::Mat texture(1200, 1600, CV_8U);
  cv::RNG random(7);
  random.fill(texture, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(texture, texture, cv::Size(), 3.0);
  cv::normalize(texture, texture, 0, 255, cv::NORM_MINMAX);
  return texture;
}

TEST(CornerDetector, SpreadsOverTheImageAndKeepsDistance) {
  const cv::Mat image = render(makeTexture(), Eigen::Vector3d::Zero(), 1.0, 1);
  const TrackingOptions options;
  const std::vector<Corner> corners = detectCorners(image, {}, 200, options);
  EXPECT_EQ(corners.size(), 200u);
  std::vector<int> quadrant(4, 0);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    ++quadrant[(corners[i].pixel.x > 320) + 2 * (corners[i].pixel.y > 240)];
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_GE(cv::norm(corners[i].pixel - corners[j].pixel), options.min_distance);
    }
  }
  for (int count : quadrant) EXPECT_GT(count, 30);
}

TEST(CornerDetector, NothingOnABlankWall) {
  cv::Mat image(480, 640, CV_8U, cv::Scalar(120));
  EXPECT_TRUE(detectCorners(image, {}, 200, TrackingOptions()).empty());
}

TEST(PatchAlignment, RecoversSubPixelShiftUnderExposureChange) {
  const cv::Mat texture = makeTexture();
  const cv::Mat reference = render(texture, Eigen::Vector3d::Zero(), 0.5, 1);
  // 0.37 and -0.21 pixels at z = 2, brighter by a gain and an offset.
  const Eigen::Vector3d t(-0.37 * 2.0 / kFocal, 0.21 * 2.0 / kFocal, 0);
  cv::Mat current = render(texture, t, 0.5, 2);
  current.convertTo(current, CV_8U, 0.8, 10);
  double worst = 0, sum = 0;
  int count = 0;
  for (const Corner& corner : detectCorners(reference, {}, 100, TrackingOptions())) {
    const Eigen::Vector2d p(corner.pixel.x, corner.pixel.y);
    const PatchAlignment aligned = alignPatch(reference, p, PatchWarp(), current, p);
    if (!aligned.ok) continue;
    const double error = (aligned.pixel - p - Eigen::Vector2d(0.37, -0.21)).norm();
    worst = std::max(worst, error);
    sum += error;
    ++count;
  }
  EXPECT_GT(count, 90);
  EXPECT_LT(sum / count, 0.06);
  EXPECT_LT(worst, 0.2);
}

/// Root mean square error of alignments by 0.37 and -0.21 px.
double alignmentError(bool wide, int* count) {
  const cv::Mat texture = makeTexture();
  const cv::Mat reference = render(texture, Eigen::Vector3d::Zero(), 3.0, 1);
  const cv::Mat current = render(texture, Eigen::Vector3d(-0.37 * 2.0 / kFocal, 0.21 * 2.0 / kFocal, 0), 3.0, 2);
  double sum = 0;
  *count = 0;
  for (const Corner& corner : detectCorners(reference, {}, 100, TrackingOptions())) {
    const Eigen::Vector2d p(corner.pixel.x, corner.pixel.y);
    const PatchAlignment aligned = alignPatch(reference, p, PatchWarp(), current, p, wide);
    if (!aligned.ok) continue;
    sum += (aligned.pixel - p - Eigen::Vector2d(0.37, -0.21)).squaredNorm();
    ++*count;
  }
  return std::sqrt(sum / *count);
}

TEST(PatchAlignment, WidePatchIsMoreExact) {
  int narrow_count = 0, wide_count = 0;
  const double narrow = alignmentError(false, &narrow_count), wide = alignmentError(true, &wide_count);
  std::printf("narrow %.3f px of %d, wide %.3f px of %d\n", narrow, narrow_count, wide, wide_count);
  EXPECT_GE(wide_count, narrow_count);
  EXPECT_LT(wide, 0.75 * narrow);
}

/// What a camera with a blur of 0.55 px sees of a pattern of sharp-edged squares, `scale` elements of it per pixel.
cv::Mat squares(double scale) {
  cv::Mat pattern(2400, 2400, CV_8U, cv::Scalar(90));
  cv::RNG random(11);
  for (int i = 0; i < 900; ++i) {
    const int x = random.uniform(0, 2360), y = random.uniform(0, 2360), side = random.uniform(15, 60);
    cv::rectangle(pattern, cv::Rect(x, y, side, side), cv::Scalar(random.uniform(20, 235)), cv::FILLED);
  }
  cv::GaussianBlur(pattern, pattern, cv::Size(), 0.55 * scale);
  const int side = static_cast<int>(2399 / scale);
  cv::Mat_<float> mx(side, side), my(side, side);
  for (int v = 0; v < side; ++v) {
    for (int u = 0; u < side; ++u) mx(v, u) = static_cast<float>(u * scale), my(v, u) = static_cast<float>(v * scale);
  }
  cv::Mat image;
  cv::remap(pattern, image, mx, my, cv::INTER_LINEAR);
  return image;
}

// A sharp image against an enlarged, blurred reference: asymmetric edges bias the match.
TEST(PatchAlignment, AnEnlargedPatchMatchesAnImageAsBlurred) {
  const cv::Mat reference = squares(9), current = squares(4);
  const PatchWarp warp(Eigen::Matrix2d((4.0 / 9.0) * Eigen::Matrix2d::Identity()));
  double sum = 0;
  int count = 0;
  for (int v = 60; v < 540; v += 9) {
    for (int u = 60; u < 540; u += 9) {
      const Eigen::Vector2d pixel(u, v);
      const PatchAlignment aligned = alignPatch(reference, pixel * 4.0 / 9.0, warp, current, pixel, true);
      if (!aligned.ok) continue;
      sum += (aligned.pixel - pixel).squaredNorm();
      ++count;
    }
  }
  ASSERT_GT(count, 1000);
  std::printf("%.4f px of %d\n", std::sqrt(sum / count), count);
  EXPECT_LT(std::sqrt(sum / count), 0.15);  // 0.32 without blurring the image
}

TEST(PatchAlignment, TheNarrowPatchServesWhereTheWideOneLeavesTheImage) {
  const cv::Mat image = render(makeTexture(), Eigen::Vector3d::Zero(), 0.5, 1);
  const Eigen::Vector2d rim(9, 200);
  const PatchAlignment aligned = alignPatch(image, rim, PatchWarp(), image, rim + Eigen::Vector2d(0.3, 0.2), true);
  ASSERT_TRUE(aligned.ok);
  EXPECT_LT((aligned.pixel - rim).norm(), 0.01);
  EXPECT_GT(patchTexture(image, rim, true).norm(), 0);
}

TEST(PatchAlignment, RefusesADifferentPatch) {
  const cv::Mat image = render(makeTexture(), Eigen::Vector3d::Zero(), 0.5, 1);
  int accepted = 0;
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector2d a(60 + 12 * i, 100), b(70 + 12 * i, 350);
    accepted += alignPatch(image, a, PatchWarp(), image, b).ok;
  }
  EXPECT_LT(accepted, 8);
}

/// Half dark, half bright at a slanted edge whose contrast fades slightly along it, shifted by `shift`, with noise.
/// (Without any signal along the edge the gradients of the noise would count as texture.)
cv::Mat edgePatch(const Eigen::Vector2d& shift, double noise, unsigned seed) {
  cv::Mat image(60, 60, CV_8U);
  cv::RNG random(seed);
  for (int v = 0; v < 60; ++v) {
    for (int u = 0; u < 60; ++u) {
      const double x = u - 30.3 - shift.x(), y = v - 29.6 - shift.y();
      const double edge = 60.0 * std::tanh(0.8 * (0.8 * x + 0.6 * y)), along = 0.8 * y - 0.6 * x;
      image.at<std::uint8_t>(v, u) =
          cv::saturate_cast<std::uint8_t>(110.0 + edge + 20.0 * std::tanh(0.4 * along) + random.gaussian(noise));
    }
  }
  return image;
}

TEST(PixelNoise, AlongAnEdgeTheAlignmentScattersAsTheTextureSays) {
  const Eigen::Vector2d centre(30, 30), shift(0.3, -0.2);
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero(), texture = Eigen::Matrix2d::Zero();
  int count = 0;
  for (unsigned seed = 1; seed <= 400; ++seed) {
    const cv::Mat reference = edgePatch(Eigen::Vector2d::Zero(), 2.0, seed);
    const cv::Mat current = edgePatch(shift, 2.0, 1000 + seed);
    const PatchAlignment found = alignPatch(reference, centre, PatchWarp(), current, centre);
    if (!found.ok) continue;
    const Eigen::Vector2d e = found.pixel - centre - shift;
    scatter += e * e.transpose();
    texture += found.texture;
    ++count;
  }
  ASSERT_GT(count, 350);
  scatter /= count;
  texture /= count;
  const Eigen::Vector2d across(0.8, 0.6), along(-0.6, 0.8);
  const double measured = std::sqrt((along.dot(scatter * along)) / (across.dot(scatter * across)));
  const Eigen::Matrix2d inverse = texture.inverse();
  const double predicted = std::sqrt((along.dot(inverse * along)) / (across.dot(inverse * across)));
  std::printf("scatter along to across: %.1f, by the texture %.1f\n", measured, predicted);
  EXPECT_GT(measured, 4.0);
  EXPECT_NEAR(predicted / measured, 1.0, 0.35);

  const Eigen::Matrix2d L = pixelWhitening(texture, 0.0, 1.0);
  EXPECT_NEAR(L(0, 1), 0.0, 1e-12);
  const Eigen::Matrix2d covariance = (L.transpose() * L).inverse();
  EXPECT_GT(along.dot(covariance * along), 4.0 * across.dot(covariance * across));
}

/// Geometric mean of the two standard deviations.
double pixelSigma(const Eigen::Matrix2d& whitening) { return 1.0 / std::sqrt(whitening.determinant()); }

TEST(PixelNoise, GrowsWithFaintnessResidualAndEdges) {
  const Eigen::Matrix2d strong = 1e6 * Eigen::Matrix2d::Identity(), faint = 1e3 * Eigen::Matrix2d::Identity();
  EXPECT_NEAR(pixelSigma(pixelWhitening(strong, 0, 1)), 1.0, 0.01);
  EXPECT_GT(pixelSigma(pixelWhitening(faint, 0, 1)), 2.0);
  EXPECT_GT(pixelSigma(pixelWhitening(faint, 10, 1)), 2.0 * pixelSigma(pixelWhitening(faint, 1, 1)));
  EXPECT_NEAR(pixelSigma(pixelWhitening(strong, 0, 3)), 3.0, 0.03);
  PatchSurface known, rim, unknown;
  known.depth = rim.depth = 2.0;
  known.known = true;
  EXPECT_EQ(patchWander(known, false, false), 1.0);
  EXPECT_GT(patchWander(known, true, false), 2.0);
  EXPECT_GT(patchWander(rim, false, false), 2.0);
  EXPECT_GT(patchWander(unknown, false, false), patchWander(rim, true, false));
  EXPECT_TRUE(pixelWhitening(Eigen::Matrix2d::Zero(), 0, 1).allFinite());
}

TEST(PixelNoise, WidePatchesAreMoreExactAndLargerOnesLess) {
  PatchSurface wide, narrow, rim;
  wide.depth = narrow.depth = rim.depth = 2.0;
  wide.known = narrow.known = wide.wide = true;
  EXPECT_LT(matchSigma(wide, 1), matchSigma(narrow, 1));
  EXPECT_LT(matchSigma(narrow, 1), matchSigma(rim, 1));
  EXPECT_EQ(matchSigma(wide, 0.5), matchSigma(wide, 1));  // a reduced view is no more accurate
  EXPECT_NEAR(matchSigma(wide, 2), std::pow(2, 1.5) * matchSigma(wide, 1), 1e-12);
}

TEST(OutlierRejection, FindsTheMotionOnAPlaneWithManyOutliers) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  const SE3 truth(expSO3(Eigen::Vector3d(0.01, -0.02, 0.015)), Eigen::Vector3d(0.04, -0.02, 0.03));
  for (const bool depth : {true, false}) {
    std::vector<PointPair> pairs;
    std::vector<char> good;
    for (int i = 0; i < 150; ++i) {
      PointPair pair;
      pair.xy_previous = Eigen::Vector2d(0.6 * unit(random), 0.45 * unit(random));
      const double z = 2.5;  // one plane: where the fundamental matrix degenerates
      const Eigen::Vector3d p = truth * Eigen::Vector3d(pair.xy_previous.x() * z, pair.xy_previous.y() * z, z);
      pair.xy_current = p.head<2>() / p.z() + 3e-4 * Eigen::Vector2d(unit(random), unit(random));
      pair.depth_previous = depth ? z : 0.0;
      good.push_back(i % 3 != 0);
      if (!good.back()) pair.xy_current += 0.1 * Eigen::Vector2d(unit(random) + 1.2, unit(random) - 1.2);
      pairs.push_back(pair);
    }
    // The gyro knows the rotation to a tenth of a degree.
    const SE3 guess(Eigen::Quaterniond(truth.rotation() * expQuaternion(Eigen::Vector3d(1e-3, -1e-3, 1e-3))),
                    Eigen::Vector3d::Zero());
    const RansacResult result = rejectOutliers(pairs, guess, RansacOptions());
    ASSERT_TRUE(result.ok);
    EXPECT_EQ(result.with_depth, depth);
    int right = 0, wrong = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      right += good[i] && result.inlier[i];
      wrong += !good[i] && result.inlier[i];
    }
    EXPECT_GE(right, 95);
    EXPECT_LE(wrong, depth ? 0 : 8);
    if (depth) EXPECT_LT((result.T_current_previous.t() - truth.t()).norm(), 2e-3);
  }
}

// At 60 to 70 degrees a pixel of a fisheye covers up to eight times as much of the normalised radius as in its centre.
TEST(OutlierRejection, AFisheyesPairsAreJudgedByPixels) {
  CameraIntrinsics intrinsics;
  intrinsics.model = DistortionModel::kEquidistant;
  intrinsics.width = 640, intrinsics.height = 480;
  intrinsics.fx = intrinsics.fy = 250;
  intrinsics.cx = 320, intrinsics.cy = 240;
  intrinsics.distortion = {0, 0, 0, 0};
  const std::shared_ptr<const CameraModel> fisheye = makeCamera(intrinsics);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::normal_distribution<double> noise(0, 0.3);
  const SE3 truth(expSO3(Eigen::Vector3d(0.01, -0.02, 0.015)), Eigen::Vector3d(0.04, -0.02, 0.03));
  for (const bool depth : {true, false}) {
    std::vector<PointPair> pairs;
    std::vector<char> good;
    while (pairs.size() < 150) {
      const Eigen::Vector2d uv(320 + 310 * unit(random), 240 + 230 * unit(random));
      PointPair pair;
      if (!fisheye->undistort(uv, &pair.xy_previous)) continue;
      const double z = 1.2 + 0.4 * unit(random);
      Eigen::Vector2d seen;
      if (!fisheye->project(truth * Eigen::Vector3d(z * pair.xy_previous.homogeneous()), &seen)) continue;
      good.push_back(pairs.size() % 5 != 0);
      seen += good.back() ? Eigen::Vector2d(noise(random), noise(random)) : Eigen::Vector2d(8, -9);
      if (!fisheye->undistort(seen, &pair.xy_current)) continue;
      fisheye->distort(pair.xy_current, &pair.pixels);
      pair.pixels /= fisheye->focal();
      pair.depth_previous = depth ? z : 0.0;
      pairs.push_back(pair);
    }
    good.resize(pairs.size());
    const SE3 guess(truth.rotation(), Eigen::Vector3d::Zero());
    RansacOptions options;
    options.threshold = 2.0 / fisheye->focal();
    const RansacResult result = rejectOutliers(pairs, guess, options);
    ASSERT_TRUE(result.ok);
    int right = 0, wrong = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      right += good[i] && result.inlier[i];
      wrong += !good[i] && result.inlier[i];
    }
    EXPECT_GE(right, 118) << depth;  // of 120
    EXPECT_LE(wrong, depth ? 0 : 8) << depth;
  }
}

TEST(FeatureTracker, FollowsThePlaneWithoutCreeping) {
  const cv::Mat texture = makeTexture();
  DepthNoise noise;
  FeatureTracker tracker(TrackingOptions(), testCamera(), noise, nullptr);
  const auto poseAt = [](int k) {
    return SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.006 * k, 0.002 * k, 0));
  };
  std::map<LandmarkId, Eigen::Vector2d> first;
  std::map<LandmarkId, int> born;
  for (int k = 0; k < 40; ++k) {
    const cv::Mat image = render(texture, poseAt(k).t(), 1.5, static_cast<unsigned>(k + 1));
    const cv::Mat depth(480, 640, CV_32FC1, cv::Scalar(2.0));
    const SE3 motion = k == 0 ? SE3() : poseAt(k).inverse() * poseAt(k - 1);
    const TrackingResult result = tracker.track(image, depth, {motion, 0, 0}, true, poseAt(k), nullptr, k);
    if (k > 0) EXPECT_GT(result.tracked, 150);
    tracker.replenish(poseAt(k), true, k);
    for (const Track& track : tracker.tracks()) {
      if (first.count(track.feature.id)) continue;
      first[track.feature.id] = track.feature.pixel.cast<double>();
      born[track.feature.id] = k;
    }
  }
  double sum = 0;
  int old = 0;
  for (const Track& track : tracker.tracks()) {
    if (track.feature.age < 25) continue;
    const Eigen::Vector3d moved = poseAt(born[track.feature.id]).t() - poseAt(39).t();
    const Eigen::Vector2d expected = first[track.feature.id] + kFocal / 2.0 * moved.head<2>();
    sum += (track.feature.pixel.cast<double>() - expected).squaredNorm();
    EXPECT_NEAR(track.feature.depth, 2.0, 1e-3);
    ++old;
  }
  ASSERT_GT(old, 60);
  EXPECT_LT(std::sqrt(sum / old), 0.12);  // px, after 25 images and more
}

// Bars one metre in front of the wall occlude the outer part of wide patches: these fall back to their narrow patch.
TEST(FeatureTracker, WhatCoversPartOfAWidePatchDoesNotMoveIt) {
  const cv::Mat texture = makeTexture();
  FeatureTracker tracker(TrackingOptions(), testCamera(), DepthNoise(), nullptr);
  const auto poseAt = [](int k) { return SE3(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.004 * k, 0, 0)); };
  std::map<LandmarkId, Eigen::Vector2d> first;
  constexpr int kBarEvery = 64, kBar = 24;
  for (int k = 0; k < 4; ++k) {
    cv::Mat image = render(texture, poseAt(k).t(), 1.0, k + 1), depth(480, 640, CV_32F, cv::Scalar(2.0));
    const cv::Mat other = render(texture, Eigen::Vector3d(1.3, 0.7, 0), 1.0, 20);
    for (int u = 0; k == 3 && u + kBar < 640; u += kBarEvery) {
      other.colRange(u, u + kBar).copyTo(image.colRange(u, u + kBar));
      depth.colRange(u, u + kBar).setTo(1.0);
    }
    const SE3 motion = k == 0 ? SE3() : poseAt(k).inverse() * poseAt(k - 1);
    tracker.track(image, depth, {motion, 0, 0}, true, poseAt(k), nullptr, k);
    if (k > 0) continue;
    tracker.replenish(poseAt(k), true, k);
    for (const Track& track : tracker.tracks()) first[track.feature.id] = track.feature.pixel.cast<double>();
  }
  double sum = 0;
  int covered = 0;
  for (const Track& track : tracker.tracks()) {
    const double u = track.feature.pixel.x(), from_bar = std::fmod(u, kBarEvery) - kBar;
    const double gap = std::min(from_bar, kBarEvery - kBar - from_bar);  // to the nearest bar
    if (gap < 7.5 || gap > 11) continue;
    EXPECT_FALSE(track.surface.wide) << u;
    const Eigen::Vector2d expected = first.at(track.feature.id) - Eigen::Vector2d(kFocal / 2.0 * 0.012, 0);
    sum += (track.feature.pixel.cast<double>() - expected).squaredNorm();
    ++covered;
  }
  ASSERT_GT(covered, 10);
  EXPECT_LT(std::sqrt(sum / covered), 0.08);  // px
}

TEST(FeatureTracker, PatchesStayWideThroughAnImageWithoutDepth) {
  const cv::Mat texture = makeTexture(), wall(480, 640, CV_32F, cv::Scalar(2.0));
  FeatureTracker tracker(TrackingOptions(), testCamera(), DepthNoise(), nullptr);
  for (int k = 0; k < 3; ++k) {
    const SE3 pose(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.004 * k, 0, 0));
    const SE3 motion(Eigen::Matrix3d::Identity(), Eigen::Vector3d(k == 0 ? 0 : -0.004, 0, 0));
    tracker.track(render(texture, pose.t(), 1.0, k + 1), k == 1 ? cv::Mat() : wall, {motion, 0, 0}, true, pose, nullptr,
                  k);
    if (k == 0) tracker.replenish(pose, true, k);
    if (k == 0) continue;
    int wide = 0;
    for (const Track& track : tracker.tracks()) wide += track.surface.wide;
    EXPECT_GT(wide, 100) << k;
  }
}

TEST(FeatureTracker, ATrackBeginsAnewWhenDepthFirstShowsItsSurface) {
  const cv::Mat texture = makeTexture();
  DepthNoise noise;
  FeatureTracker tracker(TrackingOptions(), testCamera(), noise, nullptr);
  const auto poseAt = [](int k) { return SE3(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.004 * k, 0, 0)); };
  const cv::Mat wall(480, 640, CV_32F, cv::Scalar(2.0)), nothing(480, 640, CV_32F, cv::Scalar(0.0));
  std::map<LandmarkId, float> blind, seeing;
  for (int k = 0; k < 12; ++k) {
    const cv::Mat image = render(texture, poseAt(k).t(), 1.0, k + 1);
    const SE3 motion = k == 0 ? SE3() : poseAt(k).inverse() * poseAt(k - 1);
    tracker.track(image, k < 6 ? nothing : wall, {motion, 0, 0}, true, poseAt(k), nullptr, k);
    if (k == 0) tracker.replenish(poseAt(k), true, k);
    for (const Track& track : tracker.tracks()) (k < 6 ? blind : seeing)[track.feature.id] = track.feature.pixel_sigma;
    if (k == 6) EXPECT_FALSE(tracker.ended().empty());
    if (k > 6) EXPECT_TRUE(tracker.ended().size() < 10) << k;  // tracks end only once
  }
  ASSERT_GT(blind.size(), 60u);
  ASSERT_GT(seeing.size(), 60u);
  int kept = 0, sharp = 0;
  for (const auto& [id, sigma] : seeing) {
    kept += blind.count(id);
    sharp += sigma < 0.1f;
  }
  EXPECT_LT(kept, static_cast<int>(seeing.size() / 20));
  EXPECT_GT(sharp, static_cast<int>(0.9 * seeing.size()));
  for (const auto& [id, sigma] : blind) EXPECT_GT(sigma, kSlidingPixelSigma) << id;
}

TEST(OrbExtractor, DescriptorsSurviveARotationAndTellPointsApart) {
  const cv::Mat image = render(makeTexture(), Eigen::Vector3d::Zero(), 1.0, 1);
  cv::Mat turned;
  const cv::Mat M = cv::getRotationMatrix2D(cv::Point2f(319.5f, 239.5f), 30, 1.0);
  cv::warpAffine(image, turned, M, image.size(), cv::INTER_LINEAR, cv::BORDER_REFLECT);
  std::vector<Feature> a, b;
  for (const Corner& corner : detectCorners(image, {}, 80, TrackingOptions())) {
    const double x = corner.pixel.x, y = corner.pixel.y;
    const Eigen::Vector2f p(static_cast<float>(M.at<double>(0, 0) * x + M.at<double>(0, 1) * y + M.at<double>(0, 2)),
                            static_cast<float>(M.at<double>(1, 0) * x + M.at<double>(1, 1) * y + M.at<double>(1, 2)));
    if (p.x() < 30 || p.y() < 30 || p.x() > 610 || p.y() > 450) continue;
    Feature f;
    f.pixel = Eigen::Vector2f(corner.pixel.x, corner.pixel.y);
    a.push_back(f);
    f.pixel = p;
    b.push_back(f);
  }
  const OrbExtractor orb(300);
  orb.describe(image, &a);
  orb.describe(turned, &b);
  ASSERT_GT(a.size(), 40u);
  int matched = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t best = 0;
    for (std::size_t j = 0; j < b.size(); ++j) {
      if (hammingDistance(a[i].descriptor, b[j].descriptor) < hammingDistance(a[i].descriptor, b[best].descriptor)) {
        best = j;
      }
    }
    matched += best == i;
  }
  EXPECT_GT(matched, static_cast<int>(0.8 * a.size()));
  const std::vector<Feature> corners = orb.extract(image, {cv::Point2f(300, 200)}, 50);
  EXPECT_GT(corners.size(), 150u);
  for (const Feature& f : corners) {
    EXPECT_EQ(f.id, kNoLandmark);
    EXPECT_GE((f.pixel - Eigen::Vector2f(300, 200)).norm(), 50);
  }
}

}  // namespace
}  // namespace vip_slam
