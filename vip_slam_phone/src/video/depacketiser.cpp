// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_phone/video/depacketiser.h"

namespace vip_slam::phone {

std::vector<AccessUnit> Depacketiser::add(const RtpPacket& packet) {
  std::vector<AccessUnit> out;
  if (!started_) {
    started_ = true;
    next_ = packet.sequence;
  }
  const auto ahead = [&](std::uint16_t sequence) { return static_cast<std::int16_t>(sequence - next_); };
  if (ahead(packet.sequence) < 0) {
    if (ahead(packet.sequence) > -1000) {
      ++reordered_;  // too late, or sent twice
      return out;
    }
    waiting_.clear();  // the sender began anew
    next_ = packet.sequence;
    current_.damaged = true;
  }
  if (packet.sequence != next_) ++reordered_;
  const Bytes& payload = packet.payload;
  waiting_[packet.sequence] = {packet.time, packet.marker, {payload.data(), payload.data() + payload.size()}};
  while (!waiting_.empty()) {
    auto nearest = waiting_.begin();
    for (auto it = waiting_.begin(); it != waiting_.end(); ++it)
      if (ahead(it->first) < ahead(nearest->first)) nearest = it;
    if (nearest->first != next_) {
      if (waiting_.size() < kReorder) break;
      lost_ += static_cast<std::uint16_t>(nearest->first - next_);
      current_.damaged = true;
      in_fragment_ = false;
      next_ = nearest->first;
    }
    ++next_;
    const Held held = std::move(nearest->second);
    waiting_.erase(nearest);
    take(held, &out);
  }
  return out;
}

void Depacketiser::take(const Held& packet, std::vector<AccessUnit>* out) {
  if (!current_.data.empty() && packet.time != current_.rtp_time) {
    current_.damaged = true;  // its last packet never came
    finish(out);
    current_.damaged = true;
  }
  current_.rtp_time = packet.time;
  try {
    codec_ == Codec::kH264 ? takeH264(packet.payload) : takeHevc(packet.payload);
  } catch (const WireError&) {
    current_.damaged = true;
    in_fragment_ = false;
  }
  if (packet.marker) finish(out);
}

void Depacketiser::finish(std::vector<AccessUnit>* out) {
  // Of a picture that lost its beginning nothing may be left: the next one leans on it all the same.
  const bool gone = current_.damaged && current_.data.empty();
  if (!current_.data.empty()) out->push_back(std::move(current_));
  current_ = {};
  current_.damaged = gone;
  in_fragment_ = false;
}

void Depacketiser::takeH264(const Bytes& payload) {
  const std::uint8_t type = payload[0] & 0x1f;
  if (type >= 1 && type <= 23) return unit(payload);
  if (type == 24) {  // STAP-A
    for (Bytes rest = payload.from(1); !rest.empty();) {
      const std::size_t size = rest.big<std::uint16_t>(0);
      unit(rest.part(2, size));
      rest = rest.from(2 + size);
    }
    return;
  }
  if (type != 28) throw WireError("H.264 packet of type " + std::to_string(type) + ", expected 1 to 24 or 28");
  const std::uint8_t head = payload[1], whole = (payload[0] & 0xe0) | (head & 0x1f);
  fragment(&whole, 1, payload.from(2), head & 0x80);
  if (head & 0x40) in_fragment_ = false;
}

void Depacketiser::takeHevc(const Bytes& payload) {
  const std::uint8_t type = payload[0] >> 1 & 0x3f;
  const std::uint8_t second = payload[1];
  if (type < 48) return unit(payload);
  if (type == 48) {  // aggregation
    for (Bytes rest = payload.from(2); !rest.empty();) {
      const std::size_t size = rest.big<std::uint16_t>(0);
      unit(rest.part(2, size));
      rest = rest.from(2 + size);
    }
    return;
  }
  if (type != 49) throw WireError("HEVC packet of type " + std::to_string(type) + ", expected 0 to 49");
  const std::uint8_t head = payload[2];
  const std::uint8_t whole[2] = {static_cast<std::uint8_t>((payload[0] & 0x81) | (head & 0x3f) << 1), second};
  fragment(whole, 2, payload.from(3), head & 0x80);
  if (head & 0x40) in_fragment_ = false;
}

void Depacketiser::unit(const Bytes& unit) {
  if (unit.empty()) throw WireError("empty unit");
  in_fragment_ = false;
  noteType(unit[0]);
  startCode();
  append(unit.data(), unit.size());
}

void Depacketiser::fragment(const std::uint8_t* header, std::size_t header_size, const Bytes& rest, bool start) {
  if (start) {
    noteType(header[0]);
    startCode();
    append(header, header_size);
    in_fragment_ = true;
  }
  if (!in_fragment_) throw WireError("fragment whose beginning is missing");
  append(rest.data(), rest.size());
}

void Depacketiser::startCode() {
  const std::uint8_t code[4] = {0, 0, 0, 1};
  append(code, 4);
}

void Depacketiser::append(const std::uint8_t* data, std::size_t size) {
  if (current_.data.size() + size > kMaxPicture) {
    current_.data.clear();
    throw WireError("picture of more than " + std::to_string(kMaxPicture) + " bytes");
  }
  current_.data.insert(current_.data.end(), data, data + size);
}

void Depacketiser::noteType(std::uint8_t first) {
  const int type = codec_ == Codec::kH264 ? first & 0x1f : first >> 1 & 0x3f;
  if (codec_ == Codec::kH264 ? type == 5 : type >= 16 && type <= 21) current_.key = true;
}

}  // namespace vip_slam::phone
