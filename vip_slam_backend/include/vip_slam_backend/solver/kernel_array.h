// SPDX-License-Identifier: BSD-3-Clause
// Arrays of doubles for the solver's kernels: aligned to cache lines, and large ones on huge pages, since a solver that
// is made for a single adjustment would spend a tenth of its time on the first touch of small pages.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>

namespace vip_slam {

class KernelArray {
 public:
  /// The old content is lost, the new content is undefined.
  void resize(std::size_t count);
  void fillZero();

  std::size_t size() const { return size_; }
  double* data() { return data_.get(); }
  const double* data() const { return data_.get(); }

 private:
  struct Free {
    void operator()(double* p) const { std::free(p); }
  };
  std::unique_ptr<double[], Free> data_;
  std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace vip_slam
