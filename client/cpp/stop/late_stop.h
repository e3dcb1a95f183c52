#pragma once

// Internal to the library.

#include <chrono>
#include <thread>

#include "client/cpp/client.h"

namespace hapticd::client {

/// Stops by the stop port after a short time, unless it is destroyed before: beside a call that is to take
/// the force away by itself, such as that of a pedal which is released. A daemon whose calls hang loses its
/// force all the same.
class LateStop {
 public:
  static constexpr std::chrono::milliseconds kDelay{5};

  explicit LateStop(const ClientOptions& options);
  ~LateStop();
  LateStop(const LateStop&) = delete;
  LateStop& operator=(const LateStop&) = delete;

 private:
  int cancelled_;
  std::thread thread_;
};

}  // namespace hapticd::client
