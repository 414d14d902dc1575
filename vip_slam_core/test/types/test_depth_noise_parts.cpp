// The two parts of the depth noise, found in the shape of surfaces.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "vip_slam_core/types/depth_noise_parts.h"

using namespace vip_slam;

namespace {

constexpr double kSigma = 0.006, kShared = 0.008;  // m, of the noise model

// A wall at 2 m seen by 12 x 9 samples. Its depth errs by white noise and by smooth waves of half a metre and more.
PlaneObservation wall(double white, double shared, std::mt19937* random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> phase(0, 2 * M_PI);
  const double px = phase(*random), py = phase(*random), length = 1.2 + 0.4 * std::cos(phase(*random));
  PlaneObservation seen;
  for (int k = 0; k < 108; ++k) {
    const double x = 0.12 * (k % 12), y = 0.12 * (k / 12);
    // Of unit variance over all phases.
    const double wave = 2 * std::sin(2 * M_PI * x / length + px) * std::sin(2 * M_PI * y / length + py);
    const Eigen::Vector3d p(x, y, 2 + white * normal(*random) + shared * wave);
    seen.points.push_back({p.cast<float>(), float(kSigma)});
    const Eigen::Vector4d h = p.homogeneous();
    seen.G += h * h.transpose() / (kSigma * kSigma);
  }
  seen.weight_scale = 1 / (1 + seen.G(3, 3) * kShared * kShared);
  seen.G *= seen.weight_scale;
  return seen;
}

DepthNoiseParts partsOf(double white, double shared, int surfaces) {
  std::mt19937 random(1);
  std::vector<DepthNoiseParts> shapes;
  for (int k = 0; k < surfaces; ++k) shapes.push_back(*surfaceShape(wall(white, shared, &random)));
  return depthNoiseParts(shapes);
}

}  // namespace

TEST(DepthNoiseParts, AnObservationKnowsWhatItsPointsShare) {
  std::mt19937 random(1);
  const PlaneObservation seen = wall(0, 0, &random);
  EXPECT_NEAR(sharedVariance(seen), kShared * kShared, 1e-12);
  PlaneObservation joint = seen;
  addPiece(seen, &joint);
  EXPECT_NEAR(sharedVariance(joint), kShared * kShared, 1e-12);
  EXPECT_NEAR(1 / joint.G(3, 3), kShared * kShared + kSigma * kSigma / 216, 1e-12);
  EXPECT_EQ(joint.points.size(), 216u);
}

TEST(DepthNoiseParts, WhiteDepthSharesNothing) {
  const DepthNoiseParts found = partsOf(0.5 * kSigma, 0, 200);
  EXPECT_NEAR(found.white, 0.25, 0.05);
  EXPECT_LT(found.shared, 0.05);
}

TEST(DepthNoiseParts, DepthThatBendsSharesItsErrors) {
  const DepthNoiseParts as_stated = partsOf(kSigma, kShared, 200), twice = partsOf(kSigma, 2 * kShared, 200);
  // To a factor of three in sigma: how much of an error bends a surface depends on its extent.
  EXPECT_GT(as_stated.shared, 1 / 9.0);
  EXPECT_LT(as_stated.shared, 9.0);
  EXPECT_NEAR(twice.shared / as_stated.shared, 4.0, 0.8);
}

TEST(DepthNoiseParts, FewSurfacesSayLittle) {
  EXPECT_EQ(depthNoiseParts(std::vector<DepthNoiseParts>()).shared, 1);
  EXPECT_GT(partsOf(0.5 * kSigma, 0, 2).shared, 0.4);
  PlaneObservation few;
  EXPECT_FALSE(surfaceShape(few));
}
