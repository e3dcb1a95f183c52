#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "tests/measure/report/report.h"

namespace hapticd::bench {

/// Bounds of the offset between client and daemon over loopback and over an emulated LAN, and how often the
/// truth was outside of them in simulated time. Figures `clock_bound_ms` {path} and `clock_violations`.
void add_clock_figures(const std::filesystem::path& logs, bool quick,
                       const std::function<void(const std::string&, const report::Figure&)>& add);

}  // namespace hapticd::bench
