// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>

#include "vip_slam_core/util/command_line.h"

namespace vip_slam {
namespace {

struct Parsed {
  std::string bag, out, mode = "fast";
  std::vector<std::string> settings;
  std::vector<double> up;
  double offset = 0.25;
  int threads = 2;
  bool force = false;
  std::optional<int> status;
  std::string messages;
};

Parsed parse(std::vector<const char*> arguments) {
  Parsed p;
  CommandLine line("tool", "Does something.");
  line.argument("bag", p.bag, "the recording");
  line.option("out,o", p.out, "folder");
  line.required("out");
  line.option("mode", p.mode, "how", oneOf("fast, slow"));
  line.option("set", p.settings, "one option as key=value");
  line.option("up", p.up, "up vector", count<double>(3, 3));
  line.option("offset", p.offset, "seconds");
  line.option("threads", p.threads, "number", between(1, 8));
  line.flag("force,f", p.force, "overwrite");
  line.needs("force", "mode");
  arguments.insert(arguments.begin(), "tool");
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  p.status = line.parse(static_cast<int>(arguments.size()), arguments.data());
  p.messages = testing::internal::GetCapturedStderr() + testing::internal::GetCapturedStdout();
  return p;
}

TEST(CommandLine, FillsEverythingThatIsGivenAndKeepsTheDefaults) {
  const Parsed p =
      parse({"x.bag", "--set", "a=1", "--set", "b=2", "-o", "dir", "--up", "0", "-1.5", "2", "--offset", "-0.5"});
  EXPECT_FALSE(p.status) << p.messages;
  EXPECT_EQ(p.bag, "x.bag");
  EXPECT_EQ(p.out, "dir");
  EXPECT_EQ(p.settings, (std::vector<std::string>{"a=1", "b=2"}));
  EXPECT_EQ(p.up, (std::vector<double>{0, -1.5, 2}));
  EXPECT_EQ(p.offset, -0.5);
  EXPECT_EQ(p.mode, "fast");
  EXPECT_EQ(p.threads, 2);
  EXPECT_FALSE(p.force);
}

TEST(CommandLine, AListOptionLeavesTheArgumentBehindItAloneWhenRepeatedWithEquals) {
  const Parsed p = parse({"--set=a=1", "--out=dir", "x.bag"});
  EXPECT_FALSE(p.status) << p.messages;
  EXPECT_EQ(p.bag, "x.bag");
}

TEST(CommandLine, WhatRoslaunchAddsIsNotTheUsers) {
  const Parsed p = parse({"x.bag", "--out", "dir", "__name:=tool", "__log:=/tmp/tool.log"});
  EXPECT_FALSE(p.status) << p.messages;
  EXPECT_EQ(p.bag, "x.bag");
  EXPECT_EQ(p.out, "dir");
}

TEST(CommandLine, HelpShowsPurposeArgumentsAndDefaults) {
  const Parsed p = parse({"--help"});
  EXPECT_EQ(p.status.value_or(-1), 0);
  for (const char* piece : {"Does something.", "tool bag --out ... [options]", "the recording", "--offset", "0.25", "fast"})
    EXPECT_NE(p.messages.find(piece), std::string::npos) << piece << " in:\n" << p.messages;
}

TEST(CommandLine, MistakesAreNamedOnOneLineWithStatusTwo) {
  const struct {
    std::vector<const char*> arguments;
    const char* named;
  } mistakes[] = {{{"--out", "d"}, "bag (the recording) is missing (see"},
                  {{"--out", "d", "--set", "a=1", "x.bag"}, "bag (the recording) is missing; it has to stand before --set"},
                  {{"x.bag"}, "--out is missing"},
                  {{"x.bag", "--out", "d", "--thread", "3"}, "'--thread'"},
                  {{"x.bag", "--out", "d", "--threads", "9"}, "--threads 9: expected a number from 1 to 8"},
                  {{"x.bag", "--out", "d", "--threads", "many"}, "--threads"},
                  {{"x.bag", "--out", "d", "--mode", "odd"}, "--mode odd: expected one of fast, slow"},
                  {{"x.bag", "--out", "d", "--up", "1", "2"}, "--up 1 2: expected 3 values"},
                  {{"x.bag", "y.bag", "--out", "d"}, "too many positional options"},
                  {{"x.bag", "--out", "d", "-f"}, "--force needs --mode"},
                  {{"x.bag", "--out"}, "'--out'"}};
  for (const auto& mistake : mistakes) {
    const Parsed p = parse(mistake.arguments);
    EXPECT_EQ(p.status.value_or(-1), 2) << mistake.named;
    EXPECT_NE(p.messages.find(mistake.named), std::string::npos) << mistake.named << " in: " << p.messages;
    EXPECT_EQ(std::count(p.messages.begin(), p.messages.end(), '\n'), 1) << p.messages;
  }
}

TEST(CommandLine, SettingsAreSplitAtTheirFirstEqualsSign) {
  const auto values = splitSettings({"a/b=1", "c=d=e", "empty="});
  ASSERT_EQ(values.size(), 3u);
  EXPECT_EQ(values[0], std::make_pair(std::string("a/b"), std::string("1")));
  EXPECT_EQ(values[1], std::make_pair(std::string("c"), std::string("d=e")));
  EXPECT_EQ(values[2], std::make_pair(std::string("empty"), std::string()));
  EXPECT_THROW(splitSettings({"a/b"}), std::invalid_argument);
  EXPECT_THROW(splitSettings({"=1"}), std::invalid_argument);
}

}  // namespace
}  // namespace vip_slam
