#include "plane_kernels.h"

#include <cstring>

#include "dense_kernels.h"

namespace vip_slam {

namespace plane_baseline {
#define WIDTH 2
#include "lane_algebra.inc"
#include "plane_kernels_body.inc"
#undef WIDTH
}  // namespace plane_baseline

#if defined(__x86_64__)
#pragma GCC push_options
#pragma GCC target("avx2,fma")
namespace plane_avx2 {
#define WIDTH 4
#include "lane_algebra.inc"
#include "plane_kernels_body.inc"
#undef WIDTH
}  // namespace plane_avx2
#pragma GCC pop_options

#pragma GCC push_options
#pragma GCC target("avx2,fma,avx512f,avx512dq,avx512vl,prefer-vector-width=512")
namespace plane_avx512 {
#define WIDTH 8
#include "lane_algebra.inc"
#include "plane_kernels_body.inc"
#undef WIDTH
}  // namespace plane_avx512
#pragma GCC pop_options
#endif

namespace {

const HomographyKernels kBaseline{plane_baseline::linearize, plane_baseline::cost};
#if defined(__x86_64__)
const HomographyKernels kAvx2{plane_avx2::linearize, plane_avx2::cost};
const HomographyKernels kAvx512{plane_avx512::linearize, plane_avx512::cost};
#endif

}  // namespace

const HomographyKernels& homographyKernels() {
#if defined(__x86_64__)
  if (!std::strcmp(denseKernels().name, "avx512")) return kAvx512;
  if (!std::strcmp(denseKernels().name, "avx2")) return kAvx2;
#endif
  return kBaseline;
}

}  // namespace vip_slam
