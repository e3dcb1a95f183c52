#include "server/recording/flight/flight_ring.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "server/recording/flight/ring_folder.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

using recording::put;
using test::demand;
using test::value_of;

const std::vector<recording::Column> kColumns{
    {"tick", "1", true}, {"time_ns", "ns", true}, {"force_n", "N", false}};

std::string rows_from(std::int64_t first, int count) {
  std::string rows;
  for (std::int64_t tick = first; tick < first + count; ++tick) {
    put(tick, rows);
    put(1000 * tick, rows);
    put(0.25 * static_cast<double>(tick), rows);
  }
  return rows;
}

TEST(FlightRing, KeepsTheNewestRows) {
  const test::TemporaryFolder folder;
  const auto ring = value_of(FlightRing::create(folder.path("r.ring"), kColumns, 100, 1000.0));
  for (int first = 0; first < 250; first += 7) demand(ring->write(rows_from(first, 7)));
  EXPECT_EQ(ring->written(), 252U);
  std::string rows;
  ASSERT_TRUE(ring->read(152, 100, rows));
  EXPECT_EQ(rows, rows_from(152, 100));
  EXPECT_FALSE(ring->read(151, 1, rows)) << "overwritten";
  EXPECT_FALSE(ring->read(252, 1, rows)) << "not written yet";
}

TEST(FlightRing, MoreThanItHoldsAtOnceLeavesTheNewest) {
  const test::TemporaryFolder folder;
  const auto ring = value_of(FlightRing::create(folder.path("r.ring"), kColumns, 10, 1000.0));
  demand(ring->write(rows_from(0, 35)));
  std::string rows;
  ASSERT_TRUE(ring->read(25, 10, rows));
  EXPECT_EQ(rows, rows_from(25, 10));
}

TEST(FlightRing, OneThatWasLeftIsFoundWithAllThatIsKnown) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("r.ring");
  {
    const auto ring = value_of(FlightRing::create(path, kColumns, 50, 1000.0));
    demand(ring->write(rows_from(0, 60)));
    demand(ring->set_notes({{"recording", {{"rig", "sim"}}}, {"scene", {{"name", "tap_1d"}}}}));
    demand(ring->set_anchor({5, 7, 1}));
    const auto taken = FlightRing::open_left(path);
    ASSERT_FALSE(taken) << "its daemon still runs";
  }
  const auto left = value_of(FlightRing::open_left(path));
  EXPECT_EQ(left->written(), 60U);
  EXPECT_EQ(left->capacity_rows(), 50U);
  EXPECT_EQ(left->columns()[2].name, "force_n");
  EXPECT_EQ(left->columns()[2].unit, "N");
  EXPECT_EQ(left->notes().at("scene").at("name"), "tap_1d");
  EXPECT_EQ(left->anchor().unix_ns, 7);
  std::string rows;
  ASSERT_TRUE(left->read(10, 50, rows));
  EXPECT_EQ(rows, rows_from(10, 50));
}

TEST(FlightRing, NotesThatAreHalfWrittenAreNone) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("r.ring");
  {
    demand(value_of(FlightRing::create(path, kColumns, 50, 1000.0))
               ->set_notes({{"scene", {{"name", "tap_1d"}}}}));
  }
  {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(4096 + 64 * 1024 + 20);
    file.put('x');
  }
  EXPECT_TRUE(value_of(FlightRing::open_left(path))->notes().empty());
}

// The number of bytes that are read at once follows from these numbers.
TEST(FlightRing, WhoseSizeIsNotWhatItsBeginningSaysIsDamaged) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("r.ring");
  demand(value_of(FlightRing::create(path, kColumns, 50, 1000.0))->write(rows_from(0, 10)));
  {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(24 + 2);  // of the number of rows
    file.put('\x01');
  }
  EXPECT_EQ(FlightRing::open_left(path).error().code, hal::ErrorCode::kDamaged);
}

