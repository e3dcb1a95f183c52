#include "client/console/daemon/row_ring.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace hapticd::console {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// A row has its number, a saw tooth, and nothing.
void add(RowRing& ring, int count) {
  for (int i = 0; i < count; ++i) {
    const double number = static_cast<double>(ring.end());
    ring.add(std::array{number, std::fmod(number, 7.0), kNone});
  }
}

TEST(RowRing, GivesEveryRowOnceInTheOrderOfTheReader) {
  RowRing ring(3, 100);
  RowReader reader{.columns = {1, 0}};
  add(ring, 3);
  const auto first = read_rows(ring, reader, 9.0, 10);
  EXPECT_EQ(first, (std::vector<double>{9, 3, 1, 0, 0, 0, 0, 1, 1, 2, 2}));
  EXPECT_EQ(read_rows(ring, reader, 9.0, 10)[1], 0.0);
  add(ring, 1);
  const auto next = read_rows(ring, reader, 9.0, 10);
  EXPECT_EQ(next[1], 1.0);
  EXPECT_EQ(next[kFrameHeader + 1], 3.0);
}

TEST(RowRing, MergesWhatASlowReaderMissedIntoMinimaAndMaxima) {
  RowRing ring(3, 5000);
  RowReader reader{.columns = {0, 1, 2}};
  add(ring, 4000);
  const auto frame = read_rows(ring, reader, 1.0, 100);
  const auto rows = static_cast<std::size_t>(frame[1]);
  EXPECT_LE(rows, 100U);
  EXPECT_EQ(frame.size(), kFrameHeader + rows * 3);
  EXPECT_EQ(frame[3], 0.0);
  EXPECT_EQ(frame[4], 4000.0);
  // Nothing is lost between the pairs: each begins where the last one ended.
  double expected = 0.0;
  for (std::size_t pair = 0; pair < rows; pair += 2) {
    const double* low = frame.data() + kFrameHeader + pair * 3;
    const double* high = low + 3;
    EXPECT_EQ(low[0], expected);
    expected = high[0] + 1.0;
    EXPECT_EQ(low[1], 0.0);
    EXPECT_EQ(high[1], 6.0);
    EXPECT_TRUE(std::isnan(low[2]) && std::isnan(high[2]));
  }
  EXPECT_EQ(expected, 4000.0);
  // A pair stands for 2 × samples rows.
  EXPECT_EQ(frame[2], 40.0);
}

TEST(RowRing, KeepsAPeakOfOneTick) {
  RowRing ring(1, 5000);
  RowReader reader{.columns = {0}};
  for (int i = 0; i < 3000; ++i) ring.add(std::array{i == 1234 ? 17.0 : 0.0});
  const auto frame = read_rows(ring, reader, 1.0, 64);
  EXPECT_EQ(*std::max_element(frame.begin() + kFrameHeader, frame.end()), 17.0);
}

TEST(RowRing, CountsWhatIsNoLongerThere) {
  RowRing ring(3, 50);
  RowReader reader{.columns = {0}};
  add(ring, 120);
  const auto frame = read_rows(ring, reader, 1.0, 1000);
  EXPECT_EQ(frame[3], 70.0);
  EXPECT_EQ(frame[1], 50.0);
  EXPECT_EQ(frame[kFrameHeader], 70.0);
}

TEST(RowRing, ServesTheLeastReader) {
  RowRing ring(3, 50);
  RowReader reader{.columns = {0}};
  add(ring, 31);
  const auto frame = read_rows(ring, reader, 1.0, 2);
  EXPECT_EQ(frame[1], 2.0);
  EXPECT_EQ(frame[kFrameHeader], 0.0);
  EXPECT_EQ(frame[kFrameHeader + 1], 30.0);
}

}  // namespace
}  // namespace hapticd::console
