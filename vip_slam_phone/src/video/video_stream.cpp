// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_phone/video/video_stream.h"

namespace vip_slam::phone {

VideoStream::VideoStream(const VideoTrack& track)
    : payload_type_(track.payload_type),
      depacketiser_(track.codec),
      decoder_(track.codec),
      ahead_(track.parameter_sets) {}

std::vector<TimedImage> VideoStream::add(bool control, const Bytes& packet) {
  std::vector<TimedImage> out;
  if (control) {
    if (const auto newer = parseSenderReport(packet)) report_ = newer;
    return out;
  }
  const RtpPacket rtp = parseRtp(packet);
  if (rtp.payload_type != payload_type_) return out;
  for (AccessUnit& picture : depacketiser_.add(rtp)) {
    ++counts_.pictures;
    // What leans on a lost picture decodes to smears: nothing until the next key picture.
    whole_ = !picture.damaged && (whole_ || picture.key);
    if (!whole_) continue;
    picture.data.insert(picture.data.begin(), ahead_.begin(), ahead_.end());
    ahead_.clear();
    for (DecodedImage& image : decoder_.decode(picture.data, picture.rtp_time)) {
      if (report_)
        out.push_back({report_->timeOf(image.rtp_time), std::move(image.bgr)});
      else
        ++counts_.untimed;
    }
  }
  counts_.lost = depacketiser_.lost();
  return out;
}

}  // namespace vip_slam::phone
