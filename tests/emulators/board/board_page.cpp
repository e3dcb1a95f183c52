#include "tests/emulators/board/board_page.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <new>
#include <stdexcept>

namespace hapticd::emulators {

namespace {
constexpr std::uint32_t kZeroVolts = 32768;  // of 16 bits over ± 10 V
}

BoardPage::BoardPage(const std::string& path) : path_(path) {
  const int file = open(path.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (file < 0 || ftruncate(file, sizeof(BoardPageLayout)) != 0) {
    throw std::runtime_error("cannot make the page " + path + ": " + std::strerror(errno));
  }
  map(file);
  new (layout_) BoardPageLayout();  // all zero
  for (auto& output : layout_->outputs) output = kZeroVolts;
  layout_->magic = BoardPageLayout::kMagic;
}

BoardPage::BoardPage(const std::string& path, Join) : path_(path) {
  const int file = open(path.c_str(), O_RDWR | O_CLOEXEC);
  struct stat state {};
  if (file < 0 || fstat(file, &state) != 0 || state.st_size != sizeof(BoardPageLayout)) {
    throw std::runtime_error(path + " is not a page");
  }
  map(file);
  if (layout_->magic != BoardPageLayout::kMagic) throw std::runtime_error(path + " is not a page");
}

void BoardPage::map(int file) {
  void* memory = mmap(nullptr, sizeof(BoardPageLayout), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  if (memory == MAP_FAILED) throw std::runtime_error("cannot map the page " + path_);
  layout_ = static_cast<BoardPageLayout*>(memory);
}

BoardPage::~BoardPage() {
  munmap(layout_, sizeof(BoardPageLayout));
}

void BoardPage::write_world(const std::array<double, BoardPageLayout::kInputs>& inputs_v,
                            const std::array<std::uint32_t, BoardPageLayout::kCounters>& counts) noexcept {
  const std::uint32_t before = layout_->sequence.load(std::memory_order_relaxed);
  layout_->sequence.store(before + 1, std::memory_order_relaxed);
  // Each with release: a reader that sees one of them also sees the odd number.
  for (std::size_t i = 0; i < inputs_v.size(); ++i) {
    layout_->inputs_v[i].store(inputs_v[i], std::memory_order_release);
  }
  for (std::size_t i = 0; i < counts.size(); ++i) {
    layout_->counts[i].store(counts[i], std::memory_order_release);
  }
  layout_->sequence.store(before + 2, std::memory_order_release);
}

void BoardPage::read_world(std::array<double, BoardPageLayout::kInputs>& inputs_v,
                           std::array<std::uint32_t, BoardPageLayout::kCounters>& counts) const noexcept {
  // A world that died while it wrote leaves what it had written.
  for (int attempt = 0; attempt < 1000; ++attempt) {
    const std::uint32_t before = layout_->sequence.load(std::memory_order_acquire);
    for (std::size_t i = 0; i < inputs_v.size(); ++i) {
      inputs_v[i] = layout_->inputs_v[i].load(std::memory_order_acquire);
    }
    for (std::size_t i = 0; i < counts.size(); ++i) {
      counts[i] = layout_->counts[i].load(std::memory_order_acquire);
    }
    if (before % 2 == 0 && layout_->sequence.load(std::memory_order_relaxed) == before) return;
  }
}

}  // namespace hapticd::emulators
