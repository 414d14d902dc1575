// A depth camera that has stopped goes on with its last image under new stamps.
#pragma once

#include <vector>

#include <opencv2/core.hpp>

namespace vip_slam {

class FrozenDepth {
 public:
  /// Whether this image is the one given before, pixel by pixel, as far as a sample of them tells. One that has hardly
  /// any depth may be.
  bool repeats(const cv::Mat& depth);
  void clear() { last_.clear(); }

 private:
  std::vector<float> last_;
};

}  // namespace vip_slam
