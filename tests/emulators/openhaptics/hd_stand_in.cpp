// A stand-in for the vendor's libHD.so: its exported names, its rules, its own scheduler thread, devices that
// live on a page (page.h) which another program feeds. Built as a module and met at run time only. With
// HD_STAND_IN_LACKS_SET_DOUBLE it lacks a function that is needed, with HD_STAND_IN_BARE all that are not.

#include <time.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

#include "tests/emulators/openhaptics/page.h"
#include "tests/support/system/monotonic_ns.h"

#define STAND_IN_EXPORT extern "C" __attribute__((visibility("default")))

namespace {

using hapticd::emulators::HdEvent;
using hapticd::emulators::HdPageDevice;
using hapticd::emulators::HdPageLayout;
using hapticd::test::monotonic_ns;
using hapticd::test::SharedPage;

using Code = unsigned int;
using DeviceHandle = unsigned int;

struct ErrorInfo {
  Code errorCode;
  int internalErrorCode;
  DeviceHandle hHD;
};

constexpr Code kOk = 0;
constexpr Code kBadParameter = 0x0100;
constexpr Code kBadOperation = 0x0102;
constexpr Code kBadDevice = 0x0104;
constexpr Code kTooMuchForce = 0x0201;
constexpr Code kAlreadyOpen = 0x0301;
constexpr Code kNoCommunication = 0x0302;
constexpr Code kNoSuchConfiguration = 0x0303;
constexpr Code kBegunTwice = 0x0400;
constexpr Code kNotBegun = 0x0401;
constexpr DeviceHandle kNoDevice = 0xFFFFFFFFU;
constexpr DeviceHandle kFirstHandle = 17;  // handles are not indices
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

enum Violation : std::uint32_t {
  kNestedBegin = 1,
  kUnmatchedEnd,
  kForceOutsideFrame,
  kHandle,
  kFrameUnscheduled,
  kUnloadedOpen,
  kUnloadedRunning,
  kDisabledWithForce,
};

/// What the library knows of a device besides the page.
struct Device {
  bool in_frame = false;
  double asked_n[3] = {};
  double transform[16] = {};
  bool clamping = false;
  bool had_force = false;
};

using Callback = Code (*)(void*);
struct Entry {
  unsigned long handle;
  Callback callback;
  void* user;
  unsigned short priority;
};

struct Library {
  HdPageLayout* page = nullptr;
  std::optional<SharedPage<HdPageLayout>> shared;
  std::unique_ptr<HdPageLayout> own;
  Device devices[HdPageLayout::kDevices];
  std::mutex mutex;  // of all below; recursive use is avoided
  std::vector<ErrorInfo> errors;
  std::atomic<DeviceHandle> current{kNoDevice};

  std::mutex schedule_mutex;
  std::vector<Entry> entries;
  unsigned long next_entry = 1;
  std::thread scheduler;
  std::atomic<bool> stop{false};
  std::atomic<std::thread::id> scheduler_id{};

