// SPDX-License-Identifier: BSD-3-Clause
// A phone is found by what it announces, or it is said why not.
#include <unistd.h>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "vip_slam_phone/net/find_phone.h"
#include "wire_bytes.h"

namespace vip_slam::phone {
namespace {

TEST(FindPhone, TheAddressAmongWhatIsAnnounced) {
  EXPECT_EQ(addressIn("+;eth0;IPv4;Phone;_irtsp-imu._tcp;local\n"
                      "=;eth0;IPv6;Phone;_irtsp-imu._tcp;local;p.local;fe80::1;8555;\"\"\n"
                      "=;eth0;IPv4;Phone;_irtsp-imu._tcp;local;p.local;192.0.2.7;8555;\"\"\n"),
            "192.0.2.7");
  EXPECT_EQ(addressIn("Failed to create client object: Daemon not running\n"), "");
}

TEST(FindPhone, OnlyAnAddressIsAnAddress) {
  const auto line = [](const std::string& protocol, const std::string& address) {
    return "=;eth0;" + protocol + ";Phone;_irtsp-imu._tcp;local;p.local;" + address + ";8555;\"\"\n";
  };
  EXPECT_EQ(addressIn(""), "");
  EXPECT_EQ(addressIn("=;eth0;IPv4;Phone\n=;;;;;;;;;\n"), "");
  EXPECT_EQ(addressIn(line("IPv4", "")), "");
  EXPECT_EQ(addressIn(line("IPv4", "p.local")), "");
  EXPECT_EQ(addressIn(line("IPv4", "192.0.2.700")), "");
  EXPECT_EQ(addressIn(line("IPv6", "fe80::1")), "") << "of the link alone";
  EXPECT_EQ(addressIn(line("IPv6", "2001:db8::7")), "2001:db8::7");
  EXPECT_EQ(addressIn(line("IPv6", "2001:db8::7") + line("IPv4", "192.0.2.7")), "192.0.2.7");
  // A name with a separator, as avahi writes it.
  EXPECT_EQ(addressIn("=;eth0;IPv4;My\\032Phone\\059\\0321;_irtsp-imu._tcp;local;p.local;192.0.2.7;8555;\n"),
            "192.0.2.7");
}

TEST(FindPhoneFuzz, WhateverIsAnnouncedAnAddressComesOutOrNothing) {
  std::mt19937 random(9);
  const std::string good =
      "+;eth0;IPv4;Phone;_irtsp-imu._tcp;local\n"
      "=;eth0;IPv4;Phone;_irtsp-imu._tcp;local;p.local;192.0.2.7;8555;\"\"\n";
  int found = 0;
  for (int i = 0; i < 20000; ++i) {
    const Raw broken = damaged(Raw(good.begin(), good.end()), &random);
    const std::string address = addressIn({broken.begin(), broken.end()});
    found += !address.empty();
    EXPECT_EQ(address.find_first_not_of("0123456789abcdefABCDEF.:"), std::string::npos) << address;
  }
  EXPECT_GT(found, 5000);
  EXPECT_LT(found, 19000);
}

/// What findPhone() returns, or says, when avahi-browse prints this.
std::string foundWhenAvahiSays(const std::string& text) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / ("vip_slam_phone_avahi_" + std::to_string(getpid()));
  fs::create_directory(folder);
  std::ofstream(folder / "said") << text;
  std::ofstream(folder / "avahi-browse") << "#!/bin/sh\ncat '" << (folder / "said").string() << "'\n";
  fs::permissions(folder / "avahi-browse", fs::perms::owner_all);
  const std::string path = std::getenv("PATH");
  setenv("PATH", (folder.string() + ":" + path).c_str(), 1);
  std::string out;
  try {
    out = findPhone();
  } catch (const std::runtime_error& e) {
    out = e.what();
  }
  setenv("PATH", path.c_str(), 1);
  fs::remove_all(folder);
  return out;
}

TEST(FindPhone, AsAvahiSaysIt) {
  // avahi 0.8, the service published on a machine with IPv6; a name with a separator.
  EXPECT_EQ(foundWhenAvahiSays(
                R"(+;eth0;IPv6;Stand-in\059\032phone;_irtsp-imu._tcp;local
+;eth0;IPv4;Stand-in\059\032phone;_irtsp-imu._tcp;local
=;eth0;IPv6;Stand-in\059\032phone;_irtsp-imu._tcp;local;phone.local;2001:db8::2;8555;
=;eth0;IPv4;Stand-in\059\032phone;_irtsp-imu._tcp;local;phone.local;192.0.2.2;8555;
)"),
            "192.0.2.2");
  EXPECT_NE(foundWhenAvahiSays("").find("no phone announces its IMU"), std::string::npos);
  EXPECT_NE(foundWhenAvahiSays("Failed to create client object: Daemon not running\n").find("avahi is not here"),
            std::string::npos);
  // Endless, and none of it an announcement: bounded.
  EXPECT_NE(foundWhenAvahiSays(std::string(1 << 20, 'x')).find("no phone announces"), std::string::npos);
}

}  // namespace
}  // namespace vip_slam::phone
