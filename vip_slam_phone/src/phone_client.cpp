// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_phone/phone_client.h"

#include <chrono>
#include <cmath>
#include <optional>

#include "vip_slam_phone/net/tcp_stream.h"
#include "vip_slam_phone/video/rtsp_session.h"
#include "vip_slam_phone/video/video_stream.h"

namespace vip_slam::phone {

PhoneClient::PhoneClient(const PhoneOptions& options, std::function<double()> now,
                         std::function<void(const Assembled&)> deliver)
    : options_(options), now_(std::move(now)), assembler_(options.width), outbox_(std::move(deliver)) {
  threads_.emplace_back([this] { keep(&PhoneStatus::records, [this] { receiveRecords(); }); });
  threads_.emplace_back([this] { keep(&PhoneStatus::video, [this] { receiveVideo(); }); });
  threads_.emplace_back([this] { keep(&PhoneStatus::depth, [this] { receiveDepth(); }); });
}

PhoneClient::~PhoneClient() {
  stop_ = true;
  for (std::thread& thread : threads_) thread.join();
}

PhoneStatus PhoneClient::status() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  PhoneStatus status = status_;
  status.assembly = assembler_.counts();
  status.left_out = outbox_.leftOut();
  status.clock_ready = assembler_.clock().ready();
  status.clock_offset = assembler_.clock().offsetAt(1e18);
  status.clock_slew = assembler_.clock().slew();
  status.breathing = assembler_.breathing();
  return status;
}

void PhoneClient::keep(StreamStatus PhoneStatus::*stream, const std::function<void()>& receive) {
  while (!stop_) {
    std::string problem;
    try {
      receive();
    } catch (const std::exception& e) {
      problem = e.what();
    }
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      (status_.*stream).connected = false;
      (status_.*stream).problem = problem;
    }
    for (int i = 0; i < 10 && !stop_; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
}

void PhoneClient::handOn(Assembled&& out) {
  status_.imu += out.imu.size();
  status_.color += out.color.size();
  status_.depth_images += out.depth.size();
  outbox_.add(std::move(out));
}

Handshake PhoneClient::readHandshake(TcpStream* stream, const std::string& protocol) {
  const auto text = stream->readMessage(2, kMaxHandshake, "handshake");
  const Handshake handshake = parseHandshake(std::string(text.begin(), text.end()));
  if (handshake.protocol != protocol)
    throw WireError("the port speaks '" + handshake.protocol.substr(0, 40) + "', expected '" + protocol + "'");
  return handshake;
}

void PhoneClient::receiveRecords() {
  TcpStream stream(options_.host, options_.record_port, options_.timeout, stop_);
  const Handshake handshake = readHandshake(&stream, "irtsp-imu");
  const std::vector<std::string> words = complaints(handshake);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    status_.complaints = words;
    status_.records.connected = true;
    status_.records.problem.clear();
    ++status_.records.connections;
    assembler_.reconnected(false);
  }
  std::vector<std::uint8_t> bytes(kRecordBytes);
  for (;;) {
    stream.read(bytes.data(), bytes.size());
    const double arrival = now_();
    Record record;
    std::string wrong;
    try {
      record = parseRecord(bytes);
    } catch (const WireError& e) {
      wrong = e.what();
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    ++status_.records.received;
    status_.records.problem = wrong;
    if (!wrong.empty()) continue;
    // The anchors stay the same for a session: others are another one, whose clock has to be found anew.
    const double anchor = record.unix_time - record.host_time;
    if (status_.records.received > 1 && std::abs(anchor - host_minus_unix_) > 0.001) assembler_.reconnected(true);
    host_minus_unix_ = anchor;
    Assembled out;
    assembler_.addRecord(record, arrival, &out);
    handOn(std::move(out));
  }
}

void PhoneClient::receiveDepth() {
  TcpStream stream(options_.host, options_.depth_port, options_.timeout, stop_);
  const Handshake handshake = readHandshake(&stream, "irtsp-depth");
  if (handshake.compression_zlib) {
    const auto ask = askForDeflate();
    stream.write(ask.data(), ask.size());
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    status_.depth.connected = true;
    status_.depth.problem.clear();
    ++status_.depth.connections;
  }
  std::optional<std::uint16_t> sequence;
  for (;;) {
    const auto message = stream.readMessage(kDepthHeader, kMaxDepthMessage, "depth image");
    DepthFrame frame;
    std::string wrong;
    try {
      frame = parseDepthFrame(message);
    } catch (const WireError& e) {
      wrong = e.what();
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    ++status_.depth.received;
    status_.depth.problem = wrong;
    if (!wrong.empty()) continue;
    if (const std::uint16_t step = sequence ? frame.sequence - *sequence : 1; step > 1 && step < 0x8000)
      status_.depth.lost += step - 1;
    sequence = frame.sequence;
    Assembled out;
    assembler_.addDepth(std::move(frame), &out);
    handOn(std::move(out));
  }
}

void PhoneClient::receiveVideo() {
  TcpStream stream(options_.host, options_.rtsp_port, options_.timeout, stop_);
  const std::string url = "rtsp://" + hostAndPort(options_.host, options_.rtsp_port) + options_.path;
  RtspSession session(&stream, url, options_.credentials);
  VideoStream video(session.track());
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    status_.video.connected = true;
    status_.video.problem.clear();
    ++status_.video.connections;
    status_.sender_report = false;
  }
  VideoCounts before;
  for (;;) {
    const RtspSession::Packet packet = session.next();
    std::vector<TimedImage> images;
    std::string wrong;
    try {
      images = video.add(packet.control, packet.data);
    } catch (const WireError& e) {
      wrong = e.what();
    }
    const VideoCounts& counts = video.counts();
    const std::lock_guard<std::mutex> lock(mutex_);
    status_.sender_report = video.reported();
    status_.video.received += counts.pictures - before.pictures;
    status_.video.lost += counts.lost - before.lost;
    status_.untimed += counts.untimed - before.untimed;
    before = counts;
    if (!wrong.empty() || !images.empty()) status_.video.problem = wrong;
    for (TimedImage& image : images) {
      Assembled out;
      assembler_.addColor(image.unix_time, std::move(image.bgr), &out);
      handOn(std::move(out));
    }
  }
}

}  // namespace vip_slam::phone
