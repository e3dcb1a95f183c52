// What all boards have in common: users, unwrapped counters, checked outputs. And which boards there are.

#include "hal/daq/board.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "hal/daq/board_factory.h"
#include "tests/emulators/board/scripted_board.h"
#include "tests/support/value_of.h"

namespace hapticd::daq {
namespace {

using emulators::ScriptedBoard;
using emulators::ScriptedBoardConfig;

TEST(CounterUnwrap, FollowsACounterRoundItsEndsBothWays) {
  for (const int bits : {8, 16, 24, 32, 64}) {
    const std::uint64_t mask = bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1U;
    CounterUnwrap counter;
    std::int64_t truth = -5;
    EXPECT_EQ(counter.add(static_cast<std::uint64_t>(truth) & mask, bits), truth);
    for (int k = 0; k < 40; ++k) {
      const std::int64_t stride = std::int64_t{100} * (bits >= 16 ? 311 : 1);
      truth += k < 25 ? stride : -2 * stride;
      if (bits == 16 && k >= 25) truth += stride;  // keep below half of the range
      EXPECT_EQ(counter.add(static_cast<std::uint64_t>(truth) & mask, bits), truth) << bits << " bits, " << k;
      if (bits == 8 && k == 24) break;
    }
  }
}

TEST(Board, CountersAreUnwrapped) {
  ScriptedBoard board({.counter_bits = 16, .counter_start = {32700, -32700, 0, 0, 0, 0}});
  ASSERT_FALSE(board.engage(BoardUse::kMotion));
  std::array<std::int64_t, 3> first{};
  ASSERT_TRUE(board.read_counters(first));
  EXPECT_EQ(first[0], 32700);
  EXPECT_EQ(first[1], -32700);
  for (int k = 1; k <= 20; ++k) {
    const double turn = 0.05 * k;
    board.move_joints({turn, -turn, 0.0});
    std::array<std::int64_t, 3> counts{};
    ASSERT_TRUE(board.read_counters(counts));
    const auto moved = board.arm().counts({turn, -turn, 0.0});
    EXPECT_EQ(counts[0] - first[0], moved[0]);
    EXPECT_EQ(counts[1] - first[1], moved[1]);
  }
}

TEST(Board, OutputsStayWithinTheRangeAndNothingUnfitGoesOut) {
  ScriptedBoard board;
  ASSERT_FALSE(board.engage(BoardUse::kMotion));
  EXPECT_TRUE(board.write_volts(std::array{99.0, -99.0, 1.0}));
  EXPECT_NEAR(board.output_volts()[0], 10.0, 1e-3);
  EXPECT_NEAR(board.output_volts()[1], -10.0, 1e-3);
  EXPECT_NEAR(board.output_volts()[2], 1.0, 1e-3);
  EXPECT_FALSE(board.write_volts(std::array{1.0, std::numeric_limits<double>::quiet_NaN(), 1.0}));
  EXPECT_EQ(board.output_volts(), (std::array{0.0, 0.0, 0.0})) << "one that is no number cuts all";
  ASSERT_TRUE(board.write_volts(std::array{1.0, 1.0, 1.0}));
  EXPECT_FALSE(board.write_volts(std::array{0.0, 0.0, std::numeric_limits<double>::infinity()}));
  EXPECT_EQ(board.output_volts(), (std::array{0.0, 0.0, 0.0}));
}

TEST(Board, IsOpenAsLongAsSomebodyUsesIt) {
  ScriptedBoard board;
  EXPECT_FALSE(board.engaged(BoardUse::kMotion));
  ASSERT_FALSE(board.engage(BoardUse::kMotion));
  ASSERT_FALSE(board.engage(BoardUse::kMotion));
  EXPECT_FALSE(board.engaged(BoardUse::kInputs)) << "a device opens no inputs";
  ASSERT_TRUE(board.write_volts(std::array{1.0, 2.0, 3.0}));
  board.release(BoardUse::kMotion);
  EXPECT_TRUE(board.engaged(BoardUse::kMotion));
  EXPECT_NE(board.output_volts()[0], 0.0);
  board.release(BoardUse::kMotion);
  EXPECT_FALSE(board.engaged(BoardUse::kMotion));
  EXPECT_EQ(board.output_volts(), (std::array{0.0, 0.0, 0.0})) << "the last user leaves zero volts";
  board.release(BoardUse::kMotion);
  EXPECT_FALSE(board.engaged(BoardUse::kMotion)) << "one release too many harms nothing";
}

TEST(BoardFactory, UnknownDriversAndValuesAreRefused) {
  BoardConfig config{.driver = "nidaqmx"};
  EXPECT_NE(test::error_of(create_board(config)).text().find("comedi"), std::string::npos);

  const auto refused = [](auto change) {
    BoardConfig changed;
    change(changed);
    const auto made = create_board(changed);
    return !made && !made.error().what.empty() && !made.error().limit.empty();
  };
  EXPECT_TRUE(refused([](BoardConfig& c) { c.scan_rate_hz = 0.0; }));
  EXPECT_TRUE(refused([](BoardConfig& c) { c.scan_rate_hz = std::numeric_limits<double>::quiet_NaN(); }));
  EXPECT_TRUE(refused([](BoardConfig& c) { c.comedi.input_channels[3] = 1.5; }));
  EXPECT_TRUE(refused([](BoardConfig& c) { c.comedi.output_channels[0] = -1.0; }));
  EXPECT_TRUE(refused([](BoardConfig& c) { c.comedi.counters = {{4.0, 0.5}}; }));
  EXPECT_TRUE(refused([](BoardConfig& c) { c.comedi.counters.resize(7); }));
  EXPECT_TRUE(refused([](BoardConfig& c) { c.comedi.input_low_v = 10.0; }));
}

TEST(BoardFactory, WithoutTheNodeOfTheBoardThereIsAClearError) {
  BoardConfig config;
  config.comedi.device = "/dev/no_such_board";
  auto board = create_board(config);
  if (!has_comedi()) {
    ASSERT_FALSE(board);
    EXPECT_NE(board.error().text().find("libcomedi"), std::string::npos);
    return;
  }
  ASSERT_TRUE(board) << board.error().text() << ": nothing is opened before it is needed";
  for (const BoardUse use : {BoardUse::kInputs, BoardUse::kMotion}) {
    const auto error = test::error_of((*board)->engage(use));
    EXPECT_EQ(error.where, "/dev/no_such_board");
    EXPECT_NE(error.remedy.find("/dev/comedi"), std::string::npos) << error.text();
  }
  std::array<std::int64_t, 3> counts{};
  EXPECT_FALSE((*board)->read_counters(counts));
  EXPECT_FALSE((*board)->write_volts(std::array{0.0, 0.0, 0.0}));
  std::array<Scan, 4> scans;
  EXPECT_FALSE((*board)->read_scans(scans).running);
}

TEST(BoardFactory, ANodeWithoutABoardIsAnError) {
  if (!has_comedi()) GTEST_SKIP() << "built without libcomedi";
  BoardConfig config;
  config.comedi.device = "/dev/null";
  auto board = test::value_of(create_board(config));
  const auto error = test::error_of(board->engage(BoardUse::kInputs));
  EXPECT_NE(error.what.find("cannot open"), std::string::npos) << error.text();
}

}  // namespace
}  // namespace hapticd::daq
