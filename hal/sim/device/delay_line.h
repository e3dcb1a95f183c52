#pragma once

#include <array>
#include <cstddef>

namespace hapticd::sim {

/// Values of the last `Capacity` steps; delayed(n) is the value pushed n pushes ago, or the oldest
/// available.
template <class Value, std::size_t Capacity>
class DelayLine {
 public:
  void push(const Value& value) noexcept {
    newest_ = (newest_ + 1) % Capacity;
    values_[newest_] = value;
    if (count_ < Capacity) ++count_;
  }
  bool empty() const noexcept { return count_ == 0; }
  const Value& delayed(std::size_t delay) const noexcept {
    const std::size_t back = delay < count_ ? delay : count_ - 1;
    return values_[(newest_ + Capacity - back) % Capacity];
  }

 private:
  std::array<Value, Capacity> values_{};
  std::size_t newest_ = Capacity - 1;
  std::size_t count_ = 0;
};

}  // namespace hapticd::sim
