// SPDX-License-Identifier: BSD-3-Clause
// What real colour cameras do beyond a calibrated lens and white noise.
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "test_support.h"
#include "vip_slam_sim/render/light_baker.h"
#include "vip_slam_sim/rng.h"
#include "vip_slam_sim/scene/scene_builder.h"
#include "vip_slam_sim/sequence/camera_model_error.h"

namespace vip_slam {
namespace {

TEST(CameraModelError, IsTheGivenOneAndTheSensorFileDoesNotKnow) {
  for (const double px : {0.5, 1.0})
    for (const int seed : {1, 2, 3})
      for (const std::string model : {"none", "radtan"}) {
        CameraOptions o;
        o.model = model;
        const CameraIntrinsics stated = o.intrinsics(), real = CameraModelError(px, seed).trueCamera(stated);
        EXPECT_NEAR(CameraModelError::difference(stated, real), px, 0.02 * px);
        EXPECT_LT(std::abs(real.fx / stated.fx - 1), 0.02);
      }
  SequenceSpec spec = cleanSequence("smoke");
  spec.camera.model_error = 1;
  const SequenceRenderer s(spec, quickOptions());
  EXPECT_EQ(s.sensor().camera.fx, spec.camera.fx);
  EXPECT_NEAR(CameraModelError::difference(s.sensor().camera, s.camera()->intrinsics()), 1, 0.02);
  // Colour is the true camera's, depth that of the stated one.
  const SimFrame f = s.renderFrame(0);
  const auto stated = makeCamera(s.sensor().camera);
  double worst = 0;
  for (int v = 20; v < 460; v += 20)
    for (int u = 20; u < 620; u += 20) {
      const Eigen::Vector3d p = s.camera()->unproject({double(u), double(v)}, f.exact.depth.at<float>(v, u));
      Eigen::Vector2d uv;
      ASSERT_TRUE(stated->project(p, &uv));
      const cv::Rect around(int(uv.x()) - 1, int(uv.y()) - 1, 4, 4);
      double lo, hi;
      cv::minMaxLoc(f.depth(around), &lo, &hi);
      if (hi - lo < 60) worst = std::max(worst, std::max(lo - 1000 * p.z(), 1000 * p.z() - hi));
    }
  EXPECT_LT(worst, 25);  // white noise of 0.17 %
}

TEST(AutoExposure, FollowsTheSceneWithDelay) {
  std::vector<double> brightness(100, 0.1);
  for (std::size_t k = 50; k < 100; ++k) brightness[k] = 0.4;
  const AutoExposure control(brightness, 1.0, 0.01);
  const double before = control.at(4.9).gain, after = control.at(9.9).gain;
  EXPECT_NEAR(before * 0.1, 0.2, 0.02);
  EXPECT_NEAR(after * 0.4, 0.2, 0.02);
  EXPECT_NEAR(control.at(5.0).gain, before, 1e-9);  // the first bright image is too bright
  double reached = 0;
  for (double t = 5; t < 9 && reached == 0; t += 0.02)
    if (std::log(before / control.at(t).gain) > (1 - std::exp(-1)) * std::log(4.)) reached = t - 5;
  EXPECT_NEAR(reached, 0.4, 0.15);
  // Dark: the longest exposure and gain. Bright: a shorter exposure without.
  EXPECT_EQ(control.at(4).time, 0.01);
  EXPECT_NEAR(control.at(4).noise, std::sqrt(2.0), 0.1);
  EXPECT_NEAR(control.at(9.9).time, 0.005, 0.0006);
  EXPECT_EQ(control.at(9.9).noise, 1);
}

TEST(AutoExposure, KeepsARenderedSequenceAtItsLevel) {
  SequenceSpec spec = cleanSequence("real_03");
  const SequenceRenderer s(spec, quickOptions());
  for (int index = 0; index < s.frameCount(); index += s.frameCount() / 5) {
    const cv::Scalar mean = cv::mean(s.renderFrame(index).rgb);
    EXPECT_NEAR(mean[1], 110, 40) << index;
  }
}

TEST(Jpeg, LeavesStepsBetweenItsBlocks) {
  cv::Mat image(240, 320, CV_8UC3);
  Rng rng(4);
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u)
      for (int c = 0; c < 3; ++c)
        image.at<cv::Vec3b>(v, u)[c] =
            static_cast<unsigned char>(120 + 60 * std::sin(0.03 * u * u / 40) + 8 * rng.gauss());
  cv::Mat same = image.clone(), squeezed = image.clone();
  JpegCompression(0).apply(&same);
  EXPECT_EQ(cv::norm(image, same), 0);
  JpegCompression(30).apply(&squeezed);
  double across = 0, inside = 0;
  for (int v = 0; v < image.rows; ++v)
    for (int u = 8; u < image.cols - 8; u += 8) {
      const auto step = [&](int x) {
        return std::abs(squeezed.at<cv::Vec3b>(v, x)[1] - squeezed.at<cv::Vec3b>(v, x - 1)[1]) -
               std::abs(image.at<cv::Vec3b>(v, x)[1] - image.at<cv::Vec3b>(v, x - 1)[1]);
      };
      across += step(u);
      inside += step(u + 4);
    }
  EXPECT_GT(across, inside + 1000);
  EXPECT_GT(cv::norm(image, squeezed, cv::NORM_L1) / double(image.total() * 3), 1);
}

TEST(Gloss, ShowsALampWhereAMirrorWould) {
  SceneBuilder b("mirror");
  b.floor(-5, -5, 5, 5, 0, {-1, 1, rgb(0.3f, 0.3f, 0.3f)});
  const int ceiling = b.ceiling(-5, -5, 5, 5, 3, {-1, 1, rgb(0.3f, 0.3f, 0.3f)});
  b.ceilingLamp(ceiling, 7, 5, 0.3, 0.3, 5);  // at (2, 0, 3)
  auto scene = std::make_shared<Scene>(b.finish());
  auto tracer = std::make_shared<RayTracer>(*scene);
  bakeLight(scene.get(), *tracer, 1, 4);
  const auto camera = makeCamera(CameraOptions().intrinsics());
  const Renderer dull(scene, tracer, camera), shiny(scene, tracer, camera, 10);
  Eigen::Matrix3d R;  // looks along x, downwards
  R.col(2) = Eigen::Vector3d(1, 0, -1).normalized();
  R.col(0) = Eigen::Vector3d(0, -1, 0);
  R.col(1) = R.col(2).cross(R.col(0));
  for (const double x : {-1.0, -0.6}) {
    const SE3 T_W_C(R, Eigen::Vector3d(x, 0, 1.5));
    FrameBuffers a, c;
    dull.render(T_W_C, &a);
    shiny.render(T_W_C, &c);
    cv::Mat difference = c.radiance - a.radiance, channels[4];
    cv::split(difference, channels);
    cv::Point peak;
    cv::GaussianBlur(channels[0], channels[0], {0, 0}, 6);
    double most;
    cv::minMaxLoc(channels[0], nullptr, &most, nullptr, &peak);
    Eigen::Vector2d expected;
    ASSERT_TRUE(camera->project(T_W_C.inverse() * Eigen::Vector3d(2, 0, -3), &expected));
    EXPECT_NEAR(peak.x, expected.x(), 12);
    EXPECT_NEAR(peak.y, expected.y(), 12);
    EXPECT_GT(most, 0.003);
  }
}

}  // namespace
}  // namespace vip_slam
