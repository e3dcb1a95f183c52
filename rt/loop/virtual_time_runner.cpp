#include "rt/loop/virtual_time_runner.h"

#include <chrono>
#include <thread>

namespace hapticd::rt {

namespace {
constexpr std::chrono::milliseconds kReaderTimeout{100};
/// An observer asked for what it gets, and may be at a long computation.
constexpr std::chrono::milliseconds kObserverTimeout{5000};
constexpr std::chrono::microseconds kPollInterval{100};
}  // namespace

hal::DeviceCommand VirtualTimeRunner::on_tick(const hal::RigSample& sample) noexcept {
  if (waits_for_reader_) await_reader();
  if (!engine_.is_observed()) {
    waits_for_observer_ = true;
  } else if (waits_for_observer_) {
    await_observer(sample);
  }
  return engine_.on_tick(sample);
}

void VirtualTimeRunner::await_reader() noexcept {
  for (auto waited = kPollInterval.zero(); !engine_.has_room_for_record(); waited += kPollInterval) {
    if (waited >= kReaderTimeout) {
      waits_for_reader_ = false;
      return;
    }
    std::this_thread::sleep_for(kPollInterval);
  }
}

void VirtualTimeRunner::await_observer(const hal::RigSample& sample) noexcept {
  for (auto waited = kPollInterval.zero(); engine_.is_observed() && !engine_.has_room_for_observation();
       waited += kPollInterval) {
    if (waited >= kObserverTimeout) {
      waits_for_observer_ = false;
      return;
    }
    std::this_thread::sleep_for(kPollInterval);
    engine_.take_commands(sample);  // the observer may be waiting for the answer to one
  }
}

}  // namespace hapticd::rt
