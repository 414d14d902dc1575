// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_phone/wire/depth_frame.h"

#include <algorithm>
#include <cmath>

#include <zlib.h>

#include "vip_slam_core/util/size_text.h"

namespace vip_slam::phone {
namespace {

std::vector<std::uint8_t> inflateRaw(const Bytes& packed, std::size_t expected) {
  std::vector<std::uint8_t> out(expected);
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw WireError("depth: zlib does not start");
  stream.next_in = const_cast<Bytef*>(packed.data());
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = out.data();
  stream.avail_out = static_cast<uInt>(out.size());
  const int status = inflate(&stream, Z_FINISH);
  const bool whole = status == Z_STREAM_END && stream.avail_out == 0;
  inflateEnd(&stream);
  if (!whole) throw WireError("depth: the compressed image does not give " + std::to_string(expected) + " bytes");
  return out;
}

}  // namespace

DepthFrame parseDepthFrame(const Bytes& message) {
  if (message[0] != 10) throw WireError("depth: message of type " + std::to_string(message[0]) + ", expected 10");
  const Bytes payload = message.from(kDepthHeader);
  DepthFrame out;
  out.sequence = message.little<std::uint16_t>(2);
  out.host_time = message.little<double>(8);
  out.unix_time = message.little<double>(16);
  if (!(std::abs(out.host_time) < 1e12 && std::abs(out.unix_time) < 1e12))
    throw WireError("depth: a stamp is not a time");
  const int width = message.little<std::uint16_t>(24), height = message.little<std::uint16_t>(26);
  if (width < 16 || height < 16 || width > 1024 || height > 1024)
    throw WireError("depth: image of " + sizeText({width, height}) + ", expected 16 to 1024 pixels a side");
  const bool half = message[1] & 1, compressed = message[1] & 2;
  const std::size_t sample = half ? 2 : 4, bytes = sample * width * height;
  if (message[28] != sample)
    throw WireError("depth: " + std::to_string(message[28]) + " bytes per pixel, expected " + std::to_string(sample));
  std::vector<std::uint8_t> unpacked;
  Bytes samples = payload;
  if (compressed) {
    if (message[29] == 1) throw WireError("depth: compressed by LZFSE, which is not supported; expected zlib");
    if (message[29] != 2) throw WireError("depth: unknown compression " + std::to_string(message[29]));
    unpacked = inflateRaw(payload, bytes);
    samples = unpacked;
  }
  if (samples.size() != bytes)
    throw WireError("depth: " + std::to_string(samples.size()) + " bytes for " + sizeText({width, height}) +
                    " pixels, expected " + std::to_string(bytes));
  if (half) {
    cv::Mat halves(height, width, CV_16SC1);
    for (int i = 0; i < width * height; ++i)
      halves.ptr<std::int16_t>()[i] = static_cast<std::int16_t>(samples.little<std::uint16_t>(2 * i));
    cv::convertFp16(halves, out.metres);
  } else {
    out.metres.create(height, width, CV_32FC1);
    for (int i = 0; i < width * height; ++i) out.metres.ptr<float>()[i] = samples.little<float>(4 * i);
  }
  // Not a number, infinite or negative: no reading. 65 m keep a millimetre in 16 bits.
  for (int i = 0; i < width * height; ++i) {
    float& z = out.metres.ptr<float>()[i];
    if (!(z > 0 && z < 65)) z = 0;
  }
  return out;
}

std::vector<std::uint8_t> askForDeflate() {
  const std::string json = "{\"compression\":\"zlib\"}";
  std::vector<std::uint8_t> out(4 + json.size());
  out[0] = static_cast<std::uint8_t>(json.size());
  std::copy(json.begin(), json.end(), out.begin() + 4);
  return out;
}

}  // namespace vip_slam::phone
