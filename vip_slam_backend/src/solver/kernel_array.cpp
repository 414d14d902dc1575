// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_backend/solver/kernel_array.h"

#include <cstring>
#include <new>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace vip_slam {

void KernelArray::resize(std::size_t count) {
  size_ = count;
  if (count <= capacity_) return;
  constexpr std::size_t kLine = 64, kHugePage = std::size_t{1} << 21;
  std::size_t bytes = count * sizeof(double);
  const std::size_t unit = bytes >= kHugePage / 2 ? kHugePage : kLine;
  bytes = (bytes + unit - 1) / unit * unit;
  data_.reset();
  data_.reset(static_cast<double*>(std::aligned_alloc(unit, bytes)));
  if (!data_) {
    size_ = capacity_ = 0;
    throw std::bad_alloc();
  }
  capacity_ = bytes / sizeof(double);
#if defined(__linux__)
  if (unit == kHugePage) madvise(data_.get(), bytes, MADV_HUGEPAGE);  // only advice: its result does not matter
#endif
}

void KernelArray::fillZero() {
  if (size_ > 0) std::memset(data_.get(), 0, size_ * sizeof(double));
}

}  // namespace vip_slam
