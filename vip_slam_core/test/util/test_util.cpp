// SPDX-License-Identifier: BSD-3-Clause
// Options, text, timing, atomic files, and the bounded queue.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "util/text.h"
#include "vip_slam_core/util/atomic_file.h"
#include "vip_slam_core/util/options.h"
#include "vip_slam_core/util/output_folder.h"
#include "vip_slam_core/util/timing.h"

namespace vip_slam {
namespace {

namespace fs = std::filesystem;

struct InnerOptions {
  double radius = 2.5;
  void visit(OptionVisitor& v) { v.field("radius", radius, 0.5, 10.0, "search radius, px"); }
};
struct SomeOptions {
  int count = 200;
  bool enabled = true;
  std::string mode = "fast", label;
  InnerOptions inner;
  void visit(OptionVisitor& v) {
    v.field("count", count, 20, 2000, "features kept");
    v.field("enabled", enabled, "use it");
    v.field("mode", mode, {"fast", "exact"}, "how");
    v.field("label", label, {}, "any name");
    v.group("inner", inner);
  }
};

std::string textOf(const fs::path& path) {
  std::ostringstream out;
  out << std::ifstream(path).rdbuf();
  return out.str();
}

class Files : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              (std::string("util_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  fs::path folder_;
};

// The message of the exception that setting `values` throws.
std::string refusal(const std::vector<std::pair<std::string, std::string>>& values) {
  SomeOptions options;
  try {
    setOptions(options, values);
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(options.count, 200) << "options changed though refused";
    return error.what();
  }
  return "accepted";
}

TEST(Options, SetAndList) {
  SomeOptions options;
  setOptions(options,
             {{"count", "300"}, {"enabled", "false"}, {"mode", "exact"}, {"label", "a b"}, {"inner/radius", "3"}});
  EXPECT_EQ(options.count, 300);
  EXPECT_FALSE(options.enabled);
  EXPECT_EQ(options.mode, "exact");
  EXPECT_EQ(options.label, "a b");
  EXPECT_EQ(options.inner.radius, 3);
  const auto rows = listOptions(options);
  ASSERT_EQ(rows.size(), 5u);
  EXPECT_EQ(rows[0].name, "count");
  EXPECT_EQ(rows[0].value, "300");
  EXPECT_EQ(rows[4].name, "inner/radius");
  EXPECT_EQ(rows[4].type, "double");
  const std::string reference = optionReference("Some", rows);
  EXPECT_NE(reference.find("`inner/radius` | 3 |"), std::string::npos) << reference;
  EXPECT_NE(reference.find("search radius, px"), std::string::npos);
}

TEST(Options, RefusalsNameKeyValueAndExpectation) {
  EXPECT_NE(refusal({{"count", "3000"}}).find("count: '3000'"), std::string::npos);
  EXPECT_NE(refusal({{"count", "3000"}}).find("20 to 2000"), std::string::npos);
  EXPECT_NE(refusal({{"count", "12.5"}}).find("whole number"), std::string::npos);
  EXPECT_NE(refusal({{"count", ""}}), "accepted");
  EXPECT_NE(refusal({{"enabled", "maybe"}}).find("true or false"), std::string::npos);
  EXPECT_NE(refusal({{"mode", "slow"}}).find("fast, exact"), std::string::npos);
  EXPECT_NE(refusal({{"inner/radius", "0.1"}}).find("inner/radius"), std::string::npos);
  EXPECT_NE(refusal({{"inner/radius", "nan"}}), "accepted");
  EXPECT_NE(refusal({{"inner/radius", "3 px"}}), "accepted");
  const std::string unknown = refusal({{"inner/radios", "3"}});
  EXPECT_NE(unknown.find("inner/radios"), std::string::npos);
  EXPECT_NE(unknown.find("did you mean 'inner/radius'"), std::string::npos) << unknown;
  // All or nothing: the good value before the bad one is not kept.
  EXPECT_NE(refusal({{"count", "500"}, {"mode", "slow"}}), "accepted");
}

TEST(Options, ANameWithNothingInCommonIsNotSuggested) {
  EXPECT_EQ(refusal({{"xyz", "3"}}).find("did you mean"), std::string::npos) << refusal({{"xyz", "3"}});
}

TEST_F(Files, AnOutputFolderIsMadeAndTried) {
  prepareOutputFolder(path("a/b"));
  EXPECT_TRUE(std::filesystem::is_empty(path("a/b")));
  std::ofstream(path("file")) << "x";
  EXPECT_THROW(prepareOutputFolder(path("file")), std::runtime_error);
  EXPECT_THROW(prepareOutputFolder("/proc/vip_slam"), std::runtime_error);
  EXPECT_THROW(prepareOutputFolder("/proc"), std::runtime_error);  // exists but is not writable
}

TEST_F(Files, OptionsFromYaml) {
  std::ofstream(path("o.yaml")) << "front:\n  count: 77\n  inner:\n    radius: 4.5\nother: 3\n";
  SomeOptions options;
  loadOptions(options, path("o.yaml"), "front");
  EXPECT_EQ(options.count, 77);
  EXPECT_EQ(options.inner.radius, 4.5);
  const auto refused = [&](const std::string& yaml, const std::string& what) {
    std::ofstream(path("bad.yaml")) << yaml;
    try {
      loadOptions(options, path("bad.yaml"), "front");
      ADD_FAILURE() << yaml;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("bad.yaml"), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
    EXPECT_EQ(options.count, 77);
  };
  refused("front: {cuont: 5}", "did you mean 'count'");
  refused("front: {count: 5}", "20 to 2000");
  refused("front: {count: [5, 6]}", "count");
  refused("front: {count: 5", "line");
  refused("front: 7", "map");
  EXPECT_THROW(loadOptions(options, path("missing.yaml"), ""), std::invalid_argument);
}

TEST(Text, NumbersReadBackAndNonsenseDoesNot) {
  for (const double x : {0.0, 0.1, 1.0 / 3, -2.5e-7, 1e22, 123456789.123456789, M_PI}) {
    double back;
    ASSERT_TRUE(parseDouble(formatDouble(x), &back));
    EXPECT_EQ(back, x);
  }
  EXPECT_EQ(formatDouble(0.1), "0.1");
  double d;
  for (const char* bad : {"", " 1", "1 ", "1x", "x", "--1", "1,5"}) EXPECT_FALSE(parseDouble(bad, &d)) << bad;
  int i;
  EXPECT_TRUE(parseInt("-12", &i) && i == -12);
  for (const char* bad : {"", "1.0", "99999999999", "a", "1 "}) EXPECT_FALSE(parseInt(bad, &i)) << bad;
  bool b;
  EXPECT_TRUE(parseBool("True", &b) && b);
  EXPECT_TRUE(parseBool("off", &b) && !b);
  EXPECT_FALSE(parseBool("2", &b));
}

TEST_F(Files, AppearWholeOrNotAtAll) {
  {
    AtomicFile file(path("a.txt"));
    file.stream() << "half";
  }
  EXPECT_EQ(entries(), 0u);  // no commit: nothing, not even the temporary
  {
    AtomicFile file(path("a.txt"));
    file.stream() << "whole";
    EXPECT_FALSE(fs::exists(path("a.txt")));
    file.commit();
  }
  EXPECT_EQ(textOf(path("a.txt")), "whole");
  {
    AtomicFile file(path("a.txt"));
    file.stream() << "other";
  }
  EXPECT_EQ(textOf(path("a.txt")), "whole");  // the old one survives
  EXPECT_EQ(entries(), 1u);
  try {
    AtomicFile file(path("no_such_folder/a.txt"));
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("no_such_folder/a.txt"), std::string::npos);
  }
}

TEST_F(Files, TimingSummaryAndCsv) {
  TimingLog log;
  for (int k = 1; k <= 100; ++k) log.add("stage", 0.1 * k, k, 0.5 * k);
  log.add("another", 1, 5, 4);
  const TimingSummary s = log.summary("stage");
  EXPECT_EQ(s.count, 100u);
  EXPECT_DOUBLE_EQ(s.mean, 50.5);
  EXPECT_DOUBLE_EQ(s.median, 50.5);
  EXPECT_DOUBLE_EQ(s.p99, 99);
  EXPECT_DOUBLE_EQ(s.max, 100);
  EXPECT_DOUBLE_EQ(log.summary("stage", TimingLog::Clock::kProcessor).max, 50);
  EXPECT_EQ(log.summary("nothing").count, 0u);
  log.writeCsv(path("t.csv"));
  const std::string csv = textOf(path("t.csv"));
  EXPECT_EQ(csv.substr(0, csv.find('\n', 20)), "stage,t,ms,cpu_ms\nanother,1.000000000,5.0000,4.0000");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 102);
  EXPECT_THROW(log.writeCsv(path("no/t.csv")), std::runtime_error);
  { ScopedTimer timer(&log, "scope", 3); }
  { ScopedTimer timer(nullptr, "scope", 3); }
  EXPECT_EQ(log.summary("scope").count, 1u);
}

TEST(Timing, ProcessorTimeLeavesWaitingOut) {
  TimingLog log;
  {
    ScopedTimer timer(&log, "waits", 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  {
    ScopedTimer timer(&log, "works", 0);
    const double start = threadTimeMs();
    while (threadTimeMs() < start + 20) {
    }
  }
  EXPECT_GE(log.summary("waits").max, 50);
  EXPECT_LT(log.summary("waits", TimingLog::Clock::kProcessor).max, 10);
  EXPECT_GE(log.summary("works", TimingLog::Clock::kProcessor).max, 20);
  EXPECT_GE(log.summary("works").max, 19.9);
}

}  // namespace
}  // namespace vip_slam
