#include "imu_kernels.h"

#include <cstring>

#include "dense_kernels.h"

namespace vip_slam {

namespace imu_baseline {
#define WIDTH 2
#include "lane_algebra.inc"
#include "imu_kernels_body.inc"
#undef WIDTH
}  // namespace imu_baseline

#if defined(__x86_64__)
#pragma GCC push_options
#pragma GCC target("avx2,fma")
namespace imu_avx2 {
#define WIDTH 4
#include "lane_algebra.inc"
#include "imu_kernels_body.inc"
#undef WIDTH
}  // namespace imu_avx2
#pragma GCC pop_options

#pragma GCC push_options
#pragma GCC target("avx2,fma,avx512f,avx512dq,avx512vl,prefer-vector-width=512")
namespace imu_avx512 {
#define WIDTH 8
#include "lane_algebra.inc"
#include "imu_kernels_body.inc"
#undef WIDTH
}  // namespace imu_avx512
#pragma GCC pop_options
#endif

namespace {

const ImuKernels kBaseline{imu_baseline::linearize, imu_baseline::cost};
#if defined(__x86_64__)
const ImuKernels kAvx2{imu_avx2::linearize, imu_avx2::cost};
const ImuKernels kAvx512{imu_avx512::linearize, imu_avx512::cost};
#endif

}  // namespace

const ImuKernels& imuKernels() {
#if defined(__x86_64__)
  if (!std::strcmp(denseKernels().name, "avx512")) return kAvx512;
  if (!std::strcmp(denseKernels().name, "avx2")) return kAvx2;
#endif
  return kBaseline;
}

}  // namespace vip_slam
