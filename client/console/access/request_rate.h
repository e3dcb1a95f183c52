#pragma once

#include <algorithm>
#include <chrono>

namespace hapticd::console {

/// How often something may happen: `per_s` on average, and twice that at once.
class RequestRate {
 public:
  using Time = std::chrono::steady_clock::time_point;
  explicit RequestRate(double per_s) : per_s_(per_s), left_(2.0 * per_s) {}

  /// Takes one; false if none is left.
  bool take(Time now) {
    const double passed_s = std::chrono::duration<double>(now - last_).count();
    left_ = last_ == Time{} ? left_ : std::min(left_ + passed_s * per_s_, 2.0 * per_s_);
    last_ = now;
    if (left_ < 1.0) return false;
    left_ -= 1.0;
    return true;
  }

 private:
  double per_s_;
  double left_;
  Time last_{};
};

}  // namespace hapticd::console
