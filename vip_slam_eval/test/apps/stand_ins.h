// SPDX-License-Identifier: BSD-3-Clause
// Small scripts in place of a workspace's programs, for the tests of commands that call them.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace vip_slam {

class StandIns : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(::testing::TempDir()) / (std::string(test->test_suite_name()) + "_" + test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    // The truth: a circle of 1 m, level, looking ahead.
    std::ofstream truth(folder_ / "truth.tum"), turned(folder_ / "turned.tum");
    for (int k = 0; k < 60; ++k) {
      const double a = 0.1 * k, t = 100 + 0.1 * k;
      truth << t << " " << std::cos(a) << " " << std::sin(a) << " 1 0 0 " << std::sin(a / 2) << " " << std::cos(a / 2)
            << "\n";
      // 2 % too large, in a world that is turned by a right angle about z and shifted; from 0.5 s on.
      if (k >= 5)
        turned << t << " " << 5 - 1.02 * std::sin(a) << " " << 1.02 * std::cos(a) << " 7 0 0 "
               << std::sin(a / 2 + M_PI / 4) << " " << std::cos(a / 2 + M_PI / 4) << "\n";
    }
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void program(const std::string& package, const std::string& name, const std::string& body) {
    const std::filesystem::path file = folder_ / "ws/lib" / package / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << "#!/bin/bash\n" << body << "\n";
    std::filesystem::permissions(file, std::filesystem::perms::owner_all);
  }
  /// Exit status of a script of this package that finds the stand-ins; said() is what it printed.
  int run(const std::string& script, const std::string& arguments) {
    const std::string command = "env -u VIP_SLAM_REAL_DATA CMAKE_PREFIX_PATH=" + path("ws") + " " + script + " --out " +
                                path("out") + " " + arguments + " >" + path("stdout") + " 2>&1";
    const int status = std::system(command.c_str());
    std::ostringstream out;
    out << std::ifstream(path("stdout")).rdbuf();
    said_ = out.str();
    return WEXITSTATUS(status);
  }
  const std::string& said() const { return said_; }
  void expectSaid(const std::string& what) const { EXPECT_NE(said_.find(what), std::string::npos) << what << said_; }

 private:
  std::filesystem::path folder_;
  std::string said_;
};

}  // namespace vip_slam
