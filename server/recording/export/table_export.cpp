#include "server/recording/export/table_export.h"

#include <fmt/format.h>
#include <sys/statvfs.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <utility>

#include "hal/recording/recording_file.h"
#include "server/recording/export/csv_sink.h"
#include "server/recording/export/hdf5_sink.h"
#include "server/recording/export/hdf5_source.h"
#include "server/text/suggestion.h"

namespace hapticd::server {

namespace {

using recording::kTickColumn;
using recording::kTimeColumn;

/// Bytes that are free: less than what a library writes at once.
constexpr double kFullBelow = 1e6;

/// What is exported: the table of a file of either kind.
struct Source {
  std::vector<recording::Column> columns;
  std::function<std::optional<hal::Error>(const recording::RecordingVisitor&)> read;
};

hal::Result<Source> open_source(const ExportRequest& request) {
  // The daemon has its own recordings only.
  if (request.links == recording::Links::kFollowed && Hdf5Source::is_hdf5(request.input)) {
    auto opened = Hdf5Source::open(request.input);
    if (!opened) return opened.error();
    const auto file = std::make_shared<Hdf5Source>(std::move(*opened));
    return Source{file->columns(),
                  [file](const recording::RecordingVisitor& visitor) { return file->read(visitor.row); }};
  }
  auto opened = recording::RecordingFile::open(request.input, request.links);
  if (!opened) return opened.error();
  const auto file = std::make_shared<recording::RecordingFile>(std::move(*opened));
  return Source{file->columns(), [file](const recording::RecordingVisitor& visitor) {
                  const auto end = file->read(visitor);
                  return end ? std::nullopt : std::optional(end.error());
                }};
}

hal::Result<std::vector<ExportColumn>> chosen_columns(const std::vector<recording::Column>& all,
                                                      const ExportRequest& request) {
  std::vector<ExportColumn> chosen;
  if (request.columns.empty()) {
    for (std::size_t i = 0; i < all.size(); ++i) chosen.push_back({i, all[i]});
    return chosen;
  }
  std::vector<std::string> names;
  for (const recording::Column& column : all) names.push_back(column.name);
  for (const std::size_t i : {kTickColumn, kTimeColumn}) chosen.push_back({i, all[i]});
  for (const std::string& name : request.columns) {
    if (name == "time_s") continue;
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
      return hal::Error{"the recording has no such column", "recording '" + request.input + "'", name,
                        comma_separated(names), did_you_mean(name, names, "use one of those")};
    }
    const auto index = static_cast<std::size_t>(found - names.begin());
    const bool is_there = std::any_of(chosen.begin(), chosen.end(),
                                      [&](const ExportColumn& column) { return column.index == index; });
    if (!is_there) chosen.push_back({index, all[index]});
  }
  return chosen;
}

std::optional<hal::Error> check_span(const ExportRequest& request) {
  const bool good = std::isfinite(request.from_s) && std::isfinite(request.to_s) && request.from_s >= 0.0 &&
                    (request.to_s == 0.0 || request.to_s > request.from_s);
  if (!good) {
    return hal::Error{"the span is none", "from_s, to_s",
                      fmt::format("{:g} … {:g} s", request.from_s, request.to_s),
                      "0 ≤ from_s < to_s, or to_s = 0: to the end", ""};
  }
  if (request.decimation >= 1 && request.decimation <= 10'000) return std::nullopt;
  return hal::Error{"the decimation is out of range", "decimation", std::to_string(request.decimation),
                    "1 … 10000", ""};
}

}  // namespace

hal::Error unwritten(const std::string& path, int failure) {
  const double left = [&path] {
    struct statvfs disk {};
    return statvfs(path.c_str(), &disk) == 0
               ? static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize)
               : 1e300;
  }();
  const bool is_full = failure == ENOSPC || failure == EDQUOT || left < kFullBelow;
  return hal::Error::of(is_full ? hal::ErrorCode::kFull : hal::ErrorCode::kOther,
                        is_full ? "the disk is full" : "the file cannot be written to its end", path,
                        failure == 0 ? "" : std::strerror(failure), "",
                        is_full ? "make room there, or export fewer columns or a shorter span"
                                : "see its folder and the limits of this process");
}

std::optional<hal::Error> export_table(const ExportRequest& request) {
  if (auto error = check_span(request)) return error;
  const auto source = open_source(request);
  if (!source) return source.error();
  auto columns = chosen_columns(source->columns, request);
  if (!columns) return columns.error();
  auto sink = request.format == TableFormat::kHdf5 ? Hdf5Sink::create(request.output, std::move(*columns))
                                                   : CsvSink::create(request.output, std::move(*columns));
  if (!sink) return sink.error();

  std::optional<hal::Error> failure;
  std::optional<std::int64_t> first_ns;
  double last_s = 0.0;
  std::uint64_t rows = 0;
  std::uint64_t written = 0;
  recording::RecordingVisitor visitor;
  visitor.metadata = [&](const std::string& name, const recording::Texts& texts) {
    (*sink)->add_metadata(name, texts);
  };
  visitor.event = [&](const recording::Event& event) { (*sink)->add_event(event); };
  visitor.row = [&](const recording::Row& row) {
    const std::int64_t time_ns = row.integer(kTimeColumn);
    if (!first_ns) first_ns = time_ns;
    last_s = 1e-9 * static_cast<double>(time_ns - *first_ns);
    if (last_s < request.from_s || (request.to_s > 0.0 && last_s > request.to_s)) return true;
    if (rows++ % request.decimation != 0) return true;
    ++written;
    failure = (*sink)->add_row(row);
    return !failure.has_value();
  };
  const auto unread = source->read(visitor);
  if (failure) return failure;
  if (unread) return unread;
  if (written == 0) {
    return hal::Error{"there is no row in the span", "from_s, to_s",
                      fmt::format("{:g} … {:g} s", request.from_s, request.to_s),
                      fmt::format("the recording has 0 … {:g} s", last_s), ""};
  }
  return (*sink)->finish();
}

}  // namespace hapticd::server
