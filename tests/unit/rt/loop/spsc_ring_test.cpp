#include "rt/loop/spsc_ring.h"

#include <gtest/gtest.h>

#include <thread>

namespace hapticd::rt {
namespace {

TEST(SpscRing, KeepsOrderAndRefusesWhenFull) {
  SpscRing<int> ring(5);
  ASSERT_EQ(ring.capacity(), 8U);
  for (int i = 0; i < 8; ++i) EXPECT_TRUE(ring.push(i));
  EXPECT_FALSE(ring.push(8));
  int value = -1;
  EXPECT_TRUE(ring.pop(value));
  EXPECT_EQ(value, 0);
  EXPECT_TRUE(ring.push(8));
  for (int i = 1; i <= 8; ++i) {
    ASSERT_TRUE(ring.pop(value));
    EXPECT_EQ(value, i);
  }
  EXPECT_FALSE(ring.pop(value));
}

TEST(SpscRing, BetweenTwoThreadsNothingIsLostOrTorn) {
  struct Pair {
    std::uint64_t number;
    std::uint64_t complement;
  };
  SpscRing<Pair> ring(64);
  constexpr std::uint64_t kCount = 200'000;
  std::thread producer([&ring] {
    for (std::uint64_t i = 0; i < kCount;) {
      if (ring.push({i, ~i})) {
        ++i;
      } else {
        std::this_thread::yield();
      }
    }
  });
  Pair pair{};
  for (std::uint64_t expected = 0; expected < kCount;) {
    if (!ring.pop(pair)) {
      std::this_thread::yield();
      continue;
    }
    ASSERT_EQ(pair.number, expected);
    ASSERT_EQ(pair.complement, ~expected);
    ++expected;
  }
  producer.join();
}

}  // namespace
}  // namespace hapticd::rt
