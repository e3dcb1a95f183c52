#include "server/connection/account.h"

#include <algorithm>

namespace hapticd::server {

void Allowance::refill(Time now) {
  if (since_ != Time{}) {
    const double passed_s = std::chrono::duration<double>(now - since_).count();
    left_ = std::min(at_once_, left_ + std::max(0.0, passed_s) * per_s_);
  }
  since_ = now;
}

bool Allowance::take(Time now) {
  refill(now);
  if (left_ < 1.0) return false;
  left_ -= 1.0;
  return true;
}

bool Allowance::is_full(Time now) {
  refill(now);
  return left_ >= at_once_;
}

}  // namespace hapticd::server
