#include "hal/phantom/exit_cut.h"

#include <array>
#include <cstdlib>
#include <mutex>

namespace hapticd::phantom {

namespace {

struct Registry {
  std::mutex mutex;
  std::array<CutAtExit*, 8> entries{};
};

// Never destroyed: it must outlive everything that std::exit() destroys.
Registry& registry() {
  static Registry* const the_one = new Registry;
  return *the_one;
}

void cut_all() noexcept {
  Registry& all = registry();
  const std::lock_guard lock(all.mutex);
  for (CutAtExit* entry : all.entries) {
    if (entry != nullptr) entry->cut_at_exit();
  }
}

}  // namespace

bool register_cut(CutAtExit& what) noexcept {
  static const bool armed = std::atexit(cut_all) == 0 && std::at_quick_exit(cut_all) == 0;
  Registry& all = registry();
  const std::lock_guard lock(all.mutex);
  for (CutAtExit*& entry : all.entries) {
    if (entry != nullptr) continue;
    entry = &what;
    return armed;
  }
  return false;
}

void forget_cut(CutAtExit& what) noexcept {
  Registry& all = registry();
  const std::lock_guard lock(all.mutex);
  for (CutAtExit*& entry : all.entries) {
    if (entry == &what) entry = nullptr;
  }
}

}  // namespace hapticd::phantom
