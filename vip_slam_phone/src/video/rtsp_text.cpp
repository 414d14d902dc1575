// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_phone/video/rtsp_text.h"

#include <algorithm>
#include <cctype>
#include <sstream>

extern "C" {
#include <libavutil/base64.h>
#include <libavutil/md5.h>
}

#include "vip_slam_core/util/formatted.h"
#include "vip_slam_phone/wire/bytes.h"

namespace vip_slam::phone {
namespace {

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

std::string md5(const std::string& text) {
  std::uint8_t sum[16];
  av_md5_sum(sum, reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  std::string hex;
  for (const std::uint8_t byte : sum) hex += formatted("%02x", byte);
  return hex;
}

/// Value of `key="value"` or `key=value` in a challenge.
std::string parameter(const std::string& challenge, const std::string& key) {
  const std::string text = lower(challenge);
  for (std::size_t at = text.find(key + "="); at != std::string::npos; at = text.find(key + "=", at + 1)) {
    if (at > 0 && text[at - 1] != ' ' && text[at - 1] != ',') continue;
    const std::size_t begin = at + key.size() + 1;
    if (begin < challenge.size() && challenge[begin] == '"') {
      const std::size_t end = challenge.find('"', begin + 1);
      return end == std::string::npos ? "" : challenge.substr(begin + 1, end - begin - 1);
    }
    return challenge.substr(begin, challenge.find_first_of(", ", begin) - begin);
  }
  return "";
}

}  // namespace

std::string RtspAnswer::field(const std::string& name) const {
  const auto found = fields.find(name);
  return found == fields.end() ? "" : found->second;
}

RtspAnswer parseAnswer(const std::string& head) {
  std::istringstream lines(head);
  std::string line;
  std::getline(lines, line);
  RtspAnswer answer;
  std::istringstream first(line);
  std::string version;
  if (!(first >> version >> answer.status) || version.rfind("RTSP/", 0) != 0)
    throw WireError("no answer of RTSP: '" + line.substr(0, 60) + "'; is this port the app's?");
  std::getline(first >> std::ws, answer.reason);
  if (!answer.reason.empty() && answer.reason.back() == '\r') answer.reason.pop_back();
  while (std::getline(lines, line)) {
    // Of what comes back in our requests: a control character in it would end a line of ours.
    line.erase(std::remove_if(line.begin(), line.end(), [](unsigned char c) { return std::iscntrl(c); }), line.end());
    const auto colon = line.find(':');
    if (colon == std::string::npos) continue;
    const auto begin = line.find_first_not_of(' ', colon + 1);
    answer.fields.emplace(lower(line.substr(0, colon)), begin == std::string::npos ? "" : line.substr(begin));
  }
  return answer;
}

std::string authorisation(const RtspAnswer& refusal, const Credentials& credentials, const std::string& method,
                          const std::string& url) {
  bool basic = false;
  const auto asked = refusal.fields.equal_range("www-authenticate");
  for (auto it = asked.first; it != asked.second; ++it) {
    const std::string& challenge = it->second;
    basic |= lower(challenge).rfind("basic", 0) == 0;
    if (lower(challenge).rfind("digest", 0) != 0) continue;
    const std::string realm = parameter(challenge, "realm"), nonce = parameter(challenge, "nonce");
    const std::string ha1 = md5(credentials.user + ":" + realm + ":" + credentials.password);
    const std::string ha2 = md5(method + ":" + url);
    std::string response, extra;
    if (lower(parameter(challenge, "qop")).find("auth") != std::string::npos) {
      const std::string count = "00000001", own = md5(nonce + url).substr(0, 16);
      response = md5(ha1 + ":" + nonce + ":" + count + ":" + own + ":auth:" + ha2);
      extra = ", qop=auth, nc=" + count + ", cnonce=\"" + own + "\"";
    } else {
      response = md5(ha1 + ":" + nonce + ":" + ha2);
    }
    if (const std::string opaque = parameter(challenge, "opaque"); !opaque.empty())
      extra += ", opaque=\"" + opaque + "\"";
    return "Digest username=\"" + credentials.user + "\", realm=\"" + realm + "\", nonce=\"" + nonce + "\", uri=\"" +
           url + "\", response=\"" + response + "\"" + extra;
  }
  if (!basic) throw WireError("RTSP: asks for neither Basic nor Digest authentication");
  const std::string plain = credentials.user + ":" + credentials.password;
  std::vector<char> coded(AV_BASE64_SIZE(plain.size()));
  av_base64_encode(coded.data(), static_cast<int>(coded.size()), reinterpret_cast<const std::uint8_t*>(plain.data()),
                   static_cast<int>(plain.size()));
  return std::string("Basic ") + coded.data();
}

}  // namespace vip_slam::phone
