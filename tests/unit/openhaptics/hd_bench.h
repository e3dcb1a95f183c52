#pragma once

#include <atomic>
#include <cstdlib>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "hal/openhaptics/openhaptics_device.h"
#include "tests/emulators/openhaptics/page.h"
#include "tests/support/eventually.h"
#include "tests/support/part_report.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {

using emulators::HdEvent;
using emulators::HdPage;
using openhaptics::OpenHapticsConfig;
using openhaptics::OpenHapticsDevice;
namespace status = hal::sample_status;

inline std::string stand_in(const std::string& variant = "") {
  std::string file = HD_STAND_IN_FOLDER;
  file.append("/libHD_stand_in").append(variant).append(".so");
  return file;
}

/// Reads, keeps what it read, asks for the force it was asked to.
class Body final : public hal::ServoBody {
 public:
  explicit Body(hal::HapticDevice& device) : device_(device) {}
  void on_servo() noexcept override {
    hal::RigSample sample;
    device_.read(sample);
    const std::lock_guard lock(mutex_);
    if (writes_) device_.write({force_n_});
    sample_ = sample;
    seen_ |= sample.status;
    ++calls_;
  }
  void ask(const hal::Vector3& force_n) {
    const std::lock_guard lock(mutex_);
    force_n_ = force_n;
    writes_ = true;
  }
  void write_nothing() {
    const std::lock_guard lock(mutex_);
    writes_ = false;
  }
  hal::RigSample sample() const {
    const std::lock_guard lock(mutex_);
    return sample_;
  }
  /// Status bits since the last call.
  std::uint32_t seen() {
    const std::lock_guard lock(mutex_);
    return std::exchange(seen_, 0);
  }
  std::uint64_t calls() const {
    const std::lock_guard lock(mutex_);
    return calls_;
  }

 private:
  hal::HapticDevice& device_;
  mutable std::mutex mutex_;
  hal::RigSample sample_;
  hal::Vector3 force_n_;
  bool writes_ = true;
  std::uint32_t seen_ = 0;
  std::uint64_t calls_ = 0;
};

/// A page, a driver that finds its devices there, and a thread that runs it.
class HdBench {
 public:
  explicit HdBench(const std::function<void(OpenHapticsConfig&)>& change = {}) : page(folder_.path("page")) {
    setenv("HD_STAND_IN_PAGE", page.path().c_str(), 1);
    config.vendor_library_names = stand_in();
    config.stall_s = 0.25;  // of the machine this runs on, rather than of a scheduler
    if (change) change(config);
    device = std::move(*OpenHapticsDevice::create(config));
    body = std::make_unique<Body>(*device);
  }
  ~HdBench() {
    stop_running();
    device = nullptr;
    unsetenv("HD_STAND_IN_PAGE");
  }

  void start_running() {
    stop = false;
    returned = false;
    runner = std::thread([this] {
      device->run(*body, stop);
      returned = true;
    });
  }
  void stop_running() {
    stop = true;
    if (runner.joinable()) runner.join();
  }
  /// Engaged, running, and the force that is asked for arrives at the device.
  bool renders(double z_n) {
    if (device->engage()) return false;
    body->ask({0.0, 0.0, z_n});
    start_running();
    return feels(z_n);
  }
  /// Engaged, running, and so many ticks on.
  bool runs(std::uint64_t tick_count) {
    if (device->engage()) return false;
    start_running();
    return ticks(tick_count);
  }
  /// Ticks that begin from now on: those under way may have measured before.
  bool ticks(std::uint64_t count) {
    const std::uint64_t from = body->calls();
    return eventually([&] { return body->calls() >= from + count; });
  }
  bool sees(std::uint32_t bit) {
    return eventually([&] { return (body->seen() & bit) != 0; });  // in any tick since it was last asked
  }
  bool sees_no(std::uint32_t bit) {
    const bool gone = eventually([&] { return (body->sample().status & bit) == 0; });
    body->seen();
    return gone;
  }
  bool feels(double z_n) {
    return eventually([&] { return std::abs(page.force_n().y - z_n) < 1e-9; });
  }

  /// -1 if the device shows none of that name.
  double figure(const std::string& name) const { return find_figure(device->report(), name).value_or(-1.0); }
  bool finds(const std::string& words) const { return shows(device->report(), words); }
  /// Force off, device closed, library gone, in this order and without a breach of its rules.
  bool left_clean() {
    return !page->loaded && !page->scheduler_running && page->violations == 0 && !page.device().open &&
           !page.device().force_enabled && page.device().force_n[0] == 0.0 &&
           page.device().force_n[1] == 0.0 && page.device().force_n[2] == 0.0;
  }
  bool leaves_clean() {
    stop_running();
    device->disengage();
    return left_clean();
  }

 private:
  TemporaryFolder folder_;

 public:
  HdPage page;
  OpenHapticsConfig config;
  std::unique_ptr<OpenHapticsDevice> device;
  std::unique_ptr<Body> body;
  std::atomic<bool> stop{false};
  std::atomic<bool> returned{false};
  std::thread runner;
};

}  // namespace hapticd::test
