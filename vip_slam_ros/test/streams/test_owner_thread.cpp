// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <atomic>
#include <future>
#include <stdexcept>
#include <thread>
#include <vector>

#ifdef __linux__
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

#include <gtest/gtest.h>

#include "vip_slam_ros/owner_thread.h"

namespace vip_slam {
namespace {

TEST(OwnerThread, KeepsTheOrderAcrossLanes) {
  OwnerThread owner([](const std::string&) {});
  const auto a = owner.addLane("a", 10), b = owner.addLane("b", 10);
  std::vector<int> order;
  for (int i = 0; i < 10; ++i) owner.post(i % 2 ? a : b, [&order, i] { order.push_back(i); });
  owner.start();
  EXPECT_TRUE(owner.call(
      a, [] {}, 10));
  EXPECT_EQ(order, (std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9}));
}

TEST(OwnerThread, AFullLaneLosesItsOldestOnly) {
  OwnerThread owner([](const std::string&) {});
  const auto data = owner.addLane("data", 2), control = owner.addLane("control", 10);
  std::vector<int> order;
  owner.post(control, [&order] { order.push_back(100); });
  for (int i = 0; i < 5; ++i) owner.post(data, [&order, i] { order.push_back(i); });
  EXPECT_EQ(owner.lanes()[data].dropped, 3u);
  EXPECT_EQ(owner.lanes()[data].waiting, 2u);
  owner.start();
  EXPECT_TRUE(owner.call(
      control, [] {}, 10));
  EXPECT_EQ(order, (std::vector<int>{100, 3, 4}));
  EXPECT_EQ(owner.lanes()[control].dropped, 0u);
}

TEST(OwnerThread, ExceptionsReachWhoeverCares) {
  std::string words;
  OwnerThread owner([&words](const std::string& what) { words = what; });
  const auto lane = owner.addLane("work", 10);
  owner.start();
  owner.post(lane, [] { throw std::runtime_error("spilt"); });
  EXPECT_THROW(owner.call(
                   lane, [] { throw std::invalid_argument("asked"); }, 10),
               std::invalid_argument);
  EXPECT_EQ(words, "work: spilt");
}

TEST(OwnerThread, ACallThatComesTooLateNeverRuns) {
  OwnerThread owner([](const std::string&) {});
  const auto lane = owner.addLane("work", 10);
  owner.start();
  std::promise<void> release;
  owner.post(lane, [&] { release.get_future().wait(); });
  std::atomic<bool> ran{false};
  EXPECT_FALSE(owner.call(
      lane, [&] { ran = true; }, 0.05));
  release.set_value();
  EXPECT_TRUE(owner.call(
      lane, [] {}, 10));
  EXPECT_FALSE(ran);
}

#ifdef __linux__
TEST(OwnerThread, GivesWayWhenAskedTo) {
  const auto niceness = [] { return getpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid))); };
  const int before = niceness();
  OwnerThread owner([](const std::string&) {});
  const auto lane = owner.addLane("work", 10);
  int inside = 0, of_its_thread = 0;
  owner.start(3);
  EXPECT_TRUE(owner.call(
      lane,
      [&] {
        inside = niceness();
        std::thread([&] { of_its_thread = niceness(); }).join();
      },
      10));
  EXPECT_EQ(inside, std::min(before + 3, 19));
  EXPECT_EQ(of_its_thread, inside);
  EXPECT_EQ(niceness(), before);
}
#endif

TEST(OwnerThread, StopsWithWorkWaiting) {
  auto owner = std::make_unique<OwnerThread>([](const std::string&) {});
  const auto lane = owner->addLane("work", 10);
  owner->post(lane, [] {});
  owner->start();
  owner->stop();
  EXPECT_FALSE(owner->post(lane, [] {}));
}

TEST(OwnerThread, ACallIsNotKeptWaitingForWhatNeverRuns) {
  OwnerThread owner([](const std::string&) {});
  const auto lane = owner.addLane("work", 1);
  const auto nothing = [] {};
  std::promise<void> release;
  std::promise<void> begun;
  owner.start();
  owner.post(lane, [&] {
    begun.set_value();
    release.get_future().wait();
  });
  begun.get_future().wait();
  // A later task replaces it in the lane.
  auto dropped = std::async(std::launch::async, [&] { return owner.call(lane, nothing, 100); });
  while (owner.lanes()[lane].waiting == 0) std::this_thread::yield();
  owner.post(lane, nothing);
  EXPECT_FALSE(dropped.get());
  // The thread stops before its turn comes.
  auto forgotten = std::async(std::launch::async, [&] { return owner.call(lane, nothing, 100); });
  while (owner.lanes()[lane].dropped < 2) std::this_thread::yield();
  std::thread stopping([&owner] { owner.stop(); });
  EXPECT_FALSE(forgotten.get());
  release.set_value();
  stopping.join();
  EXPECT_EQ(owner.lanes()[lane].waiting, 0u);
  // It has stopped already.
  EXPECT_FALSE(owner.call(lane, nothing, 100));
}

}  // namespace
}  // namespace vip_slam
