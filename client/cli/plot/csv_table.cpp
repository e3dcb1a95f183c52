#include "client/cli/plot/csv_table.h"

#include <fmt/core.h>

#include <charconv>
#include <limits>
#include <sstream>
#include <string_view>

#include "client/cli/session/session.h"

namespace hapticd::cli {
namespace {

constexpr std::size_t kMaxColumns = 4096;

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> cells;
  while (true) {
    const auto comma = line.find(',');
    cells.push_back(line.substr(0, comma));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

double number(std::string_view cell) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  const bool whole = error == std::errc{} && end == cell.data() + cell.size();
  return whole ? value : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

CsvTable CsvTable::read(const std::string& path, const std::string& shown_as) {
  CsvTable table;
  table.path_ = shown_as;
  std::istringstream text(read_text_file(path));
  std::vector<std::vector<double>*> in_order;
  std::string line;
  for (std::size_t line_number = 1; std::getline(text, line); ++line_number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty() || line.front() == '#') continue;
    const auto cells = split(line);
    if (cells.size() > kMaxColumns) {
      throw LocalError("a line has too many cells", fmt::format("{}, line {}", shown_as, line_number),
                       fmt::format("{} cells", cells.size()), fmt::format("at most {}", kMaxColumns));
    }
    if (in_order.empty()) {
      for (const auto name : cells) in_order.push_back(&table.columns_[std::string(name)]);
      continue;
    }
    if (cells.size() != in_order.size()) {
      throw LocalError("a row has another number of cells than the head of the table",
                       fmt::format("{}, line {}", shown_as, line_number),
                       fmt::format("{} cells", cells.size()), fmt::format("{} cells", in_order.size()));
    }
    for (std::size_t i = 0; i < cells.size(); ++i) in_order[i]->push_back(number(cells[i]));
    ++table.rows_;
  }
  if (table.rows_ == 0) throw LocalError("there are no samples in the recording", shown_as);
  return table;
}

const std::vector<double>& CsvTable::column(const std::string& name) const {
  const auto found = columns_.find(name);
  if (found == columns_.end()) {
    throw LocalError("a column is missing in the recording", path_, "'" + name + "'", "",
                     "record with the telemetry groups that hold it (see hapticctl telemetry record --help)");
  }
  return found->second;
}

}  // namespace hapticd::cli
