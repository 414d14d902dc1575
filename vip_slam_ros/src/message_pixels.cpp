// SPDX-License-Identifier: BSD-3-Clause
#include "message_pixels.h"

namespace vip_slam {
namespace {

using Owner = boost::shared_ptr<const void>;

/// Gives back the owner instead of memory. Images made anew have OpenCV's own allocator.
class MessagePixels : public cv::MatAllocator {
 public:
  cv::UMatData* allocate(int dims, const int* sizes, int type, void* data, std::size_t* step, cv::AccessFlag flags,
                         cv::UMatUsageFlags usage) const override {
    return cv::Mat::getStdAllocator()->allocate(dims, sizes, type, data, step, flags, usage);
  }
  bool allocate(cv::UMatData* data, cv::AccessFlag, cv::UMatUsageFlags) const override { return data != nullptr; }
  void deallocate(cv::UMatData* data) const override {
    if (!data) return;
    delete static_cast<Owner*>(data->userdata);
    delete data;
  }
};

}  // namespace

cv::Mat withOwner(const cv::Mat& view, const Owner& owner) {
  static const MessagePixels pixels;
  cv::Mat image = view;
  image.u = new cv::UMatData(&pixels);
  image.u->data = image.u->origdata = view.data;
  image.u->size = view.step * std::size_t(view.rows);
  image.u->flags = cv::UMatData::USER_ALLOCATED;
  image.u->userdata = new Owner(owner);
  image.u->refcount = 1;
  return image;
}

}  // namespace vip_slam