TEST(RingFolder, KeepsTheRingOfADaemonThatRunsAndRemovesADamagedOne) {
  const test::TemporaryFolder folder;
  std::vector<std::string> left;
  const auto first = value_of(take_ring(folder.path(), kColumns, 50, 1000.0, left));
  demand(first->write(rows_from(0, 10)));
  const std::string path = folder.path("flight-0.ring");
  EXPECT_EQ(test::error_of(FlightRing::open_left(path)).code, hal::ErrorCode::kInUse);
  const std::string damaged = folder.write("flight-1.ring", "no ring");
  EXPECT_EQ(FlightRing::open_left(damaged).error().code, hal::ErrorCode::kDamaged);

  const auto second = value_of(take_ring(folder.path(), kColumns, 50, 1000.0, left));
  EXPECT_TRUE(left.empty());
  ASSERT_TRUE(std::filesystem::exists(path));
  EXPECT_FALSE(FlightRing::open_left(path)) << "it is still the first daemon's";
  EXPECT_EQ(first->written(), 10U);
  EXPECT_FALSE(FlightRing::open_left(damaged)) << "its name went to the second daemon";
  EXPECT_EQ(second->written(), 0U);
}

// The ring of the first run, which shows why it ended, was written over by that of the second.
TEST(RingFolder, KeepsTheRingsOfTwoRunsThatEndedBeforeEitherWasKept) {
  const test::TemporaryFolder folder;
  std::vector<std::string> left;
  for (const int first : {0, 100}) {
    left.clear();
    demand(value_of(take_ring(folder.path(), kColumns, 50, 1000.0, left))->write(rows_from(first, 10)));
  }
  left.clear();
  const auto third = value_of(take_ring(folder.path(), kColumns, 50, 1000.0, left));
  ASSERT_EQ(left.size(), 2U);
  std::string rows;
  ASSERT_TRUE(value_of(FlightRing::open_left(left[0]))->read(0, 10, rows));
  EXPECT_EQ(rows, rows_from(0, 10));
  ASSERT_TRUE(value_of(FlightRing::open_left(left[1]))->read(0, 10, rows));
  EXPECT_EQ(rows, rows_from(100, 10));
  EXPECT_EQ(third->written(), 0U);
}

TEST(RingFolder, LeavesWhatItCannotOpen) {
  // As the ring of another user is to one who is not root; a link is what root cannot open either.
  const test::TemporaryFolder folder;
  const std::string theirs = folder.write("theirs", "another daemon's");
  std::filesystem::create_symlink(theirs, folder.path("flight-0.ring"));
  EXPECT_EQ(FlightRing::open_left(folder.path("flight-0.ring")).error().code, hal::ErrorCode::kUnreadable);
  std::vector<std::string> left;
  const auto ring = value_of(take_ring(folder.path(), kColumns, 50, 1000.0, left));
  EXPECT_TRUE(std::filesystem::is_symlink(folder.path("flight-0.ring")));
  EXPECT_TRUE(std::filesystem::exists(folder.path("flight-1.ring"))) << "it takes the next name";
  EXPECT_EQ(std::filesystem::file_size(theirs), 16U);
  EXPECT_TRUE(left.empty());
}

TEST(RingFolder, RefusesOneDaemonTooMany) {
  const test::TemporaryFolder folder;
  std::vector<std::string> left;
  std::vector<std::unique_ptr<FlightRing>> rings;
  for (int i = 0; i < kMaxRings; ++i) {
    rings.push_back(value_of(take_ring(folder.path(), kColumns, 5, 1000.0, left)));
  }
  const hal::Error refused = test::error_of(take_ring(folder.path(), kColumns, 5, 1000.0, left));
  EXPECT_EQ(refused.code, hal::ErrorCode::kInUse);
}

TEST(FlightRing, ForeignFilesAreNone) {
  const test::TemporaryFolder folder;
  EXPECT_FALSE(FlightRing::open_left(folder.write("a", "")));
  EXPECT_FALSE(FlightRing::open_left(folder.write("b", std::string(100'000, 'x'))));
  EXPECT_FALSE(FlightRing::open_left(folder.path("none")));
  const std::string nowhere = folder.write("file", "") + "/r.ring";
  const hal::Error refused = test::error_of(FlightRing::create(nowhere, kColumns, 10, 1000.0));
  EXPECT_EQ(refused.where, nowhere);
}

}  // namespace
}  // namespace hapticd::server
