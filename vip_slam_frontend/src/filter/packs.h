// SPDX-License-Identifier: BSD-3-Clause
// Vector arithmetic of the filter's kernels: packs of four doubles, and functions compiled for AVX2, too, chosen at run
// time. For inclusion by these kernels' sources only.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define VIP_SLAM_VECTOR_CLONES __attribute__((target_clones("arch=haswell", "default")))
#else
#define VIP_SLAM_VECTOR_CLONES
#endif

namespace vip_slam {

// Four doubles, unaligned. Never crosses a function boundary, so the calling convention does not matter.
typedef double Pack __attribute__((vector_size(32), aligned(8), may_alias));

#define VIP_SLAM_INLINE inline __attribute__((always_inline))

VIP_SLAM_INLINE Pack load(const double* p) { return *reinterpret_cast<const Pack*>(p); }
VIP_SLAM_INLINE void store(double* p, Pack value) { *reinterpret_cast<Pack*>(p) = value; }
VIP_SLAM_INLINE Pack spread(double x) { return Pack{x, x, x, x}; }
VIP_SLAM_INLINE double total(Pack s) { return (s[0] + s[1]) + (s[2] + s[3]); }

VIP_SLAM_INLINE double dot(const double* a, const double* b, int n) {
  Pack s0 = spread(0), s1 = spread(0);
  int i = 0;
  for (; i + 8 <= n; i += 8) {
    s0 += load(a + i) * load(b + i);
    s1 += load(a + i + 4) * load(b + i + 4);
  }
  double sum = total(s0 + s1);
  for (; i < n; ++i) sum += a[i] * b[i];
  return sum;
}

VIP_SLAM_INLINE void subtractScaled(double* a, const double* b, double scale, int n) {
  const Pack s = spread(scale);
  int i = 0;
  for (; i + 4 <= n; i += 4) store(a + i, load(a + i) - s * load(b + i));
  for (; i < n; ++i) a[i] -= scale * b[i];
}

}  // namespace vip_slam
