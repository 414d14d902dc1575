// SPDX-License-Identifier: BSD-3-Clause
// Camera models: projection and its inverse over the whole image, Jacobians, scaling, bad intrinsics.
#include <gtest/gtest.h>

#include "vip_slam_core/camera/camera_model.h"
#include "vip_slam_core/testing/numeric_jacobian.h"

namespace vip_slam {
namespace {

using testing::numericJacobian;

CameraIntrinsics intrinsics(DistortionModel model, std::vector<double> distortion) {
  CameraIntrinsics k;
  k.width = 640, k.height = 480, k.fx = 460, k.fy = 455, k.cx = 318.3, k.cy = 243.1;
  k.model = model;
  k.distortion = std::move(distortion);
  return k;
}

struct Case {
  const char* name;
  CameraIntrinsics k;
};

class CameraTest : public ::testing::TestWithParam<Case> {
 protected:
  std::shared_ptr<const CameraModel> camera_ = makeCamera(GetParam().k);
};

TEST_P(CameraTest, PixelsThereAndBack) {
  for (double v = 0; v < 480; v += 13.7) {
    for (double u = 0; u < 640; u += 11.3) {
      Eigen::Vector2d xy;
      ASSERT_TRUE(camera_->undistort({u, v}, &xy)) << u << " " << v;
      EXPECT_LT((camera_->distort(xy) - Eigen::Vector2d(u, v)).norm(), 1e-6);
      const Eigen::Vector3d p = camera_->unproject({u, v}, 2.5);
      EXPECT_DOUBLE_EQ(p.z(), 2.5);
      Eigen::Vector2d uv;
      ASSERT_TRUE(camera_->project(p, &uv));
      EXPECT_LT((uv - Eigen::Vector2d(u, v)).norm(), 1e-6);
    }
  }
}

TEST_P(CameraTest, Jacobians) {
  for (double v = 3; v < 480; v += 53) {
    for (double u = 3; u < 640; u += 59) {
      const Eigen::Vector3d p = camera_->unproject({u, v}, 1.7);
      Eigen::Matrix<double, 2, 3> J;
      Eigen::Vector2d uv;
      ASSERT_TRUE(camera_->project(p, &uv, &J));
      const Eigen::MatrixXd numeric = numericJacobian(
          [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
            Eigen::Vector2d moved;
            camera_->project(p + Eigen::Vector3d(d), &moved);
            return moved;
          },
          3);
      EXPECT_LT((J - numeric).norm() / J.norm(), 1e-7) << u << " " << v;
      Eigen::Matrix2d J2;
      const Eigen::Vector2d xy = p.head<2>() / p.z();
      camera_->distort(xy, &J2);
      const Eigen::MatrixXd numeric2 = numericJacobian(
          [&](const Eigen::VectorXd& d) -> Eigen::VectorXd { return camera_->distort(xy + Eigen::Vector2d(d)); }, 2);
      EXPECT_LT((J2 - numeric2).norm() / J2.norm(), 1e-7);
    }
  }
  // At the optical axis, where fisheye formulas divide by the radius.
  Eigen::Matrix2d J2;
  camera_->distort(Eigen::Vector2d::Zero(), &J2);
  const Eigen::MatrixXd numeric = numericJacobian(
      [&](const Eigen::VectorXd& d) -> Eigen::VectorXd { return camera_->distort(Eigen::Vector2d(d)); }, 2, 1e-5);
  EXPECT_LT((J2 - numeric).norm() / J2.norm(), 1e-7);
}

TEST_P(CameraTest, RefusesPointsBehindAndBesideTheCamera) {
  Eigen::Vector2d uv;
  EXPECT_FALSE(camera_->project({0.1, 0.1, -1}, &uv));
  EXPECT_FALSE(camera_->project({0.1, 0.1, 0}, &uv));
  EXPECT_FALSE(camera_->project({NAN, 0, 1}, &uv));
  EXPECT_TRUE(camera_->inImage({0, 0}));
  EXPECT_FALSE(camera_->inImage({-0.1, 5}));
  EXPECT_TRUE(camera_->inImage({639, 479}));
  EXPECT_FALSE(camera_->inImage({639, 479}, 1));
}

TEST_P(CameraTest, ScalingKeepsRays) {
  const auto half = makeCamera(GetParam().k.scaled(320, 240));
  for (double v = 0; v < 480; v += 77) {
    for (double u = 0; u < 640; u += 91) {
      Eigen::Vector2d xy;
      ASSERT_TRUE(camera_->undistort({u, v}, &xy));
      // The image's corner lies half a pixel before the first centre, in both images.
      const Eigen::Vector2d expected = 0.5 * (Eigen::Vector2d(u, v).array() + 0.5) - 0.5;
      EXPECT_LT((half->distort(xy) - expected).norm(), 1e-6);
    }
  }
  EXPECT_NEAR(half->focal(), 0.5 * camera_->focal(), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(
    Models, CameraTest,
    ::testing::Values(
        Case{"pinhole", intrinsics(DistortionModel::kNone, {})},
        Case{"euroc", intrinsics(DistortionModel::kRadTan, {-0.28340811, 0.07395907, 1.9359e-4, 1.76187e-5})},
        Case{"five", intrinsics(DistortionModel::kRadTan, {0.12, -0.25, 1e-3, -8e-4, 0.09})},
        Case{"rational", intrinsics(DistortionModel::kRadTan, {0.55, -2.6, 5e-4, -2e-4, 1.5, 0.43, -2.4, 1.4})},
        Case{"fisheye", intrinsics(DistortionModel::kEquidistant, {-0.013, 0.021, -0.012, 0.0026})}),
    [](const ::testing::TestParamInfo<Case>& info) { return info.param.name; });

TEST(CameraFold, StrongBarrelDistortionIsNotFoldedBack) {
  const auto camera = makeCamera(intrinsics(DistortionModel::kRadTan, {-0.4, 0, 0, 0}));
  Eigen::Vector2d uv;
  EXPECT_TRUE(camera->project({0.8, 0, 1}, &uv));
  EXPECT_FALSE(camera->project({1.5, 0, 1}, &uv));  // beyond r = sqrt(1/1.2) the image would shrink again
  Eigen::Vector2d xy;
  EXPECT_FALSE(camera->undistort({318.3 + 460 * 0.7, 243}, &xy));  // r (1 - 0.4 r^2) never exceeds 0.61
  EXPECT_TRUE(xy.allFinite());
}

TEST(CameraFold, ModelsThatFoldTheImageOverAreRefused) {
  CameraIntrinsics k;
  k.width = 320, k.height = 240;
  k.fx = k.fy = 240;
  k.cx = 159.5, k.cy = 119.5;
  k.model = DistortionModel::kRadTan;
  k.distortion = {16.1704, 8.44953, 5.9e-05, -1.5e-05, 0.324469, 16.4805, 13.9441, 1.99604};
  EXPECT_NO_THROW(makeCamera(k));
  for (const std::vector<double>& wrong :
       {std::vector<double>{39.368, -99.463, 102.637, 39.186, -99.016}, {-3.0, 0, 0, 0, 0}}) {
    k.distortion = wrong;
    try {
      makeCamera(k);
      ADD_FAILURE() << wrong[0];
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("folds"), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("rational_polynomial"), std::string::npos) << error.what();
    }
  }
}

TEST(CameraIntrinsicsTest, NamesAndMistakes) {
  EXPECT_EQ(distortionModelFromName("plumb_bob"), DistortionModel::kRadTan);
  EXPECT_EQ(distortionModelFromName("rational_polynomial"), DistortionModel::kRadTan);
  EXPECT_EQ(distortionModelFromName("fisheye"), DistortionModel::kEquidistant);
  for (const auto model : {DistortionModel::kNone, DistortionModel::kRadTan, DistortionModel::kEquidistant}) {
    EXPECT_EQ(distortionModelFromName(distortionModelName(model)), model);
  }
  EXPECT_THROW(distortionModelFromName("barrel"), std::invalid_argument);

  CameraIntrinsics k = intrinsics(DistortionModel::kNone, {});
  EXPECT_EQ(k.validate(), "");
  k.fx = 0;
  EXPECT_NE(k.validate().find("fx"), std::string::npos);
  EXPECT_THROW(makeCamera(k), std::invalid_argument);
  k = intrinsics(DistortionModel::kRadTan, {0.1, 0.2, 0.3});
  EXPECT_NE(k.validate().find("has 3"), std::string::npos);
  k = intrinsics(DistortionModel::kEquidistant, {0.1, NAN, 0, 0});
  EXPECT_NE(k.validate().find("distortion[1]"), std::string::npos);
  k = intrinsics(DistortionModel::kEquidistant, {});
  EXPECT_NE(k.validate(), "");
  k = intrinsics(DistortionModel::kNone, {});
  k.height = -1;
  EXPECT_NE(k.validate().find("height"), std::string::npos);
  k.height = 480;
  k.cx = 5000;
  EXPECT_NE(k.validate().find("cx"), std::string::npos);
  EXPECT_THROW(intrinsics(DistortionModel::kNone, {}).scaled(0, 10), std::invalid_argument);
}

}  // namespace
}  // namespace vip_slam
