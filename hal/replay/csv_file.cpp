#include "hal/replay/csv_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>

#include "hal/shown_text.h"

namespace hapticd::replay {
namespace {

using hal::shown;
using hal::trimmed;

constexpr std::size_t kMaxShown = 40;
/// Lines in which the table's header is looked for.
constexpr std::size_t kMaxLooked = 200;
constexpr std::size_t kMaxNumberBytes = 64;

constexpr const char* kTakeCommas =
    "say that the file has decimal commas: hapticctl identify --decimal-comma, hapticd --rig "
    "'replay:FILE?decimal_comma=true' or [rig.replay] decimal_comma = true";

std::string separator_name(char separator) {
  return separator == '\t' ? "tabs" : separator == ';' ? "semicolons" : "commas";
}

bool is_number(std::string_view text, double& number, std::errc& code) {
  // from_chars() accepts a minus sign but no plus.
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), number);
  code = parsed.ec;
  return code != std::errc::invalid_argument && parsed.ptr == text.data() + text.size();
}

/// Says why a cell does not read as a number, and the remedy.
std::pair<const char*, const char*> cell_fault(std::string_view text, bool decimal_comma) {
  if (is_like_number(text) && text.find(',') != std::string_view::npos && !decimal_comma)
    return {"the cell has a comma", kTakeCommas};
  if (is_like_number(text) && text.find('.') != std::string_view::npos && decimal_comma)
    return {"the cell has a point, where decimal commas were announced",
            "leave out decimal_comma, or export the file without separators of thousands"};
  if (text.find(':') != std::string_view::npos)
    return {"the cell is not a number", "export the time in seconds, or map another column"};
  const std::size_t blank = text.find(' ');
  if (blank != std::string_view::npos && is_like_number(text.substr(0, blank)))
    return {"the cell is not a number", "write the unit into the column's name, as in force_N"};
  return {"the cell is not a number", "remove the row, or map another column"};
}

}  // namespace

std::string CsvFile::place(std::size_t line) const {
  return "recording '" + path_ + "'" + (line > 0 ? ", line " + std::to_string(line) : "");
}

hal::Result<CsvFile> CsvFile::open(const std::string& path, const CsvFormat& format) {
  CsvFile file(path, format);
  std::error_code code;
  const auto status = std::filesystem::status(path, code);
  if (!std::filesystem::exists(status)) {
    return hal::Error{
        .what = "there is no such file",
        .where = file.place(),
        .value = {},
        .limit = {},
        .remedy = "check the path; a relative path starts at the folder in which the daemon was started",
        .code = hal::ErrorCode::kNotFound};
  }
  // A folder opens but cannot be read; a pipe would block for ever.
  if (!std::filesystem::is_regular_file(status)) {
    return hal::Error{.what = "this is not a regular file",
                      .where = file.place(),
                      .value = {},
                      .limit = {},
                      .remedy = "give a CSV file",
                      .code = hal::ErrorCode::kUnreadable};
  }
  if (!file.lines_.open(path)) {
    return hal::Error{.what = "the file cannot be opened",
                      .where = file.place(),
                      .value = {},
                      .limit = {},
                      .remedy = "check its permissions",
                      .code = hal::ErrorCode::kUnreadable};
  }
  if (auto error = file.find_table()) return *error;
  return file;
}

std::optional<hal::Error> CsvFile::find_table() {
  std::vector<CsvLine> lines;
  std::string_view text;
  std::optional<hal::Error> error;
  while (lines.size() < kMaxLooked) {
    const auto state = next_line(text, error);
    if (state == TextLines::State::kEnd) break;
    // Faults further down are reported with their line while the rows are read.
    if (state != TextLines::State::kLine && !lines.empty()) break;
    if (state != TextLines::State::kLine) return error;
    lines.push_back({lines_.number(), std::string(text)});
  }
  if (lines.empty()) {
    return hal::Error{.what = "the file is empty",
                      .where = place(),
                      .value = {},
                      .limit = "a header line and at least two rows",
                      .remedy = "record or export it again",
                      .code = hal::ErrorCode::kMalformed};
  }
  layout_ = find_layout(lines);
  // Again from the front, to the first row.
  lines_ = TextLines();
  lines_.open(path_);
  while (lines_.number() < layout_.last_line_before_rows) {
    if (lines_.next(text) != TextLines::State::kLine) break;
  }
  return std::nullopt;
}

