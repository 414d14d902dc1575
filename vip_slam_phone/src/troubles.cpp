// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_phone/troubles.h"

#include "vip_slam_core/util/formatted.h"

namespace vip_slam::phone {

std::vector<std::string> troubles(const PhoneStatus& before, const PhoneStatus& now, double seconds) {
  std::vector<std::string> words;
  const auto stream = [&](const char* what, const StreamStatus& s, const char* remedy) {
    if (!s.connected)
      words.push_back(std::string("no ") + what + " (" + (s.problem.empty() ? "connecting" : s.problem) +
                      "): " + remedy);
    else if (!s.problem.empty())
      words.push_back(std::string(what) + ": " + s.problem);
  };
  const bool asleep = !now.records.connected && !now.video.connected && !now.depth.connected;
  if (asleep) {
    words.push_back("the phone does not answer (" + now.video.problem +
                    "): is its screen on, the app streaming, and the address right? Trying again; the map stays");
  } else {
    stream("video", now.video, "is the app streaming? Trying again; the map stays");
    stream("IMU", now.records, "switch on the IMU in the app. Trying again; the map stays");
    stream("depth", now.depth, "switch on depth in the app; until then it goes on visual-inertially");
    words.insert(words.end(), now.complaints.begin(), now.complaints.end());
  }
  if (now.video.connected && !now.sender_report)
    words.push_back("no RTCP sender report yet: the time of the images is not known, " + std::to_string(now.untimed) +
                    " were left out");
  const double imu = (now.imu - before.imu) / seconds;
  const bool all_the_time = now.records.connected && now.records.connections == before.records.connections;
  if (all_the_time && before.clock_ready && imu < 90)
    words.push_back(formatted("%.0f IMU samples a second, expected about 100", imu));
  if (now.assembly.portrait > before.assembly.portrait)
    words.push_back("images are upright: run the app's ARKit pose, whose images are landscape as the sensor is");
  if (const std::size_t lost = now.video.lost - before.video.lost)
    words.push_back(std::to_string(lost) + " packets of the video were lost: the network is too slow or too busy");
  if (const std::size_t lost = now.depth.lost - before.depth.lost)
    words.push_back(std::to_string(lost) + " depth images were lost: the network is too slow or too busy");
  if (const std::size_t lost = now.assembly.imu_lost - before.assembly.imu_lost)
    words.push_back(std::to_string(lost) + " records were lost: the network is too slow or too busy");
  const std::size_t images = now.left_out.images - before.left_out.images;
  const std::size_t samples = now.left_out.samples - before.left_out.samples;
  if (images + samples > 0)
    words.push_back(std::to_string(images) + " images and " + std::to_string(samples) +
                    " samples were left out: publishing is too slow; is the computer too busy?");
  return words;
}

}  // namespace vip_slam::phone
