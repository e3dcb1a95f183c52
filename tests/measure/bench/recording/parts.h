#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "tests/measure/report/report.h"

namespace hapticd::bench {

/// Adds a figure and its line of the table.
using AddFigure = std::function<void(const std::string& name, const report::Figure& figure)>;

/// What recording costs: CPU time, how late ticks begin, and the export of an hour.
void add_cost_figures(const std::filesystem::path& folder, bool quick, const AddFigure& add);

/// What the service takes: locked memory, and the time of a scrape of its metrics.
void add_service_figures(const std::filesystem::path& folder, bool quick, const AddFigure& add);

/// Adds the time from `apt install` of the packages in a folder, on a fresh Debian 12 made for it, until the
/// service has answered and ended.
void add_install_figure(const std::filesystem::path& folder, const std::string& packages,
                        const AddFigure& add);

}  // namespace hapticd::bench
