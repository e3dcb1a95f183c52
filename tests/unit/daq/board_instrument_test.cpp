// An instrument on inputs of the board that the gauges leave over.

#include "hal/daq/board_instrument.h"

#include <gtest/gtest.h>

#include <limits>

#include "daq_bench.h"
#include "tests/support/part_report.h"
#include "tests/support/value_of.h"

namespace hapticd::daq {
namespace {

/// Two axes: x falls by 1 V in 2 mm, z grows by 1 V in 5 mm.
BoardInstrumentConfig two_axes() {
  return {.channels = {7.0, -1.0, 6.0}, .mm_per_v = {-2.0, 1.0, 5.0}};
}

std::unique_ptr<BoardInstrument> instrument_on(const std::shared_ptr<Board>& board) {
  auto made = BoardInstrument::create(two_axes(), board);
  EXPECT_TRUE(made) << made.error().text();
  return made ? std::move(*made) : nullptr;
}

TEST(BoardInstrument, ReadsWhatItMeasuresAndLeavesTheRest) {
  const auto board = std::make_shared<emulators::ScriptedBoard>();
  const auto instrument = instrument_on(board);
  hal::Vector3 position{1.0, 2.0, 3.0};
  EXPECT_FALSE(instrument->read(position)) << "not engaged";
  EXPECT_FALSE(board->engaged(BoardUse::kInputs)) << "making one opens nothing";
  board->put_spare({3.0, -1.5, 0.0});
  ASSERT_FALSE(instrument->engage());
  board->freeze_time();
  instrument->read(position);  // what came in between
  position = {1.0, 2.0, 3.0};
  EXPECT_FALSE(instrument->read(position)) << "no scan since";
  EXPECT_EQ(position.x, 1.0);
  board->advance_ns(1'000'000);
  ASSERT_TRUE(instrument->read(position));
  EXPECT_NEAR(position.x, -6.0, 1e-3);
  EXPECT_EQ(position.y, 2.0);
  EXPECT_NEAR(position.z, -7.5, 2e-3);
  instrument->disengage();
  EXPECT_FALSE(board->engaged(BoardUse::kInputs));
  EXPECT_FALSE(instrument->read(position));
}

TEST(BoardInstrument, TakesNoScanFromTheSensorBesideIt) {
  test::DaqBench bench;
  const auto instrument = instrument_on(bench.board);
  ASSERT_NO_FATAL_FAILURE(bench.engage());
  ASSERT_FALSE(instrument->engage());
  bench.read();
  hal::Vector3 position;
  instrument->read(position);
  bench.board->put_spare({1.0, 1.0, 0.0});
  for (int tick = 0; tick < 50; ++tick) {
    bench.pass_ms(1.0);
    EXPECT_EQ(bench.read().force_count, 10U);
    ASSERT_TRUE(instrument->read(position));
    EXPECT_NEAR(position.z, 5.0, 2e-3);
    EXPECT_FALSE(instrument->read(position)) << "each scan once";
  }
  // Whichever lets go first, the other goes on.
  bench.sensor->disengage();
  bench.pass_ms(1.0);
  EXPECT_TRUE(instrument->read(position));
  instrument->disengage();
  EXPECT_FALSE(bench.board->engaged(BoardUse::kInputs));
}

TEST(BoardInstrument, AtTheEndOfItsRangeItReadsNothing) {
  const auto board = std::make_shared<emulators::ScriptedBoard>();
  const auto instrument = instrument_on(board);
  ASSERT_FALSE(instrument->engage());
  board->freeze_time();
  hal::Vector3 position;
  for (const double end_v : {10.0, -10.0, 9.85, -9.85}) {
    board->put_spare({0.0, end_v, 0.0});
    instrument->read(position);
    board->advance_ns(1'000'000);
    EXPECT_FALSE(instrument->read(position)) << end_v << " V";
  }
  EXPECT_FALSE(instrument->report().findings.empty());
  EXPECT_EQ(test::figure_of(instrument->report(), "readings_at_the_end"), 4.0);
  board->put_spare({0.0, 9.7, 0.0});
  instrument->read(position);
  board->advance_ns(1'000'000);
  EXPECT_TRUE(instrument->read(position));
  EXPECT_TRUE(instrument->report().findings.empty());
}

TEST(BoardInstrument, EngagingSaysThatNoScanComes) {
  const auto board = std::make_shared<emulators::ScriptedBoard>();
  board->mute_scans();
  BoardInstrumentConfig config = two_axes();
  config.engage_timeout_s = 0.1;
  const auto made = test::value_of(BoardInstrument::create(config, board));
  EXPECT_NE(test::error_of(made->engage()).what.find("no scans"), std::string::npos);
  EXPECT_FALSE(board->engaged(BoardUse::kInputs)) << "let go of again";
}

TEST(BoardInstrument, IsCheckedByName) {
  const auto complaint = [](const auto& change) {
    BoardInstrumentConfig config = two_axes();
    change(config);
    const auto error = check(config);
    return error ? error->text() : "none";
  };
  EXPECT_EQ(complaint([](auto&) {}), "none");
  EXPECT_NE(complaint([](auto& c) { c.channels[2] = -1.0; }).find("along z"), std::string::npos);
  EXPECT_NE(complaint([](auto& c) { c.channels[0] = 6.5; }).find("along x"), std::string::npos);
  EXPECT_NE(complaint([](auto& c) { c.channels[0] = 6.0; }).find("two axes"), std::string::npos);
  EXPECT_NE(complaint([](auto& c) { c.channels[1] = 256.0; }).find("along y"), std::string::npos);
  for (const double scale : {0.0, 1001.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_NE(complaint([&](auto& c) { c.mm_per_v[2] = scale; }).find("scale along z"), std::string::npos);
  }
  EXPECT_EQ(complaint([](auto& c) { c.mm_per_v[1] = 0.0; }), "none") << "of an axis that it does not see";
  EXPECT_NE(complaint([](auto& c) { c.engage_timeout_s = 0.0; }).find("engage_timeout_s"), std::string::npos);
  EXPECT_EQ(channels_of(two_axes()), (std::vector<double>{7.0, 6.0}));
  EXPECT_FALSE(BoardInstrument::create(two_axes(), nullptr));
}

}  // namespace
}  // namespace hapticd::daq
