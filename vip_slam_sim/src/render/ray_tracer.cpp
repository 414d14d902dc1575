// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_sim/render/ray_tracer.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace vip_slam {
namespace {

#if RTC_VERSION_MAJOR >= 4
using Query = RTCIntersectArguments;

Query makeQuery(bool coherent) {
  Query query;
  rtcInitIntersectArguments(&query);
  query.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
  return query;
}
#define VIP_SLAM_INTERSECT(n) rtcIntersect##n(valid, scene, hit, query)
#else
using Query = RTCIntersectContext;

Query makeQuery(bool coherent) {
  Query query;
  rtcInitIntersectContext(&query);
  query.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  return query;
}
#define VIP_SLAM_INTERSECT(n) rtcIntersect##n(valid, scene, query, hit)
#endif

template <int N>
struct Packet;
template <>
struct Packet<4> {
  using Type = RTCRayHit4;
  static void call(const int* valid, RTCScene scene, Query* query, Type* hit) { VIP_SLAM_INTERSECT(4); }
};
template <>
struct Packet<8> {
  using Type = RTCRayHit8;
  static void call(const int* valid, RTCScene scene, Query* query, Type* hit) { VIP_SLAM_INTERSECT(8); }
};
template <>
struct Packet<16> {
  using Type = RTCRayHit16;
  static void call(const int* valid, RTCScene scene, Query* query, Type* hit) { VIP_SLAM_INTERSECT(16); }
};

template <int N>
void trace(RTCScene scene, int pieces, RayBatch* rays, std::size_t n, float near, bool coherent) {
  Query query = makeQuery(coherent);
  typename Packet<N>::Type packet;
  alignas(64) int valid[N];
  for (std::size_t i = 0; i < n; i += N) {
    const int count = static_cast<int>(std::min<std::size_t>(N, n - i));
    for (int k = 0; k < N; ++k) {
      const std::size_t j = i + std::min(k, count - 1);
      valid[k] = k < count ? -1 : 0;
      packet.ray.org_x[k] = rays->ox[j];
      packet.ray.org_y[k] = rays->oy[j];
      packet.ray.org_z[k] = rays->oz[j];
      packet.ray.dir_x[k] = rays->dx[j];
      packet.ray.dir_y[k] = rays->dy[j];
      packet.ray.dir_z[k] = rays->dz[j];
      packet.ray.tnear[k] = near;
      packet.ray.tfar[k] = rays->t[j];
      packet.ray.time[k] = 0;
      packet.ray.mask[k] = 0xFFFFFFFFu;
      packet.ray.id[k] = 0;
      packet.ray.flags[k] = 0;
      packet.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    }
    Packet<N>::call(valid, scene, &query, &packet);
    for (int k = 0; k < count; ++k) {
      rays->t[i + k] = packet.ray.tfar[k];
      // Pieces are two primitives each, triangles of a mesh, which follow them, one.
      const int hit = static_cast<int>(packet.hit.primID[k]);
      rays->piece[i + k] = packet.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID ? -1
                           : hit < 2 * pieces                              ? hit / 2
                                                                           : hit - pieces;
    }
  }
}

}  // namespace

void RayBatch::resize(std::size_t n) {
  for (auto* v : {&ox, &oy, &oz, &dx, &dy, &dz, &t}) v->resize(n);
  piece.resize(n);
}

void RayBatch::set(std::size_t i, const Vec3& o, const Vec3& d, float far) {
  ox[i] = o.x;
  oy[i] = o.y;
  oz[i] = o.z;
  dx[i] = d.x;
  dy[i] = d.y;
  dz[i] = d.z;
  t[i] = far;
}

struct RayTracer::Impl {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  int width = 4, pieces = 0;
  ~Impl() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
};

RayTracer::RayTracer(const Scene& scene) : impl_(new Impl) {
  impl_->device = rtcNewDevice("threads=1");
  if (!impl_->device)
    throw std::runtime_error("Embree: no device (error " + std::to_string(rtcGetDeviceError(nullptr)) + ")");
  if (rtcGetDeviceProperty(impl_->device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED))
    impl_->width = 16;
  else if (rtcGetDeviceProperty(impl_->device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED))
    impl_->width = 8;
  impl_->scene = rtcNewScene(impl_->device);
  rtcSetSceneBuildQuality(impl_->scene, RTC_BUILD_QUALITY_HIGH);
  rtcSetSceneFlags(impl_->scene, RTC_SCENE_FLAG_ROBUST);
  RTCGeometry mesh = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  const std::size_t n = scene.pieces.size(), meshed = scene.triangles.size();
  impl_->pieces = static_cast<int>(n);
  auto* vertex = static_cast<float*>(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                             3 * sizeof(float), 4 * n + scene.vertices.size()));
  auto* index = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), 2 * n + meshed));
  if (!vertex || !index)
    throw std::runtime_error("Embree: no buffers (error " + std::to_string(rtcGetDeviceError(impl_->device)) + ")");
  for (std::size_t i = 0; i < n; ++i) {
    const Piece& p = scene.pieces[i];
    const Chart& c = scene.charts[p.chart];
    const float uv[4][2] = {{p.u0, p.v0}, {p.u1, p.v0}, {p.u1, p.v1}, {p.u0, p.v1}};
    for (const auto& corner : uv) {
      const Vec3 x = c.o + c.eu * corner[0] + c.ev * corner[1];
      *vertex++ = x.x;
      *vertex++ = x.y;
      *vertex++ = x.z;
    }
    const unsigned base = static_cast<unsigned>(4 * i);
    for (unsigned k : {0u, 1u, 2u, 0u, 2u, 3u}) *index++ = base + k;
  }
  for (const MeshVertex& v : scene.vertices) {
    *vertex++ = v.p.x;
    *vertex++ = v.p.y;
    *vertex++ = v.p.z;
  }
  for (const MeshTriangle& t : scene.triangles)
    for (int v : t.vertex) *index++ = static_cast<unsigned>(4 * n) + static_cast<unsigned>(v);
  rtcCommitGeometry(mesh);
  rtcAttachGeometry(impl_->scene, mesh);
  rtcReleaseGeometry(mesh);
  rtcCommitScene(impl_->scene);
  const RTCError error = rtcGetDeviceError(impl_->device);
  if (error != RTC_ERROR_NONE)
    throw std::runtime_error("Embree: building scene '" + scene.name + "' failed (error " + std::to_string(error) +
                             ")");
}

RayTracer::~RayTracer() = default;

void RayTracer::intersect(RayBatch* rays, std::size_t n, float near, bool coherent) const {
  if (impl_->width == 16)
    trace<16>(impl_->scene, impl_->pieces, rays, n, near, coherent);
  else if (impl_->width == 8)
    trace<8>(impl_->scene, impl_->pieces, rays, n, near, coherent);
  else
    trace<4>(impl_->scene, impl_->pieces, rays, n, near, coherent);
}

float RayTracer::clearance(const Vec3& point, float radius) const {
  // Samples directions over the sphere, which suffices as walls and furniture are much larger than the rays' spacing
  // at half a metre.
  constexpr int kRays = 256;
  RayBatch rays;
  rays.resize(kRays);
  for (int i = 0; i < kRays; ++i) {
    const float z = 1 - 2 * (static_cast<float>(i) + 0.5f) / kRays, r = std::sqrt(1 - z * z);
    const float a = 2.39996323f * static_cast<float>(i);
    rays.set(i, point, {r * std::cos(a), r * std::sin(a), z}, radius);
  }
  intersect(&rays, kRays, 0, false);
  return *std::min_element(rays.t.begin(), rays.t.end());
}

}  // namespace vip_slam
