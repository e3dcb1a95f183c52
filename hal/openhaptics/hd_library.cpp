#include "hal/openhaptics/hd_library.h"

#include <dlfcn.h>

#include <cstdio>
#include <map>
#include <optional>
#include <utility>

#include "hal/shown_text.h"

namespace hapticd::openhaptics {

namespace {

/// The loaded libraries, by the loader's handle: the same file always has the same handle.
struct Registry {
  /// One library after the other is loaded or unloaded, which runs code of the vendor's that may hang.
  SerialMutex loading;
  std::map<void*, std::weak_ptr<HdLibrary>> loaded GUARDED_BY(loading);
  Mutex abandoning;
  std::vector<std::shared_ptr<HdLibrary>> abandoned GUARDED_BY(abandoning);
};
Registry& registry() {
  static auto* all = new Registry;  // outlives any thread that hangs in a library
  return *all;
}

}  // namespace

hal::Result<std::shared_ptr<HdLibrary>> HdLibrary::load(const std::vector<std::string>& names) {
  Registry& all = registry();
  std::optional<hal::Error> defect;
  std::string reasons;
  std::vector<std::shared_ptr<HdLibrary>> unfit;  // unloaded by their destructors, after the lock
  const MutexLock lock(all.loading);
  for (const std::string& name : names) {
    void* handle = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle == nullptr) {
      const char* reason = dlerror();
      reasons += (reasons.empty() ? "" : "; ") + std::string(reason != nullptr ? reason : name);
      continue;
    }
    if (auto library = all.loaded[handle].lock()) {
      dlclose(handle);  // counted twice otherwise
      if (library->abandoned()) {
        return hal::Error{"the vendor's library hangs and cannot be used again", "OpenHaptics", name, "",
                          "restart the service"};
      }
      return library;
    }
    std::shared_ptr<HdLibrary> library(new HdLibrary(handle, name));
    if (auto error = library->bind()) {
      if (!defect) defect = std::move(error);
      unfit.push_back(std::move(library));
      continue;
    }
    all.loaded[handle] = library;
    return library;
  }
  if (defect) return *defect;
  return hal::Error{"the vendor's library cannot be loaded: " + reasons, "OpenHaptics", hal::joined(names),
                    "a shared library that exports the HD interface",
                    "install OpenHaptics and its device driver (libPhantomIOLib42.so), run ldconfig, or set "
                    "'library' to the file"};
}

HdLibrary::~HdLibrary() {
  if (abandoned()) return;
  const MutexLock lock(registry().loading);
  dlclose(handle_);
}

std::optional<hal::Error> HdLibrary::bind() {
  std::vector<std::string> missing;
  const auto find = [&](const char* symbol, auto& function, bool needed) {
    void* address = dlsym(handle_, symbol);
    if (address == nullptr) (needed ? missing : lacking_).emplace_back(symbol);
    function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(address);
  };
  find("hdInitDevice", api_.init_device, true);
  find("hdDisableDevice", api_.disable_device, true);
  find("hdBeginFrame", api_.begin_frame, true);
  find("hdEndFrame", api_.end_frame, true);
  find("hdGetError", api_.get_error, true);
  find("hdEnable", api_.enable, true);
  find("hdDisable", api_.disable, true);
  find("hdGetDoublev", api_.get_doublev, true);
  find("hdSetDoublev", api_.set_doublev, true);
  find("hdScheduleAsynchronous", api_.schedule_asynchronous, true);
  find("hdUnschedule", api_.unschedule, true);
  find("hdStartScheduler", api_.start_scheduler, true);
  find("hdStopScheduler", api_.stop_scheduler, true);
  find("hdSetSchedulerRate", api_.set_scheduler_rate, true);
  find("hdMakeCurrentDevice", api_.make_current_device, false);
  find("hdIsEnabled", api_.is_enabled, false);
  find("hdGetIntegerv", api_.get_integerv, false);
  find("hdGetString", api_.get_string, false);
  find("hdGetErrorString", api_.get_error_string, false);
  find("hdCheckCalibration", api_.check_calibration, false);
  find("hdUpdateCalibration", api_.update_calibration, false);
  if (missing.empty()) return std::nullopt;
  return hal::Error{"the library lacks " + hal::joined(missing), "OpenHaptics library '" + name_ + "'",
                    missing.front(), "a library with the whole HD interface",
                    "install OpenHaptics 3.0 or later, or set 'library' to another file"};
}

void HdLibrary::start_scheduler() {
  const MutexLock lock(scheduler_);
  if (scheduler_users_++ == 0) api_.start_scheduler();
}

void HdLibrary::stop_scheduler() {
  const MutexLock lock(scheduler_);
  if (scheduler_users_ > 0 && --scheduler_users_ == 0) api_.stop_scheduler();
}

std::shared_ptr<DeviceErrorSlot> HdLibrary::acquire_slot(hd::Handle device) noexcept {
  for (DeviceErrorSlot& slot : *slots_) {
    hd::Handle unassigned = hd::kInvalidHandle;
    if (slot.device.compare_exchange_strong(unassigned, device)) {
      slot.take();
      for (auto& count : slot.counts) count.store(0, std::memory_order_relaxed);
      for (auto& time : slot.last_seen_ns) time.store(0, std::memory_order_relaxed);
      return {slots_, &slot};
    }
  }
  return nullptr;
}

DeviceErrorSlot* HdLibrary::slot_of(hd::Handle device) noexcept {
  if (device == hd::kInvalidHandle) return nullptr;
  for (DeviceErrorSlot& slot : *slots_) {
    if (slot.device.load(std::memory_order_relaxed) == device) return &slot;
  }
  return nullptr;
}

void HdLibrary::deliver(const hd::ErrorInfo& error, DeviceErrorSlot& mine) noexcept {
  DeviceErrorSlot* owner = slot_of(error.device);
  (owner != nullptr ? *owner : mine).put(error);
}

int HdLibrary::drain(DeviceErrorSlot& mine) noexcept {
  for (int taken = 0; taken < kMaxStackDepth; ++taken) {
    const hd::ErrorInfo error = api_.get_error();
    if (error.code == hd::kSuccess) return taken;
    deliver(error, mine);
  }
  return kMaxStackDepth;
}

hd::ErrorInfo HdLibrary::last_error(hd::Handle mine) noexcept {
  hd::ErrorInfo newest{hd::kSuccess, 0, mine};
  for (int taken = 0; taken < kMaxStackDepth; ++taken) {
    const hd::ErrorInfo error = api_.get_error();
    if (error.code == hd::kSuccess) break;
    DeviceErrorSlot* owner = error.device == mine ? nullptr : slot_of(error.device);
    if (owner != nullptr) {
      owner->put(error);
    } else if (newest.code == hd::kSuccess) {
      newest = error;
    }
  }
  return newest;
}

std::string HdLibrary::describe(const hd::ErrorInfo& error) const {
  char numbers[64];
  std::snprintf(numbers, sizeof numbers, " (0x%x, internal %d)", error.code, error.internal_code);
  std::string text = std::string(hd_error(error.code).name) + numbers;
  if (api_.get_error_string != nullptr) {
    if (const char* words = api_.get_error_string(error.code); words != nullptr && *words != '\0') {
      text += ": " + std::string(words);
    }
  }
  return text;
}

void HdLibrary::abandon() {
  if (abandoned_.exchange(true)) return;
  Registry& all = registry();
  const MutexLock lock(all.abandoning);
  all.abandoned.push_back(shared_from_this());
}

}  // namespace hapticd::openhaptics
