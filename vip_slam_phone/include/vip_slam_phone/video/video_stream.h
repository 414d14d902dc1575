// SPDX-License-Identifier: BSD-3-Clause
// The packets of an RTSP session's video to images with the phone's time.
#pragma once

#include <optional>
#include <vector>

#include "vip_slam_phone/video/depacketiser.h"
#include "vip_slam_phone/video/sdp.h"
#include "vip_slam_phone/video/video_decoder.h"

namespace vip_slam::phone {

struct TimedImage {
  double unix_time = 0;  ///< the phone's, s
  cv::Mat bgr;
};

struct VideoCounts {
  std::size_t pictures = 0;  ///< as they were sent, damaged ones too
  std::size_t lost = 0;      ///< packets
  std::size_t untimed = 0;   ///< images left out: they came before the first sender report
};

class VideoStream {
 public:
  /// Throws std::runtime_error when libavcodec has no decoder for the track.
  explicit VideoStream(const VideoTrack& track);

  /// Takes a packet of RTP or, `control`, of RTCP; returns the images that become ready. Those before the first sender
  /// report have no time: they are counted and left out. After lost packets none comes until the next key picture.
  /// Throws WireError on a packet that is not as the standard says, and goes on with the next.
  std::vector<TimedImage> add(bool control, const Bytes& packet);

  bool reported() const { return report_.has_value(); }
  const VideoCounts& counts() const { return counts_; }

 private:
  int payload_type_;
  Depacketiser depacketiser_;
  VideoDecoder decoder_;
  std::vector<std::uint8_t> ahead_;  ///< parameter sets, before the first picture
  std::optional<SenderReport> report_;
  bool whole_ = false;  ///< no picture was lost since the last key picture
  VideoCounts counts_;
};

}  // namespace vip_slam::phone
