#include "point_kernels.h"

#include <cstring>

#include "dense_kernels.h"
#include "vip_slam_backend/factors/reprojection.h"

namespace vip_slam {

namespace point_baseline {
#define WIDTH 2
#include "point_kernels_body.inc"
#undef WIDTH
}  // namespace point_baseline

#if defined(__x86_64__)
#pragma GCC push_options
#pragma GCC target("avx2,fma")
namespace point_avx2 {
#define WIDTH 4
#include "point_kernels_body.inc"
#undef WIDTH
}  // namespace point_avx2
#pragma GCC pop_options

#pragma GCC push_options
#pragma GCC target("avx2,fma,avx512f,avx512dq,avx512vl")
namespace point_avx512 {
#define WIDTH 8
#include "point_kernels_body.inc"
#undef WIDTH
}  // namespace point_avx512
#pragma GCC pop_options
#endif

namespace {

const PointKernels kBaseline{"baseline",
                             point_baseline::linearize,
                             point_baseline::eliminate,
                             point_baseline::linearizeAndEliminate,
                             point_baseline::cost,
                             point_baseline::backSubstitute};
#if defined(__x86_64__)
const PointKernels kAvx2{
    "avx2",           point_avx2::linearize,     point_avx2::eliminate, point_avx2::linearizeAndEliminate,
    point_avx2::cost, point_avx2::backSubstitute};
const PointKernels kAvx512{
    "avx512",           point_avx512::linearize,     point_avx512::eliminate, point_avx512::linearizeAndEliminate,
    point_avx512::cost, point_avx512::backSubstitute};
#endif

}  // namespace

const PointKernels& pointKernels() {
#if defined(__x86_64__)
  if (!std::strcmp(denseKernels().name, "avx512")) return kAvx512;
  if (!std::strcmp(denseKernels().name, "avx2")) return kAvx2;
#endif
  return kBaseline;
}

}  // namespace vip_slam
