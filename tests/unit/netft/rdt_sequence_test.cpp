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
  bool operator==(const Outcome&) const = default;
  friend void PrintTo(const Outcome& o, std::ostream* out) {
    *out << "used " << o.used << ", lost " << o.lost << ", duplicates " << o.duplicates << ", old " << o.old
         << ", unconfirmed " << o.unconfirmed << ", restarts " << o.restarts;
  }
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

TEST(RdtSequence, NumbersAreWhatTheirOrderMakesThem) {
  constexpr int kRun = RdtSequence::kRestartRun;
  struct Case {
    const char* name;
    std::vector<std::uint32_t> numbers;
    Outcome outcome;
    std::size_t silence_at = SIZE_MAX;
  };
  for (const Case& c : {
           Case{"in order", run(7, 100), {.used = 100}},
           Case{"some are missing", {5, 6, 9, 10}, {.used = 4, .lost = 2}},
           Case{"they wrap", {0xffff'fffdU, 0xffff'fffeU, 0xffff'ffffU, 0, 1, 3}, {.used = 6, .lost = 1}},
           Case{"duplicates and what was overtaken",
                {1, 2, 2, 4, 3, 4, 5},
                {.used = 4, .lost = 1, .duplicates = 2, .old = 1}},
           Case{"reordered across the wrap",
                {0xffff'fffeU, 1, 0xffff'ffffU, 0, 2},
                {.used = 3, .lost = 2, .old = 2}},
           Case{"a restart from far is taken with the second record",
                joined(run(500'000, 10), run(0, 10)),
                {.used = 19, .unconfirmed = 1, .restarts = 1}},
           Case{"a restart after two days is not a long gap",
                joined(run(0x6000'0000U, 10), run(0, 10)),
                {.used = 19, .unconfirmed = 1, .restarts = 1}},
           Case{"a restart from near is distinguished from reordering by its persistence",
                joined(run(100, 900), run(0, 60)),
                {.used = 900 + 60 - kRun + 1, .old = kRun - 1, .restarts = 1}},
           Case{"after a silence it is taken with the second record",
                joined(run(100, 50), run(0, 10)),
                {.used = 59, .old = 1, .restarts = 1},
                50},
           Case{"a block of 20 that took another way is no restart",
                joined(joined(run(0, 100), run(120, 30)), joined(run(100, 20), run(150, 30))),
                {.used = 160, .lost = 20, .old = 20}},
           Case{"a lone wild number costs nothing but itself",
                {10, 11, 0x7000'0000U, 12, 13, 0x9000'0000U, 14, 15},
                {.used = 6, .unconfirmed = 2}},
           // The one that announces the jump is dropped.
           Case{"a long gap is counted in full",
                joined(run(0, 10), run(70'010, 10)),
                {.used = 19, .lost = 70'001, .unconfirmed = 1}},
       }) {
    EXPECT_EQ(follow(c.numbers, c.silence_at), c.outcome) << c.name;
  }
}

TEST(RdtSequence, AWildFirstNumberDoesNotShutTheRestOut) {
  // On either side of the half of the number range that counts as a gap.
  for (const std::uint32_t wild : {0x9000'0000U, 0x7000'0000U}) {
    EXPECT_EQ(follow(joined({wild}, run(10, 20))), (Outcome{.used = 20, .unconfirmed = 1})) << wild;
  }
}

}  // namespace
}  // namespace hapticd::netft
