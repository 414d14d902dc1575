#include "dense_kernels.h"

#include <cstring>
#include <initializer_list>

#include "vip_slam_backend/solver/sparse_cholesky.h"

namespace vip_slam {

namespace baseline {
#define WIDTH 2
#define TILE_VECTORS 2
#define TILE_COLUMNS 4
#include "dense_kernels_body.inc"
#undef WIDTH
#undef TILE_VECTORS
#undef TILE_COLUMNS
}  // namespace baseline

#if defined(__x86_64__)
#pragma GCC push_options
#pragma GCC target("avx2,fma")
namespace avx2 {
#define WIDTH 4
#define TILE_VECTORS 2
#define TILE_COLUMNS 6
#include "dense_kernels_body.inc"
#undef WIDTH
#undef TILE_VECTORS
#undef TILE_COLUMNS
}  // namespace avx2
#pragma GCC pop_options

#pragma GCC push_options
#pragma GCC target("avx2,fma,avx512f,avx512dq,avx512vl,prefer-vector-width=512")
namespace avx512 {
#define WIDTH 8
#define TILE_VECTORS 2
#define TILE_COLUMNS 8
#include "dense_kernels_body.inc"
#undef WIDTH
#undef TILE_VECTORS
#undef TILE_COLUMNS
}  // namespace avx512
#pragma GCC pop_options
#endif

namespace {

const DenseKernels kBaseline{"baseline", baseline::factorPanel, baseline::negativeSyrk, baseline::backSubstitute,
                             baseline::extendAdd};
#if defined(__x86_64__)
const DenseKernels kAvx2{"avx2", avx2::factorPanel, avx2::negativeSyrk, avx2::backSubstitute, avx2::extendAdd};
const DenseKernels kAvx512{"avx512", avx512::factorPanel, avx512::negativeSyrk, avx512::backSubstitute,
                           avx512::extendAdd};
#endif

const DenseKernels& choose() {
  for (const char* name : {"avx512", "avx2"})
    if (const DenseKernels* kernels = denseKernelsByName(name)) return *kernels;
  return kBaseline;
}

}  // namespace

const DenseKernels* denseKernelsByName(const char* name) {
#if defined(__x86_64__)
  if (!std::strcmp(name, "avx512"))
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")
               ? &kAvx512
               : nullptr;
  if (!std::strcmp(name, "avx2"))
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? &kAvx2 : nullptr;
#endif
  return !std::strcmp(name, "baseline") ? &kBaseline : nullptr;
}

const DenseKernels& denseKernels() {
  static const DenseKernels& chosen = choose();
  return chosen;
}

}  // namespace vip_slam
