#pragma once

#include <cstdint>

namespace hapticd::daq {

/// Extends a counter of limited width to one that never wraps: of the two possible steps the shorter is
/// taken. The first reading is taken as a signed number.
class CounterUnwrap {
 public:
  void restart() noexcept { has_last_ = false; }

  std::int64_t add(std::uint64_t raw, int bits) noexcept {
    const std::int64_t reading = signed_of(raw, bits);
    if (!has_last_) {
      has_last_ = true;
      total_ = reading;
    } else {
      total_ += signed_of(raw - last_raw_, bits);
    }
    last_raw_ = raw;
    return total_;
  }

 private:
  /// The number modulo 2^bits that lies in [-2^(bits-1), 2^(bits-1)).
  static std::int64_t signed_of(std::uint64_t raw, int bits) noexcept {
    const int unused = 64 - bits;
    return static_cast<std::int64_t>(raw << unused) >> unused;
  }

  bool has_last_ = false;
  std::uint64_t last_raw_ = 0;
  std::int64_t total_ = 0;
};

}  // namespace hapticd::daq
