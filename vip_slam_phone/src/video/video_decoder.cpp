// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_phone/video/video_decoder.h"

#include <stdexcept>

#include "av_parts.h"

namespace vip_slam::phone {

struct VideoDecoder::Impl : AvParts {};

VideoDecoder::VideoDecoder(Codec codec) : impl_(std::make_unique<Impl>()) {
  av_log_set_level(AV_LOG_FATAL);  // losses are counted and told by us
  const AVCodec* decoder = avcodec_find_decoder(codec == Codec::kH264 ? AV_CODEC_ID_H264 : AV_CODEC_ID_HEVC);
  if (decoder) impl_->context = avcodec_alloc_context3(decoder);
  impl_->frame = av_frame_alloc();
  impl_->packet = av_packet_alloc();
  if (!impl_->context || !impl_->frame || !impl_->packet)
    throw std::runtime_error(std::string("libavcodec has no decoder for ") +
                             (codec == Codec::kH264 ? "H.264" : "HEVC"));
  // Threads by slice: those by picture would hold pictures back.
  impl_->context->flags |= AV_CODEC_FLAG_LOW_DELAY;
  impl_->context->thread_type = FF_THREAD_SLICE;
  impl_->context->thread_count = 2;
  if (avcodec_open2(impl_->context, decoder, nullptr) < 0)
    throw std::runtime_error("libavcodec's decoder does not open");
}

VideoDecoder::~VideoDecoder() = default;

std::vector<DecodedImage> VideoDecoder::decode(const std::vector<std::uint8_t>& data, std::uint32_t rtp_time) {
  std::vector<DecodedImage> out;
  Impl& av = *impl_;
  if (data.empty() || av_new_packet(av.packet, static_cast<int>(data.size())) < 0) return out;
  std::copy(data.begin(), data.end(), av.packet->data);
  av.packet->pts = rtp_time;
  const int sent = avcodec_send_packet(av.context, av.packet);
  av_packet_unref(av.packet);
  if (sent < 0 && sent != AVERROR(EAGAIN)) return out;
  while (avcodec_receive_frame(av.context, av.frame) == 0) {
    AVFrame& f = *av.frame;
    if (f.width > 0 && f.height > 0 && !(f.flags & AV_FRAME_FLAG_CORRUPT) && !f.decode_error_flags) {
      av.scaler = sws_getCachedContext(av.scaler, f.width, f.height, static_cast<AVPixelFormat>(f.format), f.width,
                                       f.height, AV_PIX_FMT_BGR24, SWS_BILINEAR, nullptr, nullptr, nullptr);
      if (av.scaler) {
        DecodedImage image;
        image.bgr.create(f.height, f.width, CV_8UC3);
        image.rtp_time = static_cast<std::uint32_t>(f.pts);
        std::uint8_t* planes[1] = {image.bgr.data};
        const int strides[1] = {static_cast<int>(image.bgr.step)};
        sws_scale(av.scaler, f.data, f.linesize, 0, f.height, planes, strides);
        out.push_back(std::move(image));
      }
    }
    av_frame_unref(av.frame);
  }
  return out;
}

}  // namespace vip_slam::phone
