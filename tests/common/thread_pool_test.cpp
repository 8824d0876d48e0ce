#include "common/thread_pool.hpp"

#include <atomic>
#include <numeric>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

TEST(ThreadPool, RunsEveryIndexOnceOnAnyNumberOfThreads) {
  for (const int threads : {1, 2, 4}) {
    ThreadPool pool(threads);
    EXPECT_EQ(pool.size(), threads);
    for (const std::size_t count : {0U, 1U, 2U, 1000U}) {
      std::vector<std::atomic<int>> calls(count);
      pool.parallel_for(count, [&calls](std::size_t i) { ++calls[i]; });
      for (const auto& c : calls) EXPECT_EQ(c.load(), 1);
    }
  }
}

TEST(ThreadPool, ManyShortLoopsFollowEachOtherSafely) {
  ThreadPool pool(3);
  std::vector<int> values(4, 0);
  for (int round = 0; round < 5000; ++round) {
    pool.parallel_for(values.size(), [&values](std::size_t i) { ++values[i]; });
  }
  EXPECT_EQ(values, std::vector<int>(4, 5000));
}

TEST(ThreadPool, OneThreadRunsInOrderOnTheCaller) {
  ThreadPool pool(1);
  std::vector<std::size_t> order;
  pool.parallel_for(5, [&order](std::size_t i) { order.push_back(i); });
  EXPECT_EQ(order, (std::vector<std::size_t>{0, 1, 2, 3, 4}));
}

TEST(ThreadPool, TheFirstIndexThatThrowsIsReportedAndTheRestStillRuns) {
  for (const int threads : {1, 3}) {
    ThreadPool pool(threads);
    std::atomic<int> calls = 0;
    try {
      pool.parallel_for(100, [&calls](std::size_t i) {
        ++calls;
        if (i % 10 == 7) throw std::runtime_error(std::to_string(i));
      });
      FAIL() << "nothing was thrown";
    } catch (const std::runtime_error& e) {
      EXPECT_STREQ(e.what(), "7");
    }
    EXPECT_EQ(calls.load(), 100);
    pool.parallel_for(3, [&calls](std::size_t) { ++calls; });  // the pool is usable afterwards
    EXPECT_EQ(calls.load(), 103);
  }
}

TEST(ThreadPool, ALoopInsideALoopRunsInline) {
  ThreadPool pool(2);
  std::vector<int> sums(8, 0);
  pool.parallel_for(8, [&](std::size_t i) {
    pool.parallel_for(10, [&](std::size_t j) { sums[i] += static_cast<int>(j); });
  });
  EXPECT_EQ(sums, std::vector<int>(8, 45));
}

TEST(ThreadPool, LoopsFromSeveralThreadsQueueUp) {
  ThreadPool pool(2);
  std::atomic<int> calls = 0;
  std::vector<std::thread> callers;
  for (int t = 0; t < 3; ++t) {
    callers.emplace_back([&] {
      for (int i = 0; i < 50; ++i) pool.parallel_for(10, [&calls](std::size_t) { ++calls; });
    });
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(calls.load(), 1500);
}

TEST(ThreadPool, RefusesFewerThanOneThread) {
  EXPECT_THROW(ThreadPool(0), std::invalid_argument);
}

}  // namespace
}  // namespace ipl_slam
