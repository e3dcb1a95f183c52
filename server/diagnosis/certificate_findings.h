#pragma once

#include <chrono>
#include <string>

#include "server/diagnosis/finding.h"

namespace hapticd::server {

/// Examines whether the certificates that the daemon shows, and by which it knows its clients, can be used,
/// and for how long: a warning 30 days before an end. Nothing if `folder` is empty: it serves without.
Findings examine_certificates(const std::string& folder, std::chrono::system_clock::time_point now);

}  // namespace hapticd::server
