#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>

#include "tests/support/system/shared_page.h"

namespace hapticd::emulators {

/// What a stand-in for comedi and the world outside it have in common: one file, mapped by both, named to the
/// library in the environment variable COMEDI_STAND_IN_PAGE. It is the board's device node, too.
struct BoardPageLayout {
  static constexpr std::uint32_t kMagic = 0x42445031;
  static constexpr std::size_t kInputs = 16, kCounters = 8, kOutputs = 4;

  std::uint32_t magic;

  // -- written by the world
  std::atomic<std::uint32_t> sequence;           ///< odd while it writes
  std::atomic<double> inputs_v[kInputs];         ///< analog inputs
  std::atomic<std::uint32_t> counts[kCounters];  ///< encoder counters

  // -- written by the library
  std::atomic<std::uint32_t> outputs[kOutputs];  ///< codes of the analog outputs, as they were written last
  std::atomic<std::uint64_t> counter_reads;      ///< how often the counters were read
};
static_assert(std::atomic<double>::is_always_lock_free && std::atomic<std::uint64_t>::is_always_lock_free);

/// One end of such a page. One thread writes the world's side.
class BoardPage : public test::SharedPage<BoardPageLayout> {
 public:
  /// Makes it, outputs at zero volts.
  explicit BoardPage(const std::string& path);
  using SharedPage::SharedPage;

  /// The world's: all of it at once, so that no reader gets half of two moments.
  void write_world(const std::array<double, BoardPageLayout::kInputs>& inputs_v,
                   const std::array<std::uint32_t, BoardPageLayout::kCounters>& counts) noexcept;
  /// The library's.
  void read_world(std::array<double, BoardPageLayout::kInputs>& inputs_v,
                  std::array<std::uint32_t, BoardPageLayout::kCounters>& counts) const noexcept;
};

}  // namespace hapticd::emulators
