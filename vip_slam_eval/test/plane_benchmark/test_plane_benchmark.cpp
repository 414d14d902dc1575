// SPDX-License-Identifier: BSD-3-Clause
// The commands plane_benchmark and draw_planes on a rendered sequence.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

namespace {

namespace fs = std::filesystem;

class PlaneBenchmark : public ::testing::Test {
 protected:
  void SetUp() override {
    out_ = fs::path(::testing::TempDir()) / "plane_benchmark";
    fs::remove_all(out_);
  }
  void TearDown() override { fs::remove_all(out_); }

  static std::string sequence(const std::string& end) { return std::string(VIP_SLAM_SEQUENCE) + end; }
  static int run(const std::string& command) {
    return WEXITSTATUS(std::system((command + " >/dev/null 2>&1").c_str()));
  }
  std::string benchmark(const std::string& truth) const {
    return std::string(VIP_SLAM_PLANE_BENCHMARK) + " " + sequence(".bag") + " --sensor " + sequence("_sensor.yaml") +
           " --truth " + truth + " --planes-truth " + sequence("_planes.yaml") + " --out " + out_.string();
  }
  std::map<std::string, double> metrics() const {
    std::map<std::string, double> values;
    std::ifstream file(out_ / "metrics.csv");
    std::string line, field;
    std::getline(file, line);
    while (std::getline(file, line)) {
      std::istringstream row(line);
      std::string cells[3];
      for (std::string& cell : cells) std::getline(row, cell, ',');
      values[cells[0] + "/" + cells[1]] = std::stod(cells[2]);
    }
    return values;
  }

  fs::path out_;
};

TEST_F(PlaneBenchmark, FindsTheRoomWithTruePoses) {
  ASSERT_EQ(0, run(benchmark(sequence("_truth.tum"))));
  auto m = metrics();
  EXPECT_GT(m["run/keyframes"], 5);
  EXPECT_GE(m["planes/expected"], 3);
  EXPECT_GE(m["planes/recall"], 95);
  EXPECT_EQ(0, m["planes/duplicates"]);
  EXPECT_EQ(0, m["planes/large false"]);
  EXPECT_LT(m["planes/normal error median"], 0.5);
  EXPECT_LT(m["planes/distance error median"], 0.01);
  EXPECT_GT(m["points on planes/associated"], 50);
  EXPECT_GE(m["points on planes/precision"], 98);
  EXPECT_GT(m["time/keyframe median"], 0);
  EXPECT_GT(m["time/growth frame median"], 0);
  // Of the processor, so that a busy machine does not matter.
  EXPECT_GT(m["time/keyframe computing median"], 0);
  EXPECT_LT(m["time/keyframe computing median"], 10);
  EXPECT_GT(m["time/growth frame computing median"], 0);
  EXPECT_LT(m["time/growth frame computing median"], 3);

  const std::string draw = std::string(VIP_SLAM_DRAW_PLANES) + " " + sequence(".bag") + " --sensor " +
                           sequence("_sensor.yaml") + " --trajectory " + sequence("_truth.tum") + " --planes " +
                           (out_ / "planes.yaml").string() + " --time 2 4 --out " + (out_ / "pictures").string();
  ASSERT_EQ(0, run(draw));
  EXPECT_EQ(2, std::distance(fs::directory_iterator(out_ / "pictures"), fs::directory_iterator()));
}

TEST_F(PlaneBenchmark, RefusesTheTruthOfAnotherTime) {
  fs::create_directories(out_);
  const std::string elsewhere = (out_ / "elsewhere.tum").string();
  std::ofstream(elsewhere) << "1.0 0 0 0 0 0 0 1\n2.0 0 0 0 0 0 0 1\n";
  EXPECT_EQ(1, run(benchmark(elsewhere)));
  EXPECT_FALSE(fs::exists(out_ / "planes.yaml"));
}

}  // namespace
