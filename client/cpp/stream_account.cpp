#include "client/cpp/stream_account.h"

#include <algorithm>

namespace hapticd::client {

std::uint64_t StreamAccount::add(std::uint64_t tick) noexcept {
  ++samples_;
  if (samples_ == 1) {
    last_tick_ = tick;
    return 0;
  }
  if (tick <= last_tick_) {
    ++disordered_;
    return 0;
  }
  const std::uint64_t step = tick - last_tick_;
  last_tick_ = tick;
  if (step < decimation_) {
    ++disordered_;
    return 0;
  }
  // Rounded up: a step that is not a multiple of the decimation hides at least one sample.
  const std::uint64_t missing_here = (step + decimation_ - 1) / decimation_ - 1;
  if (missing_here > 0) {
    ++gaps_;
    missing_ += missing_here;
  }
  return missing_here;
}

void StreamAccount::set_dropped(std::uint64_t by_subscriber, std::uint64_t by_server) noexcept {
  dropped_by_subscriber_ = std::max(dropped_by_subscriber_, by_subscriber);
  dropped_by_server_ = std::max(dropped_by_server_, by_server);
}

}  // namespace hapticd::client
