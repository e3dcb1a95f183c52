#include "hal/netft/rdt_sequence.h"

#include <gtest/gtest.h>

#include <vector>

namespace hapticd::netft {
namespace {

struct Outcome {
  int used = 0;
  std::uint32_t lost = 0;
  int duplicates = 0;
  int old = 0;
  int unconfirmed = 0;
  int restarts = 0;
};

/// `silence_at`: index of the first number after a silence.
Outcome follow(const std::vector<std::uint32_t>& numbers, std::size_t silence_at = SIZE_MAX) {
  RdtSequence sequence;
  Outcome outcome;
  bool after_silence = false;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    after_silence = after_silence || i == silence_at;
    const RdtOrderVerdict verdict = sequence.judge(numbers[i], after_silence);
    outcome.lost += verdict.lost;
    switch (verdict.order) {
      case RdtOrder::kRestart:
        ++outcome.restarts;
        [[fallthrough]];
      case RdtOrder::kInOrder:
        ++outcome.used;
        after_silence = false;
        break;
      case RdtOrder::kDuplicate:
        ++outcome.duplicates;
        break;
      case RdtOrder::kOld:
        ++outcome.old;
        break;
      case RdtOrder::kUnconfirmed:
        ++outcome.unconfirmed;
        break;
    }
  }
  return outcome;
}

std::vector<std::uint32_t> run(std::uint32_t from, std::uint32_t count) {
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < count; ++i) numbers.push_back(from + i);
  return numbers;
}

std::vector<std::uint32_t> joined(std::vector<std::uint32_t> a, const std::vector<std::uint32_t>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(RdtSequence, CountsWhatIsMissing) {
  const Outcome outcome = follow({5, 6, 9, 10});
  EXPECT_EQ(outcome.used, 4);
  EXPECT_EQ(outcome.lost, 2U);
}

TEST(RdtSequence, GoesOnAcrossTheWrap) {
  const Outcome outcome = follow({0xffff'fffdU, 0xffff'fffeU, 0xffff'ffffU, 0, 1, 3});
  EXPECT_EQ(outcome.used, 6);
  EXPECT_EQ(outcome.lost, 1U);
  EXPECT_EQ(outcome.restarts, 0);
}

TEST(RdtSequence, DropsDuplicatesAndWhatWasOvertaken) {
  const Outcome outcome = follow({1, 2, 2, 4, 3, 4, 5});
  EXPECT_EQ(outcome.used, 4);
  EXPECT_EQ(outcome.duplicates, 2);
  EXPECT_EQ(outcome.old, 1);
  EXPECT_EQ(outcome.lost, 1U);
  EXPECT_EQ(outcome.restarts, 0);
}

TEST(RdtSequence, ReorderingAcrossTheWrapIsNoRestart) {
  const Outcome outcome = follow({0xffff'fffeU, 1, 0xffff'ffffU, 0, 2});
  EXPECT_EQ(outcome.used, 3);
  EXPECT_EQ(outcome.old, 2);
  EXPECT_EQ(outcome.restarts, 0);
}

TEST(RdtSequence, ARestartFromFarIsTakenWithTheSecondRecord) {
  const Outcome outcome = follow(joined(run(500'000, 10), run(0, 10)));
  EXPECT_EQ(outcome.restarts, 1);
  EXPECT_EQ(outcome.used, 19);
  EXPECT_EQ(outcome.unconfirmed, 1);
  EXPECT_EQ(outcome.lost, 0U);
}

TEST(RdtSequence, ARestartFromNearIsReportedFromReorderingByItsPersistence) {
  const Outcome outcome = follow(joined(run(100, 900), run(0, 60)));
  EXPECT_EQ(outcome.restarts, 1);
  EXPECT_EQ(outcome.old, static_cast<int>(RdtSequence::kRestartRun) - 1);
  EXPECT_EQ(outcome.used, 900 + 60 - static_cast<int>(RdtSequence::kRestartRun) + 1);
}

TEST(RdtSequence, AfterASilenceARestartFromNearIsTakenWithTheSecondRecord) {
  const Outcome outcome = follow(joined(run(100, 50), run(0, 10)), 50);
  EXPECT_EQ(outcome.restarts, 1);
  EXPECT_EQ(outcome.old, 1);
  EXPECT_EQ(outcome.used, 59);
}

TEST(RdtSequence, ABurstOfOldRecordsIsNoRestart) {
  // A block of 20 that took another way.
  const Outcome outcome =
      follow(joined(joined(run(0, 100), run(120, 30)), joined(run(100, 20), run(150, 30))));
  EXPECT_EQ(outcome.restarts, 0);
  EXPECT_EQ(outcome.old, 20);
  EXPECT_EQ(outcome.lost, 20U);
}

TEST(RdtSequence, ALoneWildNumberCostsNothingButItself) {
  const Outcome outcome = follow({10, 11, 0x7000'0000U, 12, 13, 0x9000'0000U, 14, 15});
  EXPECT_EQ(outcome.used, 6);
  EXPECT_EQ(outcome.unconfirmed, 2);
  EXPECT_EQ(outcome.lost, 0U);
  EXPECT_EQ(outcome.restarts, 0);
}

TEST(RdtSequence, AWildFirstNumberDoesNotShutTheRestOut) {
  const Outcome outcome = follow(joined({0x9000'0000U}, run(10, 20)));
  EXPECT_EQ(outcome.used, 20);
}

TEST(RdtSequence, ALongGapIsCountedInFull) {
  const Outcome outcome = follow(joined(run(0, 10), run(70'010, 10)));
  EXPECT_EQ(outcome.restarts, 0);
  EXPECT_EQ(outcome.lost, 70'001U);  // the one that reported of the jump is dropped
  EXPECT_EQ(outcome.used, 19);
}

}  // namespace
}  // namespace hapticd::netft
