#include "server/recording/export/csv_sink.h"

#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "hal/recording/recording_names.h"
#include "proto/text/utf8_text.h"

namespace hapticd::server {

namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;

template <class T>
void put_number(T number, std::string& line) {
  char text[32];
  const auto [end, failed] = std::to_chars(text, text + sizeof text, number);
  line.append(text, end);
}

/// Seconds to the nanosecond: a double has fewer digits.
void put_seconds(std::int64_t time_ns, std::string& line) {
  char text[32];
  std::snprintf(text, sizeof text, "%s%lld.%09lld", time_ns < 0 ? "-" : "",
                static_cast<long long>(std::abs(time_ns / kSecondNs)),
                static_cast<long long>(std::abs(time_ns % kSecondNs)));
  line += text;
}

}  // namespace

hal::Result<std::unique_ptr<TableSink>> CsvSink::create(const std::string& path,
                                                        std::vector<ExportColumn> columns) {
  std::unique_ptr<CsvSink> sink(new CsvSink(path, std::move(columns)));
  sink->stream_.open(path, std::ios::binary | std::ios::trunc);
  if (!sink->stream_)
    return hal::Error{"the file cannot be written", path, "", "", "see the rights of its folder"};
  return std::unique_ptr<TableSink>(std::move(sink));
}

void CsvSink::comment(const std::string& text) {
  stream_ << "# " << text::printable(text) << '\n';
}

void CsvSink::add_metadata(const std::string& name, const recording::Texts& texts) {
  if (name == recording::kConfigurationMetadata) return;  // pages of text; HDF5 has it
  for (const auto& [key, value] : texts) comment(name + "." + key + ": " + value);
}

void CsvSink::add_event(const recording::Event& event) {
  std::string text = "event at ";
  put_seconds(event.time_ns, text);
  comment(text + " s, tick " + std::to_string(event.tick) + ", " + recording::name_of(event.kind) + ": " +
          event.text + (event.by.empty() ? "" : ", by " + event.by));
}

std::optional<hal::Error> CsvSink::add_row(const recording::Row& row) {
  line_.clear();
  if (!std::exchange(has_names_, true)) {
    for (const ExportColumn& one : columns_) {
      if (!line_.empty()) line_ += ',';
      line_ += one.column.name == "time_ns" ? "time_s" : one.column.name;
    }
    line_ += '\n';
  }
  bool first = true;
  for (const ExportColumn& one : columns_) {
    if (!std::exchange(first, false)) line_ += ',';
    if (one.column.name == "time_ns") {
      put_seconds(row.integer(one.index), line_);
    } else if (one.column.is_integer) {
      put_number(row.integer(one.index), line_);
    } else {
      put_number(row.number(one.index), line_);
    }
  }
  line_ += '\n';
  errno = 0;
  stream_.write(line_.data(), static_cast<std::streamsize>(line_.size()));
  if (stream_) return std::nullopt;
  return unwritten(path_, errno);
}

std::optional<hal::Error> CsvSink::finish() {
  errno = 0;
  stream_.close();
  if (stream_) return std::nullopt;
  return unwritten(path_, errno);
}

}  // namespace hapticd::server
