#pragma once

#include <chrono>
#include <stop_token>
#include <string>

#include "hal/error.h"

namespace hapticd::netft {

/// Fetches the text of a page, by HTTP GET. Returns by the deadline, whatever the server does: refuse, stay
/// silent, send slowly, or send without end (at most `max_bytes` are read). `address` is a number, so that no
/// name server is needed. Redirections are not followed: a box has none.
hal::Result<std::string> fetch_page(const std::string& address, int port, const std::string& path,
                                    std::chrono::steady_clock::time_point deadline, std::size_t max_bytes,
                                    const std::stop_token& cancel);

}  // namespace hapticd::netft
