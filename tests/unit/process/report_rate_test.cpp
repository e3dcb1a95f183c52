#include "proto/text/report_rate.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace hapticd::text {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr ReportRate::Time kBegin{seconds(100)};

TEST(ReportRate, LetsSoManyThroughInASecondAndCountsTheOthers) {
  ReportRate rate(3);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(rate.take(kBegin + milliseconds(i)), 0U);
  for (int i = 0; i < 17; ++i) EXPECT_FALSE(rate.take(kBegin + milliseconds(10 + i)));
  EXPECT_EQ(rate.take(kBegin + seconds(1)), 17U);
  EXPECT_EQ(rate.take(kBegin + seconds(1)), 0U) << "they are counted once";
}

TEST(ReportRate, CountsEachEventOfSeveralThreadsOnce) {
  ReportRate rate(10);
  std::atomic<std::uint64_t> seen{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < 1000; ++i) {
        if (const auto before = rate.take(kBegin)) seen += 1 + *before;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  const auto last = rate.take(kBegin + seconds(1));
  ASSERT_TRUE(last);
  EXPECT_EQ(seen + *last, 4000U);
}

}  // namespace
}  // namespace hapticd::text
