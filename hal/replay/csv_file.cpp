#include "hal/replay/csv_file.h"

#include <algorithm>
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

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// Calls `take(index, cell)` for each comma-separated cell and returns their number.
template <class Take>
std::size_t split(std::string_view text, const Take& take) {
  std::size_t index = 0;
  for (;;) {
    const std::size_t comma = text.find(',');
    take(index++, trimmed(text.substr(0, comma)));
    if (comma == std::string_view::npos) return index;
    text.remove_prefix(comma + 1);
  }
}

}  // namespace

std::string CsvFile::place(std::size_t line) const {
  return "recording '" + path_ + "'" + (line > 0 ? ", line " + std::to_string(line) : "");
}

hal::Result<CsvFile> CsvFile::open(const std::string& path) {
  CsvFile file(path);
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
  file.stream_.open(path, std::ios::binary);
  if (!file.stream_) {
    return hal::Error{.what = "the file cannot be opened",
                      .where = file.place(),
                      .value = {},
                      .limit = {},
                      .remedy = "check its permissions",
                      .code = hal::ErrorCode::kUnreadable};
  }

  std::string_view header;
  std::optional<hal::Error> error;
  switch (file.next_line(header, error)) {
    case LineState::kFailed:
      return *error;
    case LineState::kEnd:
      return hal::Error{.what = "the file is empty",
                        .where = file.place(),
                        .value = {},
                        .limit = "a header line and at least two rows",
                        .remedy = {},
                        .code = hal::ErrorCode::kMalformed};
    case LineState::kLine:
      break;
  }
  if (header.find('"') != std::string_view::npos) {
    return hal::Error{.what = "the header has quoted names",
                      .where = file.place(file.line_),
                      .value = shown(header, kMaxShown),
                      .limit = "plain names separated by commas",
                      .remedy = "write the file without quotes",
                      .code = hal::ErrorCode::kMalformed};
  }
  split(header, [&file](std::size_t, std::string_view name) { file.columns_.emplace_back(name); });
  if (file.columns_.size() == 1 && header.find_first_of(";\t") != std::string_view::npos) {
    return hal::Error{.what = "the columns are not separated by commas",
                      .where = file.place(file.line_),
                      .value = shown(header, kMaxShown),
                      .limit = "',' between columns and '.' as decimal point",
                      .remedy = "export the file again with commas",
                      .code = hal::ErrorCode::kMalformed};
  }
  return file;
}

CsvFile::LineState CsvFile::next_line(std::string_view& text, std::optional<hal::Error>& error) {
  while (stream_.getline(buffer_.data(), static_cast<std::streamsize>(buffer_.size()))) {
    ++line_;
    // gcount() counts the line end too, but there is none at the end of the file.
    const auto length = static_cast<std::size_t>(stream_.gcount()) - (stream_.eof() ? 0 : 1);
    std::string_view line(buffer_.data(), length);
    if (line_ == 1 && line.starts_with(kByteOrderMark)) line.remove_prefix(kByteOrderMark.size());
    line = trimmed(line);
    if (line.empty() || line.front() == '#') continue;
    text = line;
    return LineState::kLine;
  }
  if (stream_.bad()) {
    error = hal::Error{.what = "the file could not be read to its end",
                       .where = place(line_ + 1),
                       .value = {},
                       .limit = {},
                       .remedy = {},
                       .code = hal::ErrorCode::kUnreadable};
    return LineState::kFailed;
  }
  if (stream_.eof()) return LineState::kEnd;
  error = hal::Error{.what = "the line is too long for a table of numbers",
                     .where = place(line_ + 1),
                     .value = {},
                     .limit = "lines up to " + std::to_string(kMaxLineBytes) + " bytes",
                     .remedy = "check that this is a CSV file",
                     .code = hal::ErrorCode::kTooLong};
  return LineState::kFailed;
}

std::optional<hal::Error> CsvFile::parse_cell(std::string_view text, std::size_t column,
                                              double& number) const {
  const auto refuse = [&](std::string what, std::string remedy) {
    return hal::Error{.what = std::move(what),
                      .where = place(line_) + ", column '" + columns_[column] + "'",
                      .value = shown(text, kMaxShown),
                      .limit = "finite numbers such as 0.015 or 1.5e-3",
                      .remedy = std::move(remedy),
                      .code = hal::ErrorCode::kMalformed};
  };
  if (text.empty()) return refuse("the cell is empty", "remove the row, or fill the gap before replaying");
  if (text.front() == '"') return refuse("quoted fields are not read", "write the numbers without quotes");
  // from_chars() accepts a minus sign but no plus.
  const std::string_view digits = text.front() == '+' ? text.substr(1) : text;
  const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (code == std::errc::invalid_argument || end != digits.data() + digits.size()) {
    return refuse("the cell is not a number", {});
  }
  if (code != std::errc() || !std::isfinite(number)) {
    return refuse("the cell is not a finite number",
                  "remove the row; a gap in time is allowed and shown as one");
  }
  return std::nullopt;
}

std::optional<hal::Error> CsvFile::read_rows(std::span<const std::size_t> columns, const RowVisitor& visit) {
  std::vector<double> numbers(columns.size());
  std::vector<std::string_view> cells(columns_.size());
  std::string_view text;
  std::optional<hal::Error> error;
  for (std::size_t rows = 0;; ++rows) {
    switch (next_line(text, error)) {
      case LineState::kFailed:
        return error;
      case LineState::kEnd:
        return std::nullopt;
      case LineState::kLine:
        break;
    }
    if (rows == kMaxRows) {
      return hal::Error{.what = "the recording is too long",
                        .where = place(line_),
                        .value = {},
                        .limit = "up to " + std::to_string(kMaxRows) + " rows",
                        .remedy = "split it",
                        .code = hal::ErrorCode::kTooLong};
    }
    const std::size_t count = split(text, [&cells](std::size_t index, std::string_view cell) {
      if (index < cells.size()) cells[index] = cell;
    });
    if (count != columns_.size()) {
      return hal::Error{.what = "the row does not have the header's number of cells",
                        .where = place(line_),
                        .value = std::to_string(count),
                        .limit = std::to_string(columns_.size()) + " cells",
                        .remedy = {},
                        .code = hal::ErrorCode::kMalformed};
    }
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (error = parse_cell(cells[columns[i]], columns[i], numbers[i]); error) return error;
    }
    if (error = visit(line_, numbers); error) return error;
  }
}

}  // namespace hapticd::replay
