// Where in an image things move by themselves, as far as its tracks tell: beside a point that does not follow the
// camera's motion, and as far away as that, when no point that does is nearer.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace vip_slam {

class MovingRegions {
 public:
  /// A tracked point of the image, its depth in metres (0: none), and whether the camera's motion explains it.
  void add(const Eigen::Vector2f& pixel, double z, bool still);
  /// Whether what is seen at `pixel` in a depth of `z` (0: unknown) moves. False everywhere when only stray points do
  /// not follow: those are mismatches.
  bool moves(const Eigen::Vector2d& pixel, double z) const;
  /// There is more than stray points.
  bool any() const;

 private:
  struct Mark {
    Eigen::Vector2f pixel;
    float z;
  };
  /// Squared distance to the nearest mark, px^2.
  static float nearest(const std::vector<Mark>& marks, const Eigen::Vector2f& pixel, const Mark** mark);

  std::vector<Mark> still_, moving_;
};

}  // namespace vip_slam
