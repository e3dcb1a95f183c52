#include "hal/netft/rdt_sequence.h"

#include <utility>

namespace hapticd::netft {

RdtOrderVerdict RdtSequence::judge(std::uint32_t number, bool after_silence) noexcept {
  if (!started_) {
    started_ = true;
    is_first_ = true;
    newest_ = number;
    return {RdtOrder::kInOrder};
  }
  // Differences of unsigned numbers are correct across the wrap.
  const std::uint32_t ahead = number - newest_;
  const std::uint32_t behind = newest_ - number;
  if (ahead == 0) return {RdtOrder::kDuplicate};
  if (ahead <= kWindow) {
    newest_ = number;
    run_ = 0;
    is_first_ = false;
    return {RdtOrder::kInOrder, ahead - 1, false};
  }

  const std::uint32_t step = number - run_newest_;
  if (run_ > 0 && step == 0) return {RdtOrder::kDuplicate};
  if (run_ > 0 && step <= kWindow) {
    ++run_;
  } else {
    run_ = 1;
    run_begin_ = number;
  }
  run_newest_ = number;

  const bool near = behind <= kWindow;
  const std::uint32_t needed = near && !after_silence ? kRestartRun : 2;
  if (run_ < needed) return {near ? RdtOrder::kOld : RdtOrder::kUnconfirmed};
  // Up to half the number range ahead is a long gap; the other half is a restart.
  const std::uint32_t gap = run_begin_ - newest_;
  newest_ = number;
  run_ = 0;
  // The first number of all had no successor: it was the damaged one, and nothing is missing.
  if (std::exchange(is_first_, false)) return {RdtOrder::kInOrder, 0, true};
  if (gap < 0x8000'0000U) return {RdtOrder::kInOrder, ahead - 1, false};
  return {RdtOrder::kRestart};
}

}  // namespace hapticd::netft
