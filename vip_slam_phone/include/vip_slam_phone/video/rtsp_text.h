// SPDX-License-Identifier: BSD-3-Clause
// The text of RTSP (RFC 2326): answers and authentication.
#pragma once

#include <map>
#include <string>

namespace vip_slam::phone {

struct RtspAnswer {
  int status = 0;
  std::string reason;
  std::multimap<std::string, std::string> fields;    ///< names in lower case
  std::string field(const std::string& name) const;  ///< first of that name, or empty
};

/// Head of an answer, without the empty line. Throws WireError when it is none.
RtspAnswer parseAnswer(const std::string& head);

struct Credentials {
  std::string user, password;
};

/// Value of the field Authorization for what the server asks (Digest before Basic, of the fields WWW-Authenticate).
/// Throws WireError when it asks for neither.
std::string authorisation(const RtspAnswer& refusal, const Credentials& credentials, const std::string& method,
                          const std::string& url);

}  // namespace vip_slam::phone
