// SPDX-License-Identifier: BSD-3-Clause
#include "video_encoder.h"

#include <stdexcept>

extern "C" {
#include <libavutil/opt.h>
}

#include "av_parts.h"

namespace vip_slam::phone {
namespace {

const char* nameOf(Codec codec) { return codec == Codec::kH264 ? "libx264" : "libx265"; }

}  // namespace

struct VideoEncoder::Impl : AvParts {};

bool VideoEncoder::available(Codec codec) { return avcodec_find_encoder_by_name(nameOf(codec)); }

VideoEncoder::VideoEncoder(Codec kind, cv::Size size, int rate, int bits_per_second)
    : impl_(std::make_unique<Impl>()), name_(nameOf(kind)) {
  av_log_set_level(AV_LOG_ERROR);
  const AVCodec* codec = avcodec_find_encoder_by_name(name_.c_str());
  if (!codec) throw std::runtime_error("libavcodec has no " + name_);
  AVCodecContext* c = impl_->context = avcodec_alloc_context3(codec);
  c->width = size.width;
  c->height = size.height;
  c->time_base = {1, rate};
  c->framerate = {rate, 1};
  c->pix_fmt = AV_PIX_FMT_YUV420P;
  c->bit_rate = bits_per_second;
  c->gop_size = rate;
  c->max_b_frames = 0;
  c->thread_count = 1;
  av_opt_set(c->priv_data, "preset", kind == Codec::kH264 ? "superfast" : "ultrafast", 0);
  av_opt_set(c->priv_data, "tune", "zerolatency", 0);
  if (kind == Codec::kHevc) av_opt_set(c->priv_data, "x265-params", "log-level=error:pools=none", 0);
  if (avcodec_open2(c, codec, nullptr) < 0) throw std::runtime_error(name_ + " does not open");
  impl_->packet = av_packet_alloc();
  AVFrame* f = impl_->frame = av_frame_alloc();
  f->format = c->pix_fmt;
  f->width = size.width;
  f->height = size.height;
  if (av_frame_get_buffer(f, 0) < 0) throw std::runtime_error("no memory for an image");
  f->pts = -1;
  impl_->scaler = sws_getContext(size.width, size.height, AV_PIX_FMT_BGR24, size.width, size.height, AV_PIX_FMT_YUV420P,
                                 SWS_BILINEAR, nullptr, nullptr, nullptr);
}

VideoEncoder::~VideoEncoder() = default;

std::vector<std::vector<std::uint8_t>> VideoEncoder::encode(const cv::Mat& bgr) {
  Impl& av = *impl_;
  av_frame_make_writable(av.frame);
  const std::uint8_t* planes[1] = {bgr.data};
  const int strides[1] = {static_cast<int>(bgr.step)};
  sws_scale(av.scaler, planes, strides, 0, bgr.rows, av.frame->data, av.frame->linesize);
  ++av.frame->pts;
  std::vector<std::vector<std::uint8_t>> units;
  if (avcodec_send_frame(av.context, av.frame) < 0) throw std::runtime_error(name_ + " refuses an image");
  while (avcodec_receive_packet(av.context, av.packet) == 0) {
    const std::uint8_t *begin = av.packet->data, *end = begin + av.packet->size;
    const auto start_code = [&](const std::uint8_t* p) {
      for (; p + 3 <= end; ++p)
        if (p[0] == 0 && p[1] == 0 && p[2] == 1) return p;
      return end;
    };
    for (const std::uint8_t* p = start_code(begin); p < end;) {
      const std::uint8_t* unit = p + 3;
      const std::uint8_t* next = start_code(unit);
      const std::uint8_t* last = next;
      while (last > unit && next < end && last[-1] == 0) --last;  // the next code's leading zero
      units.emplace_back(unit, last);
      p = next;
    }
    av_packet_unref(av.packet);
  }
  return units;
}

}  // namespace vip_slam::phone
