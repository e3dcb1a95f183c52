#include "tests/emulators/board/board_page.h"

namespace hapticd::emulators {

BoardPage::BoardPage(const std::string& path)
    : SharedPage(path, [](BoardPageLayout& layout) {
        constexpr std::uint32_t kZeroVolts = 32768;  // of 16 bits over ± 10 V
        for (auto& output : layout.outputs) output = kZeroVolts;
      }) {}

void BoardPage::write_world(const std::array<double, BoardPageLayout::kInputs>& inputs_v,
                            const std::array<std::uint32_t, BoardPageLayout::kCounters>& counts) noexcept {
  const std::uint32_t before = layout().sequence.load(std::memory_order_relaxed);
  layout().sequence.store(before + 1, std::memory_order_relaxed);
  // Each with release: a reader that sees one of them also sees the odd number.
  for (std::size_t i = 0; i < inputs_v.size(); ++i) {
    layout().inputs_v[i].store(inputs_v[i], std::memory_order_release);
  }
  for (std::size_t i = 0; i < counts.size(); ++i) {
    layout().counts[i].store(counts[i], std::memory_order_release);
  }
  layout().sequence.store(before + 2, std::memory_order_release);
}

void BoardPage::read_world(std::array<double, BoardPageLayout::kInputs>& inputs_v,
                           std::array<std::uint32_t, BoardPageLayout::kCounters>& counts) const noexcept {
  // A world that died while it wrote leaves what it had written.
  for (int attempt = 0; attempt < 1000; ++attempt) {
    const std::uint32_t before = layout().sequence.load(std::memory_order_acquire);
    for (std::size_t i = 0; i < inputs_v.size(); ++i) {
      inputs_v[i] = layout().inputs_v[i].load(std::memory_order_acquire);
    }
    for (std::size_t i = 0; i < counts.size(); ++i) {
      counts[i] = layout().counts[i].load(std::memory_order_acquire);
    }
    if (before % 2 == 0 && layout().sequence.load(std::memory_order_relaxed) == before) return;
  }
}

}  // namespace hapticd::emulators
