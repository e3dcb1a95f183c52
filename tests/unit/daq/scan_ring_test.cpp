#include "hal/daq/scan_ring.h"

#include <gtest/gtest.h>

#include <array>
#include <thread>

namespace hapticd::daq {
namespace {

Scan numbered(std::int64_t number) {
  Scan scan{.time_ns = number};
  scan.volts.fill(static_cast<double>(number));
  return scan;
}

TEST(ScanRing, GivesTheNewestAndCountsWhatItDrops) {
  ScanRing ring(16);
  for (std::int64_t k = 0; k < 10; ++k) EXPECT_TRUE(ring.push(numbered(k)));
  std::array<Scan, 4> scans;
  std::size_t dropped = 0;
  ASSERT_EQ(ring.take(scans, dropped), 4U);
  EXPECT_EQ(dropped, 6U);
  EXPECT_EQ(scans[0].time_ns, 6);
  EXPECT_EQ(scans[3].time_ns, 9);
  EXPECT_EQ(ring.take(scans, dropped), 0U);
  for (std::int64_t k = 0; k < 16; ++k) EXPECT_TRUE(ring.push(numbered(k)));
  EXPECT_FALSE(ring.push(numbered(16))) << "full";
}

TEST(ScanRing, CarriesWholeScansBetweenThreads) {
  constexpr std::int64_t kCount = 200'000;
  ScanRing ring(256);
  std::thread producer([&] {
    for (std::int64_t k = 0; k < kCount;) {
      if (ring.push(numbered(k))) {
        ++k;
      } else {
        std::this_thread::yield();
      }
    }
  });
  std::int64_t expected = 0;
  std::array<Scan, 64> scans;
  while (expected < kCount) {
    std::size_t dropped = 0;
    const std::size_t count = ring.take(scans, dropped);
    expected += static_cast<std::int64_t>(dropped);
    for (std::size_t k = 0; k < count; ++k, ++expected) {
      ASSERT_EQ(scans[k].time_ns, expected);
      for (const double v : scans[k].volts) ASSERT_EQ(v, static_cast<double>(expected));
    }
    if (count == 0) std::this_thread::yield();
  }
  producer.join();
  EXPECT_EQ(expected, kCount);
}

}  // namespace
}  // namespace hapticd::daq
