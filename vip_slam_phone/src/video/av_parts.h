// SPDX-License-Identifier: BSD-3-Clause
// What libavcodec's coders and decoders are made of, given back together.
#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
#include <libswscale/swscale.h>
}

namespace vip_slam::phone {

struct AvParts {
  AVCodecContext* context = nullptr;
  AVFrame* frame = nullptr;
  AVPacket* packet = nullptr;
  SwsContext* scaler = nullptr;

  AvParts() = default;
  AvParts(const AvParts&) = delete;
  AvParts& operator=(const AvParts&) = delete;
  ~AvParts() {
    sws_freeContext(scaler);
    av_packet_free(&packet);
    av_frame_free(&frame);
    avcodec_free_context(&context);
  }
};

}  // namespace vip_slam::phone
