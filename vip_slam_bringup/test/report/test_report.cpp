// SPDX-License-Identifier: BSD-3-Clause
// make_report on a small synthetic run: the page is self-contained, has the right numbers, and bad input is named.
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

namespace fs = std::filesystem;

namespace {

struct Outcome {
  int status;
  std::string output;
};

Outcome run(const std::string& arguments) {
  const std::string command = std::string("/usr/bin/python3 ") + SCRIPT + " " + arguments + " 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  std::string output;
  std::array<char, 512> buffer;
  while (fgets(buffer.data(), buffer.size(), pipe)) output += buffer.data();
  const int status = pclose(pipe);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, output};
}

std::string slurp(const fs::path& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// A walk round a 6 x 5 m room: the estimate is the truth turned by 90 degrees, shifted, and bent by 2 cm.
class Report : public testing::Test {
 protected:
  void SetUp() override {
    const char* kept = std::getenv("VIP_SLAM_KEEP_REPORT");  // to look at the page by hand
    dir_ = kept ? fs::path(kept) : fs::temp_directory_path() / ("vip_slam_report_" + std::to_string(::getpid()));
    keep_ = kept != nullptr;
    fs::remove_all(dir_);
    fs::create_directories(dir_);
    std::ofstream trajectory(dir_ / "trajectory.tum"), odometry(dir_ / "odometry.tum"), truth(dir_ / "truth.tum");
    std::ofstream timing(dir_ / "timing.csv");
    timing << "stage,t,ms,cpu_ms\n";
    char line[200];
    const int images = 1200;
    double sum = 0;
    for (int i = 0; i < images; ++i) {
      const double s = double(i) / images, t = 1000.0 + 0.05 * i, phase = 4 * M_PI * s;
      const double x = 2.1 * std::cos(phase), y = 1.6 * std::sin(phase), z = 1.4 + 0.15 * std::sin(5 * phase);
      const double yaw = phase + M_PI / 2, bend = 0.02 * std::sqrt(2.0) * std::sin(20 * M_PI * s);
      std::snprintf(line, sizeof(line), "%.9f %.9f %.9f %.9f 0 0 %.9f %.9f\n", t, x, y, z, std::sin(yaw / 2),
                    std::cos(yaw / 2));
      truth << line;
      sum += bend * bend;
      const double half = (yaw + M_PI / 2) / 2;
      std::snprintf(line, sizeof(line), "%.9f %.9f %.9f %.9f 0 0 %.9f %.9f\n", t, -y, x, z + bend, std::sin(half),
                    std::cos(half));
      trajectory << line;
      std::snprintf(line, sizeof(line), "%.9f %.9f %.9f %.9f 0 0 %.9f %.9f\n", t, -y * (1 + 0.05 * s), x + 0.12 * s,
                    z + bend, std::sin(half), std::cos(half));
      odometry << line;
      std::snprintf(line, sizeof(line), "frontend.track,%.3f,%.4f,1.5\nfrontend.update,%.3f,%.4f\n", t,
                    3 + std::sin(0.7 * i), t, 1.2 + 0.3 * std::cos(1.3 * i));
      timing << line;
      if (i % 20 == 0) {
        std::snprintf(line, sizeof(line), "planes.detect,%.3f,%.4f\nbackend.local_ba,%.3f,%.4f\n", t,
                      6 + 2 * std::sin(i), t, 25 + 20 * s + 8 * std::sin(3.0 * i));
        timing << line;
      }
    }
    rmse_ = std::sqrt(sum / images);
    // The estimate's world: (x, y) -> (-y, x).
    std::ofstream(dir_ / "planes.yaml") << planesYaml(true);
    std::ofstream(dir_ / "planes_truth.yaml") << planesYaml(false);
    std::ofstream(dir_ / "summary.yaml")
        << "bag: /somewhere/room.bag\nsensor: simulator\nvariant: vip\nloop_closing: true\nfinished: true\nduration: "
           "59.95\n"
           "processing_time: 11.2\nreal_time_factor: 5.35\npeak_memory_mb: 312\nimages: 1200\ntracked_images: 1178\n"
           "keyframes: 61\nlandmarks: 1840\nplane_landmarks: 1130\nplanes: 6\ndistance: 23.6\nepochs: 1\n"
           "counters: {dropped_images: 0, imu_gaps: 2}\n"
           "states:\n- {t: 999.0, state: WAITING, reason: no IMU yet}\n- {t: 1000.0, state: INITIALISING, reason: "
           "standing still}\n"
           "- {t: 1001.1, state: TRACKING, reason: ''}\n- {t: 1031.0, state: DEGRADED, reason: few features}\n- {t: "
           "1033.0, state: TRACKING, reason: ''}\n"
           "loops:\n- {t: 1032.5, t_match: 1002.5, query: 33, match: 3, accepted: true, inliers: 84, reason: 84 "
           "inliers and 2 planes agree}\n"
           "- {t: 1044.0, query: 45, match: 9, accepted: false, inliers: 12, reason: 'too few inliers </script>'}\n"
           "global_ba:\n- {t: 1033.2, keyframes: 34, iterations: 8, ms: 190.5}\nwarnings: [2 gaps in the IMU were "
           "bridged]\n";
  }
  void TearDown() override {
    if (!keep_) fs::remove_all(dir_);
  }

  static std::string planesYaml(bool estimate) {
    struct P {
      int id;
      const char* kind;
      double n[3], d;
      double corner[4][3];
    };
    const double X = 3, Y = 2.5, H = 2.6;
    const P planes[] = {
        {1, "horizontal", {0, 0, 1}, 0, {{-X, -Y, 0}, {X, -Y, 0}, {X, Y, 0}, {-X, Y, 0}}},
        {2, "horizontal", {0, 0, -1}, H, {{-X, -Y, H}, {X, -Y, H}, {X, Y, H}, {-X, Y, H}}},
        {3, "vertical", {1, 0, 0}, X, {{-X, -Y, 0}, {-X, Y, 0}, {-X, Y, H}, {-X, -Y, H}}},
        {4, "vertical", {-1, 0, 0}, X, {{X, -Y, 0}, {X, Y, 0}, {X, Y, H}, {X, -Y, H}}},
        {5, "vertical", {0, 1, 0}, Y, {{-X, -Y, 0}, {X, -Y, 0}, {X, -Y, H}, {-X, -Y, H}}},
        {6, "vertical", {0, -1, 0}, Y, {{-X, Y, 0}, {X, Y, 0}, {X, Y, H}, {-X, Y, H}}},
        {7, "horizontal", {0, 0, 1}, -0.75, {{-2.8, 1.2, .75}, {-1.2, 1.2, .75}, {-1.2, 2.3, .75}, {-2.8, 2.3, .75}}},
    };
    std::ostringstream out;
    out << "planes:\n";
    for (const P& p : planes) {
      if (estimate && p.id == 2) continue;  // the ceiling was not found
      const auto turned = [&](const double* v) {
        std::ostringstream s;
        if (estimate)
          s << "[" << -v[1] << ", " << v[0] << ", " << v[2] << "]";
        else
          s << "[" << v[0] << ", " << v[1] << ", " << v[2] << "]";
        return s.str();
      };
      out << "- {id: " << p.id << ", kind: " << p.kind << ", normal: " << turned(p.n) << ", distance: " << p.d
          << ", area: 10, polygons: [{outer: [";
      for (int k = 0; k < 4; ++k) out << (k ? ", " : "") << turned(p.corner[k]);
      out << "], holes: []}]}\n";
      if (!estimate && p.id == 7) {  // too small and too briefly in view to count for recall
        out << "- {id: 8, kind: vertical, normal: [1, 0, 0], distance: 1, area: 4, seen_seconds: 0.4, seen_area: 0.2, "
               "polygons: []}\n";
      }
    }
    return out.str();
  }

  YAML::Node dataOf(const std::string& html) {  // JSON is YAML
    const std::string open = "<script type=\"application/json\" id=\"data\">";
    const auto begin = html.find(open) + open.size();
    std::string json = html.substr(begin, html.find("</script>", begin) - begin);
    return YAML::Load(std::regex_replace(json, std::regex("<\\\\/"), "</"));
  }

  fs::path dir_;
  bool keep_ = false;
  double rmse_ = 0;
};

/// Along a straight line with errors of 5 mm across it the positions say nothing of the turn about the line.
TEST_F(Report, OrientationsOnAStraightPathAreComparedByYaw) {
  const auto rotationOf = [&](double wobble, double tilt, std::string* aligned_by) {
    std::ofstream trajectory(dir_ / "trajectory.tum"), truth(dir_ / "truth.tum");
    char line[200];
    for (int i = 0; i < 400; ++i) {
      const double t = 1000 + 0.05 * i, x = 0.01 * i, side = wobble * std::sin(0.5 * i),
                   turn = 0.0087;  // half a degree
      std::snprintf(line, sizeof line, "%.3f %.9f 0 1 0 0 0 1\n", t, x);
      truth << line;
      // Half a degree off about z, for half of the way to either side; the world is tilted about x.
      const double yaw = i < 200 ? turn : -turn;
      std::snprintf(line, sizeof line, "%.3f %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n", t, x, side * std::cos(0.3 * i),
                    1 + side, std::sin(tilt / 2) * std::cos(yaw / 2), -std::sin(tilt / 2) * std::sin(yaw / 2),
                    std::cos(tilt / 2) * std::sin(yaw / 2), std::cos(tilt / 2) * std::cos(yaw / 2));
      trajectory << line;
    }
    trajectory.close(), truth.close();
    const Outcome outcome = run("--out-dir " + dir_.string() + " --truth " + (dir_ / "truth.tum").string());
    EXPECT_EQ(outcome.status, 0) << outcome.output;
    const YAML::Node data = dataOf(slurp(dir_ / "report.html"));
    *aligned_by = data["error"]["rotation_aligned_by"].as<std::string>();
    return data["error"]["rotation_rmse"].as<double>();
  };
  std::string aligned_by;
  EXPECT_NEAR(rotationOf(0.005, 0, &aligned_by), 0.5, 0.05);
  EXPECT_EQ(aligned_by, "yaw");
  EXPECT_NEAR(rotationOf(0.005, 0.4, &aligned_by), 0.5, 0.05) << "worlds that are not level with each other";
  EXPECT_EQ(aligned_by, "orientations");
}

TEST_F(Report, HoldsTheRunsNumbersInOneFile) {
  const Outcome outcome = run("--out-dir " + dir_.string() + " --truth " + (dir_ / "truth.tum").string() +
                              " --planes-truth " + (dir_ / "planes_truth.yaml").string());
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const std::string html = slurp(dir_ / "report.html");
  for (const char* outside : {"http://", "https://", "src=", "href=", "@import", "url("})
    EXPECT_EQ(html.find(outside), std::string::npos) << outside;
  EXPECT_EQ(html.find("@STYLE@"), std::string::npos);
  const YAML::Node data = dataOf(html);
  EXPECT_NEAR(data["error"]["ate"].as<double>(), rmse_, 2e-4);
  EXPECT_LT(data["error"]["rotation_rmse"].as<double>(), 0.5);
  EXPECT_EQ(data["error"]["rotation_aligned_by"].as<std::string>(), "positions");
  EXPECT_EQ(data["error"]["count"].as<int>(), 1200);
  EXPECT_EQ(data["plane_report"]["matched"].as<int>(), 6);
  EXPECT_EQ(data["plane_report"]["true_count"].as<int>(), 7);
  EXPECT_EQ(data["plane_report"]["duplicates"].as<int>(), 0);
  for (const auto& row : data["plane_report"]["rows"]) {
    EXPECT_EQ(row["truth"].as<int>(), row["id"].as<int>());
    EXPECT_LT(row["distance"].as<double>(), 0.01);
  }
  EXPECT_EQ(data["stages"].size(), 4u);
  for (const auto& stage : data["stages"]) {
    if (stage["name"].as<std::string>() == "frontend.update") EXPECT_TRUE(stage["cpu_mean"].IsNull());
    if (stage["name"].as<std::string>() != "frontend.track") continue;
    EXPECT_EQ(stage["count"].as<int>(), 1200);
    EXPECT_NEAR(stage["median"].as<double>(), 3.0, 0.05);
    EXPECT_NEAR(stage["max"].as<double>(), 4.0, 0.01);
    EXPECT_EQ(stage["cpu_mean"].as<double>(), 1.5);
  }
}

TEST_F(Report, LivesWithATrajectoryAlone) {
  for (const char* name : {"odometry.tum", "planes.yaml", "timing.csv", "summary.yaml"}) fs::remove(dir_ / name);
  const Outcome outcome = run("--out-dir " + dir_.string());
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_EQ(dataOf(slurp(dir_ / "report.html"))["missing"].size(), 4u);
}

TEST_F(Report, LivesWithAClockThatWasSetBack) {
  std::ofstream(dir_ / "trajectory.tum") << "1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n1.5 2 0 0 0 0 0 1\n2.5 3 0 0 0 0 0 1\n";
  const Outcome outcome = run("--out-dir " + dir_.string());
  ASSERT_EQ(outcome.status, 0) << outcome.output;
}

TEST_F(Report, NamesWhatItCannotRead) {
  const auto expect = [&](const std::string& arguments, const std::string& words) {
    fs::remove(dir_ / "report.html");
    const Outcome outcome = run(arguments);
    EXPECT_NE(outcome.status, 0) << arguments;
    EXPECT_NE(outcome.output.find(words), std::string::npos) << outcome.output;
    EXPECT_EQ(std::count(outcome.output.begin(), outcome.output.end(), '\n'), 1) << outcome.output;
    EXPECT_FALSE(fs::exists(dir_ / "report.html"));
  };
  const std::string folder = "--out-dir " + dir_.string();
  expect("--out-dir /nowhere", "/nowhere: is not a folder");
  expect(folder + " --truth /nowhere.tum", "/nowhere.tum: is not there");
  std::ofstream(dir_ / "timing.csv") << "stage,t,ms\na,1,2\na,b,c\n";
  expect(folder, "timing.csv:3: expected stage,t,ms[,cpu_ms]");
  std::ofstream(dir_ / "planes.yaml") << "planes: [{id: 1}]\n";
  expect(folder, "planes.yaml: plane 1");
  std::ofstream(dir_ / "trajectory.tum") << "1 0 0 0 0 0 0 1\n0.9 0 0 0 0 0 0 1\n0.8 0 0 0 0 0 0 1\n";
  expect(folder, "trajectory.tum:2: the stamp does not follow");
  fs::remove(dir_ / "trajectory.tum");
  fs::remove(dir_ / "odometry.tum");
  expect(folder, "neither trajectory.tum nor odometry.tum");
}

}  // namespace
