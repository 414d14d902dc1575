// SPDX-License-Identifier: BSD-3-Clause
// Images against geometry: warping, optical flow, noise, determinism.
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "test_support.h"

namespace vip_slam {
namespace {

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + static_cast<long>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

cv::Mat gray(const SimFrame& f) {
  cv::Mat out;
  cv::cvtColor(f.rgb, out, cv::COLOR_RGB2GRAY);
  return out;
}

/// Where pixel (u, v) of frame a appears in frame b; false when hidden or outside.
bool carry(const SequenceRenderer& s, const SimFrame& a, const SimFrame& b, const Eigen::Vector2d& uv,
           Eigen::Vector2d* out) {
  const float z = a.exact.depth.at<float>(static_cast<int>(uv.y() + 0.5), static_cast<int>(uv.x() + 0.5));
  if (z <= 0) return false;
  const Eigen::Vector3d p_W = a.T_W_C * s.camera()->unproject(uv, z);
  const Eigen::Vector3d p_b = b.T_W_C.inverse() * p_W;
  if (!s.camera()->project(p_b, out) || !s.camera()->inImage(*out, 4)) return false;
  const float seen = b.exact.depth.at<float>(static_cast<int>(out->y() + 0.5), static_cast<int>(out->x() + 0.5));
  return std::abs(seen - p_b.z()) < 0.02 + 0.02 * p_b.z();
}

class Rendering : public testing::TestWithParam<const char*> {};

TEST_P(Rendering, FrameWarpedByDepthAndPoseMatchesLaterFrame) {
  SequenceRenderer s(cleanSequence(GetParam()), quickOptions());
  const SimFrame a = s.renderFrame(80), b = s.renderFrame(86);
  const cv::Mat ga = gray(a), gb = gray(b);
  cv::Mat smooth_b;
  gb.convertTo(smooth_b, CV_32F);
  std::vector<double> differences;
  int pixels = 0, hidden = 0;
  for (int v = 5; v < ga.rows - 5; v += 3)
    for (int u = 5; u < ga.cols - 5; u += 3) {
      ++pixels;
      Eigen::Vector2d q;
      if (!carry(s, a, b, {double(u), double(v)}, &q)) {
        ++hidden;
        continue;
      }
      cv::Mat patch;
      cv::getRectSubPix(smooth_b, {1, 1}, cv::Point2f(float(q.x()), float(q.y())), patch);
      differences.push_back(std::abs(patch.at<float>(0, 0) - ga.at<unsigned char>(v, u)));
    }
  const double share = std::count_if(differences.begin(), differences.end(), [](double d) { return d < 8; }) /
                       static_cast<double>(differences.size());
  std::printf("  %s: median difference %.2f grey levels, %.1f %% below 8, %d of %d hidden or outside\n", GetParam(),
              median(differences), 100 * share, hidden, pixels);
  EXPECT_LT(median(differences), 1.5);
  EXPECT_GT(share, 0.95);
  EXPECT_LT(hidden, pixels / 2);
}

TEST_P(Rendering, KltFlowAgreesWithTrueFlow) {
  SequenceRenderer s(cleanSequence(GetParam()), quickOptions());
  const SimFrame a = s.renderFrame(80), b = s.renderFrame(81);
  const cv::Mat ga = gray(a), gb = gray(b);
  std::vector<cv::Point2f> from, to;
  cv::goodFeaturesToTrack(ga, from, 300, 0.005, 8);
  std::vector<cv::Point2f> guess;
  std::vector<unsigned char> ok;
  std::vector<float> score;
  cv::calcOpticalFlowPyrLK(ga, gb, from, to, ok, score, {15, 15}, 3);
  std::vector<double> error;
  for (std::size_t i = 0; i < from.size(); ++i) {
    Eigen::Vector2d q;
    if (!ok[i] || !carry(s, a, b, {from[i].x, from[i].y}, &q)) continue;
    // Corners at a depth step move exactly with neither surface.
    const cv::Mat near =
        a.exact.depth(cv::Rect(int(from[i].x) - 4, int(from[i].y) - 4, 9, 9) & cv::Rect(0, 0, ga.cols, ga.rows));
    double lo, hi;
    cv::minMaxLoc(near, &lo, &hi);
    if (hi - lo > 0.1 * lo) continue;
    error.push_back(std::hypot(to[i].x - q.x(), to[i].y - q.y()));
  }
  ASSERT_GT(error.size(), 40u);
  std::printf("  %s: %zu corners, median |KLT - truth| %.3f px\n", GetParam(), error.size(), median(error));
  EXPECT_LT(median(error), 0.12);
}

INSTANTIATE_TEST_SUITE_P(Scenes, Rendering, testing::Values("01", "07", "10", "fisheye"));

TEST(Depth, LiesOnTheTruePlanesAndCarriesTheConfiguredNoise) {
  SequenceSpec spec = cleanSequence("07");
  SequenceRenderer s(spec, quickOptions());
  const SimFrame f = s.renderFrame(100);
  // Exact depth on the planes it came from.
  double worst = 0;
  for (int v = 0; v < 480; v += 7)
    for (int u = 0; u < 640; u += 7) {
      const int piece = f.exact.piece.at<int>(v, u);
      if (piece < 0) continue;
      const Chart& c = s.scene().charts[s.scene().pieces[piece].chart];
      const Eigen::Vector3d p = f.T_W_C * s.camera()->unproject({double(u), double(v)}, f.exact.depth.at<float>(v, u));
      worst = std::max(worst,
                       std::abs((p - Eigen::Vector3d(c.o.x, c.o.y, c.o.z)).dot(Eigen::Vector3d(c.n.x, c.n.y, c.n.z))));
    }
  EXPECT_LT(worst, 1e-4);
  // Noise: sigma = 0.17 % of depth (millimetre rounding adds 0.29 mm).
  double sum = 0, mean = 0;
  int n = 0;
  for (int v = 0; v < 480; ++v)
    for (int u = 0; u < 640; ++u) {
      const double z = f.exact.depth.at<float>(v, u);
      if (z < 1.5 || z > 7.5) continue;
      const double e = (0.001 * f.depth.at<std::uint16_t>(v, u) - z) / z;
      sum += e * e;
      mean += e;
      ++n;
    }
  ASSERT_GT(n, 50000);
  std::printf("  depth noise %.4f %% of depth, mean %.5f %%\n", 100 * std::sqrt(sum / n), 100 * mean / n);
  EXPECT_NEAR(std::sqrt(sum / n), 0.0017, 0.00006);
  EXPECT_NEAR(mean / n, 0, 5e-5);
}

TEST(Depth, HardModelLosesEdgesDarkAndGrazing) {
  SequenceSpec spec = cleanSequence("06_tof");
  SequenceRenderer s(spec, quickOptions());
  const SimFrame f = s.renderFrame(100);
  int plain = 0, plain_lost = 0, edge = 0, edge_bad = 0;
  for (int v = 2; v < 478; ++v)
    for (int u = 2; u < 638; ++u) {
      const double z = f.exact.depth.at<float>(v, u);
      const int mm = f.depth.at<std::uint16_t>(v, u);
      if (z > spec.depth.max_range || z < spec.depth.min_range) {
        EXPECT_EQ(mm, 0);
        continue;
      }
      double lo, hi;
      cv::minMaxLoc(f.exact.depth(cv::Rect(u - 1, v - 1, 3, 3)), &lo, &hi);
      const cv::Vec3b c = f.rgb.at<cv::Vec3b>(v, u);
      const bool bright = c[0] + c[1] + c[2] > 300, steep = f.exact.grazing.at<float>(v, u) > 0.4;
      if (hi - lo > 0.2) {
        ++edge;
        edge_bad += mm == 0 || std::abs(0.001 * mm - z) > 0.1;
      } else if (hi - lo < 0.03 && bright && steep) {
        ++plain;
        plain_lost += mm == 0;
      }
    }
  ASSERT_GT(plain, 5000);
  ASSERT_GT(edge, 100);
  EXPECT_NEAR(plain_lost / double(plain), spec.depth.dropout, 0.01);
  EXPECT_GT(edge_bad / double(edge), 0.4);
}

TEST(Depth, OwnDepthCameraSeesFromItsOwnPlace) {
  SequenceSpec spec = cleanSequence("own_depth_camera");
  spec.depth.b = 0;
  SequenceRenderer s(spec, quickOptions());
  const SimFrame f = s.renderFrame(50);
  const auto camera = makeCamera(s.sensor().depth_camera);
  const SE3 T_W_D = f.T_W_C * s.sensor().T_color_depth;
  // Carried into the colour image, its points agree with what the colour camera sees.
  int good = 0, all = 0;
  for (int v = 10; v < 470; v += 11)
    for (int u = 10; u < 630; u += 11) {
      const double z = 0.001 * f.depth.at<std::uint16_t>(v, u);
      Eigen::Vector2d q;
      const Eigen::Vector3d p = f.T_W_C.inverse() * (T_W_D * camera->unproject({double(u), double(v)}, z));
      if (z == 0 || !s.camera()->project(p, &q) || !s.camera()->inImage(q, 2)) continue;
      ++all;
      good += std::abs(f.exact.depth.at<float>(static_cast<int>(q.y() + 0.5), static_cast<int>(q.x() + 0.5)) - p.z()) <
              0.01 + 0.01 * p.z();
    }
  ASSERT_GT(all, 1500);
  EXPECT_GT(good, 0.97 * all);
}

TEST(Colour, NoiseMatchesTheConfiguration) {
  SequenceSpec clean = cleanSequence("07"), noisy = clean;
  noisy.effects.read_noise = 1.5;
  noisy.effects.shot_noise = 0.8;
  SequenceRenderer a(clean, quickOptions()), b(noisy, quickOptions());
  const SimFrame fa = a.renderFrame(60), fb = b.renderFrame(60);
  double sum = 0, want = 0;
  int n = 0;
  for (int v = 0; v < 480; ++v)
    for (int u = 0; u < 640; ++u)
      for (int c = 0; c < 3; ++c) {
        const int x = fa.rgb.at<cv::Vec3b>(v, u)[c], y = fb.rgb.at<cv::Vec3b>(v, u)[c];
        if (x < 20 || x > 235) continue;
        sum += (y - x) * (y - x);
        want += std::pow(1.5 + 0.8 * x / 255.0, 2) + 1.0 / 12 + 1.0 / 12;
        ++n;
      }
  ASSERT_GT(n, 100000);
  EXPECT_NEAR(std::sqrt(sum / want), 1.0, 0.03);
}

TEST(Sequence, SameSeedSameBytesWhateverTheThreads) {
  const SequenceSpec spec = loadSequence("09", libraryPath());
  RenderOptions one = quickOptions(70, 4), two = quickOptions(70, 4);
  one.threads = 1;
  two.threads = 3;
  std::vector<SimFrame> a, b;
  SequenceRenderer ra(spec, one), rb(spec, two);
  ra.render([&](const SimFrame& f) {
    a.push_back(f);
    return true;
  });
  rb.render([&](const SimFrame& f) {
    b.push_back(f);
    return true;
  });
  ASSERT_EQ(a.size(), 4u);
  ASSERT_EQ(b.size(), 4u);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(cv::norm(a[i].rgb, b[i].rgb, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(a[i].depth, b[i].depth, cv::NORM_INF), 0);
    EXPECT_EQ(a[i].stamp_ns, b[i].stamp_ns);
  }
  SequenceSpec other = spec;
  other.seed += 1;
  other.motion = spec.motion;
  SequenceRenderer rc(other, one);
  EXPECT_GT(cv::norm(a[0].rgb, rc.renderFrame(70).rgb, cv::NORM_INF), 0);
}

TEST(Sequence, RollingShutterAndTimeOffsetShiftWhatTheyShould) {
  SequenceSpec spec = cleanSequence("time_offset");
  SequenceRenderer s(spec, quickOptions());
  const SimFrame f = s.renderFrame(50);
  const SE3 want = s.trajectory().at(s.toSeconds(f.stamp_ns) + spec.imu.time_offset).T_W_I * s.sensor().T_imu_cam;
  EXPECT_LT((want.t() - f.T_W_C.t()).norm(), 1e-8);

  SequenceSpec rolling = cleanSequence("rolling");
  SequenceRenderer r(rolling, quickOptions());
  const SimFrame g = r.renderFrame(100);
  const double t = r.toSeconds(g.stamp_ns);
  double worst = 0;
  for (int v : {40, 240, 440})  // every row shows the scene at its own readout time
    for (int u = 20; u < 640; u += 50) {
      const SE3 T =
          r.trajectory().at(t + rolling.effects.rolling_shutter * ((v + 0.5) / 480 - 0.5)).T_W_I * r.sensor().T_imu_cam;
      const Chart& c = r.scene().charts[r.scene().pieces[g.exact.piece.at<int>(v, u)].chart];
      const Eigen::Vector3d p = T * r.camera()->unproject({double(u), double(v)}, g.exact.depth.at<float>(v, u));
      worst = std::max(worst,
                       std::abs((p - Eigen::Vector3d(c.o.x, c.o.y, c.o.z)).dot(Eigen::Vector3d(c.n.x, c.n.y, c.n.z))));
    }
  EXPECT_LT(worst, 1e-4);
}

TEST(Sequence, DepthThatLagsByAnImageIsTheNextOnes) {
  SequenceSpec spec = cleanSequence("unsynchronised");
  spec.depth.a = spec.depth.b = 0;
  SequenceSpec together = spec;
  together.depth.lag = 0;
  spec.depth.lag = 1 / spec.camera.rate;
  SequenceRenderer later(spec, quickOptions()), now(together, quickOptions());
  const SimFrame f = later.renderFrame(100), next = now.renderFrame(101);
  EXPECT_EQ(f.depth_stamp_ns, next.stamp_ns);
  EXPECT_EQ(next.depth_stamp_ns, next.stamp_ns);
  EXPECT_EQ(cv::norm(f.depth, next.depth, cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(f.depth, now.renderFrame(100).depth, cv::NORM_INF), 100);
}

TEST(Sequence, ExposureJumpsToAndFroAtItsInterval) {
  SequenceSpec spec = cleanSequence("smoke");
  spec.effects.exposure = 1.0;
  spec.effects.exposure_jump = 2.0;
  spec.effects.exposure_jump_interval = 0.5;
  const auto camera = makeCamera(spec.camera.intrinsics());
  const SensorEffects effects(spec.effects, spec.depth, *camera, spec.seed);
  FrameBuffers frame;
  frame.radiance = cv::Mat(480, 640, CV_32FC4, cv::Scalar::all(0.2));
  std::vector<double> level;  // linear
  for (int k = 0; k < 40; ++k) level.push_back(std::pow(cv::mean(effects.colour(frame, k, 0.05 * k + 0.025))[0], 2));
  for (int k = 1; k < 40; ++k) {
    const double ratio = std::max(level[k] / level[k - 1], level[k - 1] / level[k]);
    EXPECT_NEAR(ratio, k % 10 == 0 ? 2.0 : 1.0, 0.05) << k;
  }
}

TEST(Sequence, MotionBlurSmearsAlongTheFlow) {
  SequenceSpec sharp = cleanSequence("10"), blurred = sharp;
  blurred.effects.motion_blur = true;
  blurred.effects.exposure_time = 0.012;
  SequenceRenderer a(sharp, quickOptions()), b(blurred, quickOptions());
  const cv::Mat ga = gray(a.renderFrame(300)), gb = gray(b.renderFrame(300));
  cv::Mat la, lb;
  cv::Laplacian(ga, la, CV_32F);
  cv::Laplacian(gb, lb, CV_32F);
  EXPECT_LT(cv::norm(lb), 0.8 * cv::norm(la));
  // Blur causes no shift: sharp and blurred pictures agree at low resolution.
  cv::GaussianBlur(ga, ga, {0, 0}, 8);
  cv::GaussianBlur(gb, gb, {0, 0}, 8);
  EXPECT_LT(cv::norm(ga, gb, cv::NORM_L1) / (640 * 480), 1.5);
}

TEST(PassersBy, HideTheSceneAndNothingElse) {
  SequenceSpec spec = cleanSequence("06_walkers");
  spec.depth.b = 0;
  const SequenceRenderer with(spec, quickOptions());
  spec.passers.count = 0;
  const SequenceRenderer without(spec, quickOptions());
  const SimFrame a = with.renderFrame(40), b = without.renderFrame(40);
  EXPECT_EQ(cv::norm(a.rgb, b.rgb, cv::NORM_INF), 0);  // they come later
  const SimFrame c = with.renderFrame(140), d = without.renderFrame(140);
  EXPECT_EQ(with.stateAt(7.0).T_W_I.t(), without.stateAt(7.0).T_W_I.t());
  int hidden = 0, wrong = 0;
  for (int v = 0; v < c.exact.depth.rows; ++v)
    for (int u = 0; u < c.exact.depth.cols; ++u) {
      const float before = d.exact.depth.at<float>(v, u), after = c.exact.depth.at<float>(v, u);
      const bool body = c.exact.piece.at<int>(v, u) < 0;
      hidden += body;
      wrong += body ? after >= before || after < 0.5 || after > 3 : after != before;
    }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(hidden, 0.05 * c.exact.depth.total());
  EXPECT_LT(hidden, 0.6 * c.exact.depth.total());
  EXPECT_EQ(cv::norm(with.renderFrame(140).rgb, c.rgb, cv::NORM_INF), 0);
}

TEST(PassersBy, WhatGoesByFillsTheViewAndIsGone) {
  const SequenceSpec spec = cleanSequence("06_blocked");
  const SequenceRenderer sequence(spec, quickOptions());
  const auto share = [&](double t) {
    const SimFrame f = sequence.renderFrame(static_cast<int>(t * spec.camera.rate));
    return cv::countNonZero(f.exact.piece < 0) / static_cast<double>(f.exact.piece.total());
  };
  EXPECT_LT(share(3.8), 0.01);
  EXPECT_GT(share(6.0), 0.9);
  EXPECT_LT(share(11.0), 0.01);
  EXPECT_GT(share(14.0), 0.9);
}

}  // namespace
}  // namespace vip_slam
