#pragma once

#include <optional>
#include <system_error>
#include <thread>
#include <utility>

#include "hal/error.h"

namespace hapticd::server {

/// Error of a machine that gives this process no further thread.
hal::Error no_thread_left(const std::system_error& failure);

/// Has `thread` run `body`; an error, and no thread, if the machine gives none. Only for what a client
/// starts: the daemon goes on without it.
template <class Body>
[[nodiscard]] std::optional<hal::Error> start_thread(std::thread& thread, Body body) {
  try {
    thread = std::thread(std::move(body));
    return std::nullopt;
  } catch (const std::system_error& failure) {
    return no_thread_left(failure);
  }
}

}  // namespace hapticd::server
