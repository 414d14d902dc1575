#include "vip_slam_ros/point_cloud.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace vip_slam {
namespace {

constexpr std::uint32_t kStep = 16;

std::uint32_t pack(const std_msgs::ColorRGBA& c) {
  const auto byte = [](float v) { return std::uint32_t(std::lround(255.0f * std::min(1.0f, std::max(0.0f, v)))); };
  return byte(c.r) << 16 | byte(c.g) << 8 | byte(c.b);
}

}  // namespace

sensor_msgs::PointCloud2 toPointCloud(const std::vector<ColoredPoint>& points, const std_msgs::Header& header) {
  sensor_msgs::PointCloud2 cloud;
  cloud.header = header;
  cloud.height = 1;
  cloud.width = std::uint32_t(points.size());
  cloud.is_dense = true;
  cloud.point_step = kStep;
  cloud.row_step = kStep * cloud.width;
  const char* names[] = {"x", "y", "z", "rgb"};
  for (std::uint32_t i = 0; i < 4; ++i) {
    sensor_msgs::PointField field;
    field.name = names[i];
    field.offset = 4 * i;
    field.datatype = sensor_msgs::PointField::FLOAT32;
    field.count = 1;
    cloud.fields.push_back(field);
  }
  cloud.data.resize(cloud.row_step);
  std::uint8_t* out = cloud.data.data();
  for (const ColoredPoint& point : points) {
    const std::uint32_t rgb = pack(point.color);
    std::memcpy(out, point.p.data(), 12);
    std::memcpy(out + 12, &rgb, 4);
    out += kStep;
  }
  return cloud;
}

}  // namespace vip_slam
