// SPDX-License-Identifier: BSD-3-Clause
// The solver's helper thread: every piece of work is done exactly once, by either thread and however late the helper
// is.
#include <atomic>
#include <chrono>
#include <set>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "../../src/solver/worker.h"

using namespace vip_slam;

namespace {

void spend(double microseconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double, std::micro>(microseconds);
  while (std::chrono::steady_clock::now() < end) {
  }
}

}  // namespace

TEST(Worker, EveryPieceIsDoneOnce) {
  for (const bool helper : {false, true}) {
    Worker worker(helper);
    for (int job = 0; job < 20000; ++job) {
      const int pieces = job % 9;
      std::vector<int> done(pieces, 0);
      worker.share(pieces, [&](int k) { ++done[k]; });
      for (const int count : done) ASSERT_EQ(count, 1) << "job " << job;
      if (job % 2000 == 0) spend(300);  // the helper falls asleep
    }
  }
}

TEST(Worker, WhatTheHelperWroteIsSeen) {
  Worker worker(true);
  std::vector<double> sums(8, 0.0);
  for (int job = 1; job <= 2000; ++job) {
    worker.share(static_cast<int>(sums.size()), [&](int k) {
      spend(2);
      sums[k] += k;
    });
    for (std::size_t k = 0; k < sums.size(); ++k) ASSERT_EQ(sums[k], static_cast<double>(k) * job);
  }
}

// On a processor shared with other programs the helper takes ten times as long: the owner stops using it.
TEST(Worker, ASlowHelperIsGivenUp) {
  Worker worker(true);
  if (!worker.helps()) GTEST_SKIP() << "one processor";
  const std::thread::id owner = std::this_thread::get_id();
  std::atomic<int> helped{0};
  for (int job = 0; job < 200 && worker.helps(); ++job)
    worker.share(2, [&](int) {
      const bool mine = std::this_thread::get_id() == owner;
      if (!mine) ++helped;
      spend(mine ? 100 : 1000);
    });
  if (helped == 0) GTEST_SKIP() << "the helper got no processor";
  EXPECT_FALSE(worker.helps());
}

TEST(Worker, PiecesGoToBoth) {
  Worker worker(true);
  if (!worker.helps()) GTEST_SKIP() << "one processor";
  std::set<std::thread::id> ids;
  std::mutex mutex;
  for (int job = 0; job < 50 && ids.size() < 2; ++job)
    worker.share(4, [&](int) {
      spend(1000);
      const std::lock_guard<std::mutex> lock(mutex);
      ids.insert(std::this_thread::get_id());
    });
  if (ids.size() < 2 && !worker.helps()) GTEST_SKIP() << "the helper got no processor and was given up";
  EXPECT_EQ(ids.size(), 2u);
}
