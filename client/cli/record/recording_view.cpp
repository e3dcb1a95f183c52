#include "client/cli/record/recording_view.h"

#include <fmt/core.h>

#include <ctime>

#include "client/cli/text/names.h"
#include "client/cli/text/text_table.h"

namespace hapticd::cli {
namespace {

using Align = TextTable::Align;

std::string loss_words(const v1::RecordingFile& file) {
  return file.lost_ticks() == 0 ? "none lost" : fmt::format("{} ticks LOST", file.lost_ticks());
}

/// True if its rows are there, but were not counted.
bool is_uncounted(const v1::RecordingFile& file) {
  return file.state() == v1::RECORDING_STATE_UNFINISHED;
}

}  // namespace

std::string size_words(std::uint64_t bytes) {
  const double mb = 1e-6 * static_cast<double>(bytes);
  return mb < 1.0 ? fmt::format("{:.0f} kB", 1e3 * mb) : fmt::format("{:.1f} MB", mb);
}

std::string utc_text(std::int64_t unix_ns) {
  const std::time_t seconds = static_cast<std::time_t>(unix_ns / 1'000'000'000);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[40];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S UTC", &parts);
  return text;
}

std::string recording_line(const v1::RecordingFile& file) {
  if (is_uncounted(file)) return fmt::format("{}: without an end, {}", file.id(), size_words(file.bytes()));
  return fmt::format("{}: {} rows in {:.1f} s, {}, {}", file.id(), file.rows(), file.duration_s(),
                     loss_words(file), size_words(file.bytes()));
}

std::vector<std::string> recording_table(const v1::ListRecordingsResponse& list, const Terminal& terminal) {
  TextTable table({"id", "state", "s", "rows", "lost", "size", "note, or why it ended"},
                  {Align::kLeft, Align::kLeft, Align::kRight, Align::kRight, Align::kRight, Align::kRight});
  for (const v1::RecordingFile& file : list.recordings()) {
    const auto counted = [&file](const std::string& words) { return is_uncounted(file) ? "?" : words; };
    table.add({file.id(), word(file.state()), counted(fmt::format("{:.1f}", file.duration_s())),
               counted(fmt::format("{}", file.rows())), counted(fmt::format("{}", file.lost_ticks())),
               size_words(file.bytes()), file.note().empty() ? file.end_reason() : file.note()});
  }
  return table.lines(terminal);
}

std::vector<std::string> incident_table(const v1::ListRecordingsResponse& list, const Terminal& terminal) {
  TextTable table({"id", "s", "lost", "size", "cause"},
                  {Align::kLeft, Align::kRight, Align::kRight, Align::kRight, Align::kLeft});
  for (const v1::RecordingFile& file : list.recordings()) {
    table.add({file.id(), fmt::format("{:.1f}", file.duration_s()), fmt::format("{}", file.lost_ticks()),
               size_words(file.bytes()), file.end_reason()});
  }
  return table.lines(terminal);
}

}  // namespace hapticd::cli
