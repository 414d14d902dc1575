// SPDX-License-Identifier: BSD-3-Clause
// The tables command with small scripts in place of the programs it calls: handling of failures, and which runs are repeated.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace {

namespace fs = std::filesystem;

class TablesCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              ("tables_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    // run_bag BAG --sensor S --variant V --loop L --out DIR --no-report
    program("vip_slam_bringup", "run_bag",
            R"(
name=$(basename "$1" .bag); echo "$name $5 $7" >> )" +
                path("calls") + R"(
case $name in lost) echo "run_bag: $1: no pose" >&2; exit 2;; slow) sleep 20;; esac
: > "$9/trajectory.tum"
echo "real_time_factor: 2" > "$9/summary.yaml"; echo "peak_memory_mb: 90" >> "$9/summary.yaml"
[ "$name" != stopped ] || echo "finished: false" >> "$9/summary.yaml"
[ "$name $7" = "looped on" ] && echo "  - {accepted: true}" >> "$9/summary.yaml"; exit 0)");
    // evaluate --truth T --estimate E --out DIR
    program("vip_slam_eval", "evaluate", R"(
covered=99; case $2 in */short_truth.tum) covered=40;; esac
ate=0.0123; case $4 in */vip-*) ate=0.0045;; esac
mkdir -p "$6"; exec > "$6/metrics.csv"
printf '"ATE, SE3 aligned",position rmse,%s,m\n' $ate
printf 'trajectory,time covered,%s,%%\ntrajectory,true path,10,m\n' $covered)");
    program("vip_slam_sim", "render_sequence", R"(
case $1 in unknown) echo "sequence is not known" >&2; exit 1;; esac
for end in .bag _sensor.yaml _truth.tum; do : > "$3/$1$end"; done)");
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  static std::string text(const std::string& file) {
    std::ostringstream out;
    out << std::ifstream(file).rdbuf();
    return out.str();
  }
  int run(const std::string& arguments) {
    const std::string command = "CMAKE_PREFIX_PATH=" + path("ws") + " " + VIP_SLAM_TABLES + " --jobs 1 --out " +
                                path("out") + " " + arguments + " >" + path("stdout") + " 2>&1";
    const int status = std::system(command.c_str());
    table_ = text(path("out/tables.md"));
    return WEXITSTATUS(status);
  }
  bool says(const std::string& what) const { return table_.find(what) != std::string::npos; }
  std::size_t calls() const {
    const std::string all = text(path("calls"));
    return static_cast<std::size_t>(std::count(all.begin(), all.end(), '\n'));
  }

  fs::path folder_;
  std::string table_;

 private:
  void program(const std::string& package, const std::string& name, const std::string& body) {
    const fs::path home = folder_ / "ws" / "lib" / package;
    fs::create_directories(home);
    std::ofstream(home / name) << "#!/bin/bash\n" << body << "\n";
    fs::permissions(home / name, fs::perms::owner_all);
  }
};

TEST_F(TablesCommand, AFailureIsAnXAndItsReasonIsTold) {
  EXPECT_EQ(run("--sequences good lost short unknown slow stopped --variants vi vip --timeout 1"), 1);
  EXPECT_TRUE(says("| good | 1.23 / 1.23 | 0.45 / 0.45 |")) << table_;
  for (const char* name : {"lost", "short", "unknown", "slow", "stopped"})
    EXPECT_TRUE(says("| " + std::string(name) + " | X / X | X / X |")) << table_;
  EXPECT_TRUE(says("| mean | X / X | X / X |")) << table_;
  EXPECT_TRUE(says("- lost, VI-SLAM, loop closing on: exit status 2: run_bag: lost.bag: no pose")) << table_;
  EXPECT_TRUE(says("- short, VIP-SLAM, loop closing off: only 40 % of the time has a pose")) << table_;
  EXPECT_TRUE(says("- slow, VI-SLAM, loop closing on: took longer than 1 s")) << table_;
  EXPECT_TRUE(says("- stopped, VI-SLAM, loop closing on: interrupted")) << table_;
  EXPECT_TRUE(says("- unknown, VI-SLAM, loop closing on: rendering: exit status 1: sequence is not known")) << table_;
  EXPECT_FALSE(says(folder_.string())) << table_;
  EXPECT_FALSE(says("not better")) << table_;
}

TEST_F(TablesCommand, WhatWasRunStaysAndFailuresAreRunAgainOnDemand) {
  EXPECT_EQ(run("--sequences good lost --variants vip --run-all"), 1);
  EXPECT_EQ(calls(), 4u);
  EXPECT_EQ(run("--sequences good lost --variants vip --run-all"), 1);
  EXPECT_EQ(calls(), 4u);
  EXPECT_EQ(run("--sequences good lost --variants vip --run-all --retry-failed"), 1);
  EXPECT_EQ(calls(), 6u);
}

TEST_F(TablesCommand, ARunThatClosedNoLoopCountsForBothColumns) {
  EXPECT_EQ(run("--sequences good looped --variants vip"), 0);
  EXPECT_EQ(text(path("calls")), "good vip on\nlooped vip on\nlooped vip off\n");
  EXPECT_TRUE(says("| mean | 0.45 / 0.45 |")) << table_;
}

TEST_F(TablesCommand, TheSecondTableIsOfTheFlightsLikeEuRoC) {
  EXPECT_EQ(run("--table II --variants vi vip"), 0);
  for (const char* name : {"v1_01", "v1_02", "v1_03", "v2_01", "v2_02", "v2_03"})
    EXPECT_TRUE(says("| " + std::string(name) + " | 1.23 / 1.23 | 0.45 / 0.45 |")) << table_;
  EXPECT_TRUE(says("| mean | 1.23 / 1.23 | 0.45 / 0.45 |")) << table_;
}

}  // namespace