  void open_page();
  void push(Code code, DeviceHandle device) {
    const std::lock_guard lock(mutex);
    errors.push_back({code, static_cast<int>(code % 100), device});
    if (errors.size() > 4096) errors.erase(errors.begin());
  }
  void note(HdEvent event) const {
    const std::uint32_t place = page->event_count.fetch_add(1);
    if (place < HdPageLayout::kEvents) page->events[place] = static_cast<std::uint32_t>(event);
  }
  void violated(Violation rule) const {
    page->violations.fetch_add(1);
    page->last_violation = rule;
  }
  /// Index of a handle that is open; -1 if it is none.
  int index_of(DeviceHandle handle) const {
    if (handle < kFirstHandle || handle - kFirstHandle >= HdPageLayout::kDevices) return -1;
    const int index = static_cast<int>(handle - kFirstHandle);
    return page->devices[index].open ? index : -1;
  }
  /// Index of a handle the caller gives: a bad one breaks the rules.
  int given_index(DeviceHandle handle) {
    const int index = index_of(handle);
    if (index < 0) {
      violated(kHandle);
      push(kBadDevice, handle);
    }
    return index;
  }
  int current_index() {
    const int index = index_of(current);
    if (index < 0) push(kBadDevice, current);
    return index;
  }
  void run();
};

Library* g_library = nullptr;

void sleep_ms(std::uint32_t ms) {
  std::this_thread::sleep_for(std::chrono::milliseconds(ms));
}

void Library::open_page() {
  if (const char* path = std::getenv("HD_STAND_IN_PAGE")) {
    try {
      shared.emplace(path, SharedPage<HdPageLayout>::Join{});
      page = &**shared;
      return;
    } catch (const std::runtime_error& error) {
      std::fprintf(stderr, "stand-in: HD_STAND_IN_PAGE: %s\n", error.what());
    }
  }
  own = std::make_unique<HdPageLayout>();  // the devices of a library without a page do not move
  page = own.get();
  for (HdPageDevice& device : page->devices) {
    std::snprintf(device.name, sizeof device.name, "Default Device");
    device.max_force_n = 8.5;
    device.max_continuous_force_n = 1.4;
    device.calibration_state = 0x5000;
    for (const std::size_t diagonal : {0U, 5U, 10U, 15U}) device.transform[diagonal] = 1.0;
  }
}

__attribute__((constructor)) void load() {
  g_library = new Library;
  g_library->open_page();
  g_library->page->loaded = true;
  g_library->note(HdEvent::kLoaded);
}

__attribute__((destructor)) void unload() {
  Library& lib = *g_library;
  for (const HdPageDevice& device : lib.page->devices) {
    if (device.open) lib.violated(kUnloadedOpen);
  }
  if (lib.page->scheduler_running) lib.violated(kUnloadedRunning);
  lib.stop = true;
  if (lib.scheduler.joinable()) lib.scheduler.join();
  lib.page->scheduler_running = false;
  lib.note(HdEvent::kUnloaded);
  lib.page->loaded = false;
  delete g_library;
}

void Library::run() {
  scheduler_id = std::this_thread::get_id();
  std::int64_t due_ns = monotonic_ns();
  std::vector<Entry> turn;
  turn.reserve(64);
  std::uint64_t ticks = 0;
  while (!stop && !page->kill_scheduler) {
    const double slow_hz = page->slow_hz;
    const double rate_hz =
        slow_hz > 0.0 ? slow_hz : static_cast<double>(std::max<std::uint64_t>(page->scheduler_rate_hz, 1));
    due_ns += static_cast<std::int64_t>(1e9 / rate_hz);
    const std::int64_t late_ns = monotonic_ns() - due_ns;
    if (late_ns > 50'000'000) due_ns += late_ns;  // it does not catch up
    const std::uint32_t late_ticks = page->late_ticks;
    const double behind_us = late_ticks > 0 ? static_cast<double>(page->late_us[ticks++ % late_ticks]) : 0.0;
    const std::int64_t wake_ns = due_ns + static_cast<std::int64_t>(1e3 * behind_us);
    const timespec due{static_cast<time_t>(wake_ns / 1'000'000'000),
                       static_cast<long>(wake_ns % 1'000'000'000)};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr);
    if (const std::uint32_t stall = page->stall_ms.exchange(0)) sleep_ms(stall);
    if (stop || page->kill_scheduler) break;
    {
      const std::lock_guard lock(schedule_mutex);
      turn = entries;
    }
    for (const Entry& entry : turn) {
      if (stop) break;
      if (entry.callback(entry.user) != 0) continue;
      const std::lock_guard lock(schedule_mutex);
      std::erase_if(entries, [&](const Entry& e) { return e.handle == entry.handle; });
    }
    page->ticks.fetch_add(1);
  }
}

/// The parameters that are numbers; how many there are, 0 for a parameter it does not know.
std::size_t parameter(Library& lib, int index, Code name, double* values) {
  HdPageDevice& page = lib.page->devices[index];
  const Device& device = lib.devices[index];
  switch (name) {
    case 0x2050:
      for (std::size_t i = 0; i < 3; ++i) values[i] = page.position_is_nan ? kNan : device.transform[12 + i];
      return 3;
    case 0x2052:
      for (std::size_t i = 0; i < 16; ++i) values[i] = page.transform_is_nan ? kNan : device.transform[i];
      if (page.transform_is_mirrored) {
        for (std::size_t i = 0; i < 3; ++i) values[i] = -values[i];
      }
      return 16;
    case 0x2100:
    case 0x2150:
      if (!page.has_angles) return 0;
      for (std::size_t i = 0; i < 3; ++i) values[i] = page.angles_rad[(name == 0x2150 ? 3 : 0) + i];
      return 3;
    case 0x2554:
      values[0] = 3.0;
      return 1;
    case 0x2555:
      values[0] = page.calibration_styles;
      return 1;
    case 0x2602:
      values[0] = page.max_stiffness_n_per_mm;
      return 1;
    case 0x2603:
      values[0] = page.max_force_n;
      return 1;
    case 0x2604:
      values[0] = page.max_continuous_force_n;
      return 1;
    case 0x2605:
      if (page.lacks_temperature) return 0;
      for (std::size_t i = 0; i < 3; ++i) values[i] = page.motor_temperature[i];
      return 3;
    case 0x2608:
      values[0] = 2000.0;
      return 1;
    case 0x2700:
      for (std::size_t i = 0; i < 3; ++i) values[i] = device.asked_n[i];
      return 3;
    default:
      return 0;
  }
}

/// What hdEnable and hdDisable do to the current device.
void set_capability(Library& lib, Code capability, bool on) {
  const int index = lib.current_index();
  if (index < 0) return;
  HdPageDevice& page = lib.page->devices[index];
  if (capability == 0x4001) {
    lib.devices[index].clamping = on;
  } else if (capability != 0x4000) {
    lib.push(kBadParameter, lib.current);
  } else if (!on || !page.refuses_force) {
    page.force_enabled = on;
    lib.note(on ? HdEvent::kForceOn : HdEvent::kForceOff);
  }
}

/// The pose of a moment.
void read_pose(const HdPageDevice& page, double (&transform)[16]) {
  for (int attempt = 0; attempt < 1000; ++attempt) {
    const std::uint32_t before = page.pose_sequence.load(std::memory_order_acquire);
    double seen[16];
    for (std::size_t i = 0; i < 16; ++i) seen[i] = page.transform[i].load(std::memory_order_acquire);
    if (before % 2 != 0 || page.pose_sequence.load(std::memory_order_relaxed) != before) continue;
    std::copy(std::begin(seen), std::end(seen), std::begin(transform));
    return;
  }
}

void publish_force(HdPageDevice& page, const double (&force_n)[3]) {
  const std::uint32_t sequence = page.force_sequence.load(std::memory_order_relaxed);
  page.force_sequence.store(sequence + 1, std::memory_order_relaxed);
  for (std::size_t i = 0; i < 3; ++i) page.force_n[i].store(force_n[i], std::memory_order_release);
  page.force_time_ns.store(monotonic_ns(), std::memory_order_release);
  page.force_sequence.store(sequence + 2, std::memory_order_release);
}

}  // namespace

// -- devices
STAND_IN_EXPORT DeviceHandle hdInitDevice(const char* name) {
  Library& lib = *g_library;
  sleep_ms(lib.page->init_hangs_ms);
  for (std::size_t index = 0; index < HdPageLayout::kDevices; ++index) {
    HdPageDevice& page = lib.page->devices[index];
    if (name != nullptr && std::strcmp(name, page.name) != 0) continue;
    if (page.init_fails_silently) return kNoDevice;
    if (const Code error = page.init_error) {
      lib.push(error, kNoDevice);
      if (error >> 8 != 2) return kNoDevice;
    }
    if (page.open) {
      lib.push(kAlreadyOpen, kNoDevice);
      return kNoDevice;
    }
    lib.devices[index] = {};
    const double none_n[3] = {};
    publish_force(page, none_n);
    page.open = true;
    lib.current = kFirstHandle + static_cast<DeviceHandle>(index);
    lib.note(HdEvent::kInit);
    return lib.current;
  }
  lib.push(kNoSuchConfiguration, kNoDevice);
  return kNoDevice;
}

STAND_IN_EXPORT void hdDisableDevice(DeviceHandle handle) {
  Library& lib = *g_library;
  const int index = lib.given_index(handle);
  if (index < 0) return;
  HdPageDevice& page = lib.page->devices[index];
  if (page.force_enabled) lib.violated(kDisabledWithForce);
  page.force_enabled = false;
  page.open = false;
  lib.note(HdEvent::kDisable);
}

STAND_IN_EXPORT void hdBeginFrame(DeviceHandle handle) {
  Library& lib = *g_library;
  if (const std::uint32_t hang = lib.page->frame_hangs_ms.exchange(0)) sleep_ms(hang);
  const int index = lib.given_index(handle);
  if (index < 0) return;
  Device& device = lib.devices[index];
  if (device.in_frame) {
    lib.violated(kNestedBegin);
    lib.push(kBegunTwice, handle);
  }
  device.in_frame = true;
  lib.current = handle;
  HdPageDevice& page = lib.page->devices[index];
  if (page.unplugged) return lib.push(kNoCommunication, handle);  // and the pose stays what it was
  read_pose(page, device.transform);
}

STAND_IN_EXPORT void hdEndFrame(DeviceHandle handle) {
  Library& lib = *g_library;
  const int index = lib.given_index(handle);
  if (index < 0) return;
  Device& device = lib.devices[index];
  HdPageDevice& page = lib.page->devices[index];
  if (!device.in_frame) {
    lib.violated(kUnmatchedEnd);
    return lib.push(kNotBegun, handle);
  }
  device.in_frame = false;
  double force_n[3] = {device.asked_n[0], device.asked_n[1], device.asked_n[2]};
  const double magnitude_n = std::hypot(force_n[0], force_n[1], force_n[2]);
  if (!page.force_enabled || page.unplugged) std::fill(std::begin(force_n), std::end(force_n), 0.0);
  if (!(magnitude_n <= page.max_force_n)) {  // with NaN, too
    const double share = device.clamping && std::isfinite(magnitude_n) ? page.max_force_n / magnitude_n : 0.0;
    for (double& component : force_n) component = share > 0.0 ? component * share : 0.0;
    if (!device.clamping) lib.push(kTooMuchForce, handle);
  }
  if (const std::uint32_t left = page.frame_error_frames) {
    page.frame_error_frames = left - 1;
    const std::uint32_t burst = std::max<std::uint32_t>(page.frame_error_burst, 1);
    for (std::uint32_t i = 0; i < burst; ++i) lib.push(page.frame_error, handle);
  }
  if (page.unplugged) lib.push(kNoCommunication, handle);
  publish_force(page, force_n);
  const bool has_force = force_n[0] != 0.0 || force_n[1] != 0.0 || force_n[2] != 0.0;
  if (has_force != device.had_force) lib.note(has_force ? HdEvent::kForceFrame : HdEvent::kZeroFrame);
  device.had_force = has_force;
  if (has_force) page.frames_forced.fetch_add(1);
  page.frames.fetch_add(1);
}

STAND_IN_EXPORT ErrorInfo hdGetError() {
  Library& lib = *g_library;
  const std::lock_guard lock(lib.mutex);
  if (lib.errors.empty()) return {kOk, 0, lib.current};
  const ErrorInfo newest = lib.errors.back();
  lib.errors.pop_back();
  return newest;
}

STAND_IN_EXPORT void hdEnable(Code capability) {
  set_capability(*g_library, capability, true);
}

STAND_IN_EXPORT void hdDisable(Code capability) {
  set_capability(*g_library, capability, false);
}

STAND_IN_EXPORT void hdGetDoublev(Code name, double* values) {
  Library& lib = *g_library;
  const int index = lib.current_index();
  if (index >= 0 && parameter(lib, index, name, values) == 0) lib.push(kBadParameter, lib.current);
}

#ifndef HD_STAND_IN_LACKS_SET_DOUBLE
STAND_IN_EXPORT void hdSetDoublev(Code name, const double* values) {
  Library& lib = *g_library;
  const int index = lib.current_index();
  if (index < 0) return;
  if (name != 0x2700) return lib.push(kBadParameter, lib.current);
  Device& device = lib.devices[index];
  if (!device.in_frame) {
    lib.violated(kForceOutsideFrame);
    return lib.push(kBadOperation, lib.current);
  }
  std::copy(values, values + 3, device.asked_n);
}
#endif

// -- scheduler
STAND_IN_EXPORT void hdSetSchedulerRate(unsigned long hz) {
  Library& lib = *g_library;
  if (const Code error = lib.page->rate_error) return lib.push(error, lib.current);
  lib.page->scheduler_rate_hz = hz;
  lib.note(HdEvent::kRate);
}

STAND_IN_EXPORT unsigned long hdScheduleAsynchronous(Callback callback, void* user, unsigned short priority) {
  Library& lib = *g_library;
  if (const Code error = lib.page->schedule_error) {
    lib.push(error, lib.current);
    return 0;
  }
  const std::lock_guard lock(lib.schedule_mutex);
  const auto place = std::find_if(lib.entries.begin(), lib.entries.end(),
                                  [&](const Entry& entry) { return entry.priority < priority; });
  lib.entries.insert(place, {lib.next_entry, callback, user, priority});
  lib.note(HdEvent::kSchedule);
  return lib.next_entry++;
}

STAND_IN_EXPORT void hdUnschedule(unsigned long handle) {
  Library& lib = *g_library;
  const std::lock_guard lock(lib.schedule_mutex);
  std::erase_if(lib.entries, [&](const Entry& entry) { return entry.handle == handle; });
  lib.note(HdEvent::kUnschedule);
}

STAND_IN_EXPORT void hdStartScheduler() {
  Library& lib = *g_library;
  if (lib.scheduler.joinable()) return;
  lib.stop = false;
  lib.page->scheduler_running = true;
  lib.note(HdEvent::kStart);
  lib.scheduler = std::thread([&lib] { lib.run(); });
}

STAND_IN_EXPORT void hdStopScheduler() {
  Library& lib = *g_library;
  sleep_ms(lib.page->stop_hangs_ms);
  lib.stop = true;
  if (lib.scheduler.joinable()) lib.scheduler.join();
  lib.page->scheduler_running = false;
  lib.note(HdEvent::kStop);
}

#ifndef HD_STAND_IN_BARE
STAND_IN_EXPORT void hdMakeCurrentDevice(DeviceHandle handle) {
  Library& lib = *g_library;
  if (lib.given_index(handle) >= 0) lib.current = handle;
}

STAND_IN_EXPORT unsigned char hdIsEnabled(Code capability) {
  Library& lib = *g_library;
  const int index = lib.current_index();
  if (index < 0) return 0;
  if (capability == 0x4000) return lib.page->devices[index].force_enabled ? 1 : 0;
  if (capability == 0x4001) return lib.devices[index].clamping ? 1 : 0;
  if (capability == 0x4002) return 1;
  if (capability == 0x4003) return 1;
  lib.push(kBadParameter, lib.current);
  return 0;
}

STAND_IN_EXPORT void hdGetIntegerv(Code name, int* values) {
  Library& lib = *g_library;
  const int index = lib.current_index();
  if (index < 0) return;
  double numbers[16] = {};
  const std::size_t count = parameter(lib, index, name, numbers);
  if (count == 0) lib.push(kBadParameter, lib.current);
  for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<int>(numbers[i]);
}

STAND_IN_EXPORT const char* hdGetString(Code name) {
  Library& lib = *g_library;
  const int index = lib.current_index();
  if (index < 0) return nullptr;
  switch (name) {
    case 0x2501:
      return lib.page->devices[index].model_type;
    case 0x2502:
      return "4.2.0";
    case 0x2503:
      return "Stand-in";
    case 0x2504:
      return "0815";
    default:
      lib.push(kBadParameter, lib.current);
      return nullptr;
  }
}

STAND_IN_EXPORT const char* hdGetErrorString(Code code) {
  return code == kNoCommunication ? "communication error" : "some error";
}

STAND_IN_EXPORT Code hdCheckCalibration() {
  Library& lib = *g_library;
  const int index = lib.current_index();
  return index < 0 ? 0x5001 : lib.page->devices[index].calibration_state.load();
}

STAND_IN_EXPORT void hdUpdateCalibration(Code style) {
  Library& lib = *g_library;
  const int index = lib.current_index();
  if (index < 0) return;
  HdPageDevice& page = lib.page->devices[index];
  if ((static_cast<unsigned int>(page.calibration_styles) & style) == 0) {
    return lib.push(kBadOperation, lib.current);
  }
  const std::uint32_t done = page.calibration_updates.fetch_add(1) + 1;
  if (page.calibration_updates_needed != 0 && done >= page.calibration_updates_needed) {
    page.calibration_state = 0x5000;
  }
}
#endif