TextLines::State CsvFile::next_line(std::string_view& text, std::optional<hal::Error>& error) {
  for (;;) {
    const auto state = lines_.next(text);
    switch (state) {
      case TextLines::State::kLine:
        if (const std::string_view content = trimmed(text); content.empty() || content.front() == '#')
          continue;
        return state;
      case TextLines::State::kEnd:
        return state;
      case TextLines::State::kTooLong:
        error = hal::Error{.what = "the line is too long for a table of numbers",
                           .where = place(lines_.number()),
                           .value = {},
                           .limit = "lines up to " + std::to_string(TextLines::kMaxLineBytes) + " bytes",
                           .remedy = "check that this is a CSV file",
                           .code = hal::ErrorCode::kTooLong};
        return state;
      case TextLines::State::kFailed:
        error = hal::Error{.what = "the file could not be read to its end",
                           .where = place(lines_.number() + 1),
                           .value = {},
                           .limit = {},
                           .remedy = "copy the file to another disk and try again",
                           .code = hal::ErrorCode::kUnreadable};
        return state;
    }
  }
}

std::optional<hal::Error> CsvFile::parse_cell(std::string_view text, std::size_t column,
                                              double& number) const {
  const auto refuse = [&](std::string what, std::string remedy) {
    return hal::Error{.what = std::move(what),
                      .where = place(lines_.number()) + ", column '" + columns()[column] + "'",
                      .value = shown(text, kMaxShown),
                      .limit = format_.decimal_comma ? "finite numbers such as 0,015 or 1,5e-3"
                                                     : "finite numbers such as 0.015 or 1.5e-3",
                      .remedy = std::move(remedy),
                      .code = hal::ErrorCode::kMalformed};
  };
  if (text.empty()) return refuse("the cell is empty", "remove the row, or fill the gap before replaying");
  std::array<char, kMaxNumberBytes> pointed{};
  std::string_view digits = text;
  if (format_.decimal_comma && text.size() <= pointed.size() && text.find('.') == std::string_view::npos) {
    std::replace_copy(text.begin(), text.end(), pointed.begin(), ',', '.');
    digits = {pointed.data(), text.size()};
  }
  const bool has_wrong_point = format_.decimal_comma && text.find('.') != std::string_view::npos;
  std::errc code{};
  if (has_wrong_point || !is_number(digits, number, code)) {
    const auto [what, remedy] = cell_fault(text, format_.decimal_comma);
    return refuse(what, remedy);
  }
  if (code != std::errc() || !std::isfinite(number)) {
    return refuse("the cell is not a finite number",
                  "remove the row; a gap in time is allowed and shown as one");
  }
  return std::nullopt;
}

hal::Error CsvFile::wrong_count(std::size_t count) const {
  // "0,01,1,25,3,5" under "time_s,force_N,depth_mm".
  const bool has_decimal_commas = layout_.separator == ',' && count == 2 * columns().size();
  return hal::Error{
      .what = "the row does not have the header's number of cells",
      .where = place(lines_.number()),
      .value = std::to_string(count),
      .limit = std::to_string(columns().size()) + " cells, separated by " +
               separator_name(layout_.separator) + ", as in line " + std::to_string(layout_.header_line),
      .remedy = has_decimal_commas
                    ? "export it with semicolons between the columns, then " + std::string(kTakeCommas)
                    : "remove the row, or put quotation marks around text with a separator",
      .code = hal::ErrorCode::kMalformed};
}

std::optional<hal::Error> CsvFile::read_rows(std::span<const std::size_t> columns, const RowVisitor& visit) {
  std::vector<double> numbers(columns.size());
  std::vector<std::string_view> cells(layout_.columns.size());
  std::string_view text;
  std::optional<hal::Error> error;
  for (std::size_t rows = 0;; ++rows) {
    const auto state = next_line(text, error);
    if (state == TextLines::State::kEnd) return std::nullopt;
    if (state != TextLines::State::kLine) return error;
    if (rows == kMaxRows) {
      return hal::Error{.what = "the recording is too long",
                        .where = place(lines_.number()),
                        .value = {},
                        .limit = "up to " + std::to_string(kMaxRows) + " rows",
                        .remedy = "split it",
                        .code = hal::ErrorCode::kTooLong};
    }
    bool has_more = false;
    const std::size_t count =
        split_cells(text, layout_.separator, [&cells, &has_more](std::size_t index, std::string_view cell) {
          if (index < cells.size()) {
            cells[index] = cell;
          } else if (!cell.empty()) {
            has_more = true;
          }
        });
    if (has_more || count < cells.size()) error = wrong_count(count);
    for (std::size_t i = 0; i < columns.size() && !error; ++i)
      error = parse_cell(cells[columns[i]], columns[i], numbers[i]);
    if (error) return lines_.is_unfinished() ? std::nullopt : error;
    if (error = visit(lines_.number(), numbers); error) return error;
  }
}

}  // namespace hapticd::replay
