// SPDX-License-Identifier: BSD-3-Clause
// RTP packets to the pictures of a video: H.264 (RFC 6184, single units, STAP-A, FU-A) and HEVC (RFC 7798, single
// units, aggregation, fragments).
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "vip_slam_phone/video/rtp.h"

namespace vip_slam::phone {

enum class Codec { kH264, kHevc };

/// One coded picture, each unit behind a start code 0 0 0 1, as decoders take it.
struct AccessUnit {
  std::uint32_t rtp_time = 0;
  std::vector<std::uint8_t> data;
  bool damaged = false;  ///< packets are missing within it or before it
  bool key = false;      ///< decodable without others
};

class Depacketiser {
 public:
  explicit Depacketiser(Codec codec) : codec_(codec) {}

  /// Takes a packet; returns what became whole by it, in order. Packets out of order are put right within
  /// `kReorder`; what has not come by then is lost and counted. Throws WireError on a payload that is not as the
  /// standard says, and goes on with the next.
  std::vector<AccessUnit> add(const RtpPacket& packet);

  std::size_t lost() const { return lost_; }
  std::size_t reordered() const { return reordered_; }

  static constexpr std::size_t kReorder = 16;           ///< packets
  static constexpr std::size_t kMaxPicture = 8u << 20;  ///< bytes

 private:
  struct Held {
    std::uint32_t time;
    bool marker;
    std::vector<std::uint8_t> payload;
  };
  void take(const Held& packet, std::vector<AccessUnit>* out);
  void takeH264(const Bytes& payload);
  void takeHevc(const Bytes& payload);
  void unit(const Bytes& unit);
  void fragment(const std::uint8_t* header, std::size_t header_size, const Bytes& rest, bool start);
  void startCode();
  void append(const std::uint8_t* data, std::size_t size);
  void noteType(std::uint8_t first_byte);
  void finish(std::vector<AccessUnit>* out);

  Codec codec_;
  bool started_ = false;
  std::uint16_t next_ = 0;                 ///< sequence number that follows
  std::map<std::uint16_t, Held> waiting_;  ///< by distance from `next_` when looked at; ahead of it
  AccessUnit current_;
  bool in_fragment_ = false;
  std::size_t lost_ = 0, reordered_ = 0;
};

}  // namespace vip_slam::phone
