#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace hapticd::rt {

/// The recent past of one signal, each value with the instant it stands for; read between two of them on a
/// straight line. Brings signals that were measured at different instants to a common one. Holds 6 ms of a
/// 10 kHz loop. `Value` can be added and scaled.
template <class Value>
class InstantRing {
 public:
  static constexpr std::size_t kSize = 64;

  /// Forgets the past: `value` counts as what it always was.
  void seed(std::int64_t instant_ns, const Value& value) noexcept { ring_.fill({instant_ns, value}); }
  /// `instant_ns`: later than the last one.
  void push(std::int64_t instant_ns, const Value& value) noexcept {
    newest_ = (newest_ + 1) % kSize;
    ring_[newest_] = {instant_ns, value};
  }
  std::int64_t newest_ns() const noexcept { return ring_[newest_].instant_ns; }
  std::int64_t oldest_ns() const noexcept { return before(kSize - 1).instant_ns; }
  const Value& newest() const noexcept { return ring_[newest_].value; }
  /// Value at an instant within what is held; the nearest end outside it.
  Value at(std::int64_t instant_ns) const noexcept {
    const Entry* later = &ring_[newest_];
    if (instant_ns >= later->instant_ns) return later->value;
    for (std::size_t age = 1; age < kSize; ++age) {
      const Entry& earlier = before(age);
      if (instant_ns >= earlier.instant_ns) {
        const double share = static_cast<double>(instant_ns - earlier.instant_ns) /
                             static_cast<double>(later->instant_ns - earlier.instant_ns);
        return earlier.value + (later->value - earlier.value) * share;
      }
      later = &earlier;
    }
    return later->value;
  }

 private:
  struct Entry {
    std::int64_t instant_ns = 0;
    Value value{};
  };
  const Entry& before(std::size_t age) const noexcept { return ring_[(newest_ + kSize - age) % kSize]; }

  std::array<Entry, kSize> ring_{};
  std::size_t newest_ = 0;
};

}  // namespace hapticd::rt
