#pragma once

#include <cstdint>

namespace hapticd::netft {

/// Order of a record, from its sequence number.
enum class RdtOrder : std::uint8_t {
  kInOrder,      ///< newer than all before: use it; `lost` records are missing before it
  kDuplicate,    ///< received before: drop it
  kOld,          ///< overtaken by a newer one: drop it
  kUnconfirmed,  ///< out of all order; the next one will say whether the numbers jumped: drop it
  kRestart,      ///< the numbers began again: use it
};

struct RdtOrderVerdict {
  RdtOrder order = RdtOrder::kInOrder;
  std::uint32_t lost = 0;
  /// The numbers begin with this record: the first one of all was damaged.
  bool begins = false;
};

/// Follows the sequence numbers of a stream through gaps, duplicates, reordering, restarts and the wrap from
/// 2^32 - 1 to 0.
///
/// One number never moves the expectation far: a single damaged record must not make all good ones look
/// old. A number further away than kWindow must be confirmed by its successor. A step back within kWindow
/// is reordering, until kRestartRun records in a row have gone back and then forward, which no network
/// causes; after a silence, when no record can still be in transit, two in a row are enough. A first number
/// without a successor was damaged itself: nothing counts as lost.
class RdtSequence {
 public:
  RdtOrderVerdict judge(std::uint32_t number, bool after_silence) noexcept;
  void reset() noexcept { *this = {}; }

  static constexpr std::uint32_t kWindow = 2000;  ///< 0.3 s at 7 kHz
  static constexpr std::uint32_t kRestartRun = 32;

 private:
  bool started_ = false;
  bool is_first_ = false;  ///< newest_ is that of the first record, which no successor has confirmed
  std::uint32_t newest_ = 0;
  std::uint32_t run_ = 0;  ///< consecutive records that follow each other, but not newest_
  std::uint32_t run_begin_ = 0;
  std::uint32_t run_newest_ = 0;
};

}  // namespace hapticd::netft
