// SPDX-License-Identifier: BSD-3-Clause
#include "vip_slam_phone/net/find_phone.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <cstdio>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace vip_slam::phone {
namespace {

bool isAddress(int family, const std::string& text) {
  unsigned char bytes[sizeof(in6_addr)];
  return text.find('\0') == std::string::npos && inet_pton(family, text.c_str(), bytes) == 1;
}

}  // namespace

std::string addressIn(const std::string& browse_output) {
  // =;interface;protocol;name;type;domain;host;address;port;text   (';' within a name is escaped)
  std::string found;
  std::istringstream lines(browse_output);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("=;", 0) != 0) continue;
    std::vector<std::string> cells;
    std::istringstream text(line);
    for (std::string cell; std::getline(text, cell, ';');) cells.push_back(cell);
    if (cells.size() < 9) continue;
    const std::string& address = cells[7];
    if (isAddress(AF_INET, address)) return address;
    // An address of the link alone would need the interface's name with it.
    if (found.empty() && isAddress(AF_INET6, address) && address.rfind("fe80", 0) != 0) found = address;
  }
  return found;
}

std::string findPhone() {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen("timeout 10 avahi-browse -prt _irtsp-imu._tcp 2>&1", "r"),
                                                   pclose);
  if (!pipe) throw std::runtime_error("avahi-browse does not start: give the phone's address (host:=IP)");
  std::string output;
  char buffer[1024];
  while (output.size() < 65536 && std::fgets(buffer, sizeof(buffer), pipe.get())) output += buffer;
  const std::string address = addressIn(output);
  if (!address.empty()) return address;
  if (output.find("avahi-browse") != std::string::npos || output.find("aemon") != std::string::npos)
    throw std::runtime_error(
        "avahi is not here or does not run (package avahi-utils): give the phone's address (host:=IP)");
  throw std::runtime_error(
      "no phone announces its IMU in this network: is the app streaming, with the IMU switched on?");
}

}  // namespace vip_slam::phone
