#include "hal/phantom/exit_cut.h"

#include <array>
#include <cstdlib>

#include "hal/lock/mutex.h"

namespace hapticd::phantom {

namespace {

struct Registry {
  Mutex mutex;
  std::array<std::weak_ptr<CutAtExit>, 8> entries GUARDED_BY(mutex);
};

// Never destroyed: it must outlive everything that std::exit() destroys.
Registry& registry() {
  static Registry* const the_one = new Registry;
  return *the_one;
}

void cut_all() noexcept {
  Registry& all = registry();
  std::array<std::shared_ptr<CutAtExit>, 8> there;
  {
    const MutexLock lock(all.mutex);
    for (std::size_t i = 0; i < there.size(); ++i) there[i] = all.entries[i].lock();
  }
  for (const auto& entry : there) {
    if (entry != nullptr) entry->cut_at_exit();
  }
}

}  // namespace

bool register_cut(const std::shared_ptr<CutAtExit>& what) noexcept {
  static const bool armed = std::atexit(cut_all) == 0 && std::at_quick_exit(cut_all) == 0;
  Registry& all = registry();
  const MutexLock lock(all.mutex);
  for (std::weak_ptr<CutAtExit>& entry : all.entries) {
    if (!entry.expired()) continue;
    entry = what;
    return armed;
  }
  return false;
}

void forget_cut(const std::shared_ptr<CutAtExit>& what) noexcept {
  Registry& all = registry();
  const MutexLock lock(all.mutex);
  for (std::weak_ptr<CutAtExit>& entry : all.entries) {
    if (entry.lock() == what) entry.reset();
  }
}

}  // namespace hapticd::phantom
