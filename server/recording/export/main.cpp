// hapticd-export: a recording as a table. A separate program: the daemon has it do the work, so that no
// failure of the HDF5 library, and none of its memory, is the daemon's. It needs no daemon.

#include <fmt/core.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstring>
#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>

#include "proto/text/usage_message.h"
#include "proto/text/utf8_text.h"
#include "server/recording/export/table_export.h"

namespace {

constexpr int kRefused = 2;
/// Niceness below all that the daemon does.
constexpr int kNiceness = 15;
/// Memory limit, several times what a recording with the largest chunks takes.
constexpr rlim_t kMaxMemory = rlim_t{4} << 30U;

/// Makes the export modest, so that the daemon does not suffer for it: below all that it does, and ended
/// first if memory is short. A child of the daemon has inherited that the daemon is ended last.
void be_modest() {
  setpriority(PRIO_PROCESS, 0, kNiceness);
#ifndef HAPTICD_SANITIZED  // a sanitizer maps far more than it uses
  const rlimit memory{kMaxMemory, kMaxMemory};
  setrlimit(RLIMIT_AS, &memory);
#endif
  std::ofstream("/proc/self/oom_score_adj") << 800;
}

/// Message for the case that the HDF5 library fails on a damaged file.
const char* words_of_a_crash = "hapticd-export: the HDF5 library failed on the recording; it is damaged\n";

/// Says so instead of ending by a signal: the library reads what a file says of itself without doubt.
void name_crashes(bool json) {
  if (json) {
    words_of_a_crash =
        R"({"what": "the HDF5 library failed on the recording", "where": "", "value": "", "limit": "", "remedy": "it is damaged: take another copy", "is_full": false})"
        "\n";
  }
#ifndef HAPTICD_SANITIZED  // a sanitizer has handlers for them
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) {
    std::signal(number, [](int) {
      const ssize_t written = write(STDERR_FILENO, words_of_a_crash, std::strlen(words_of_a_crash));
      _exit(written < 0 ? 1 : kRefused);
    });
  }
#endif
}

int refuse(const hapticd::hal::Error& error, bool json) {
  if (json) {
    const nlohmann::json parts{
        {"what", error.what},     {"where", error.where},
        {"value", error.value},   {"limit", error.limit},
        {"remedy", error.remedy}, {"is_full", error.code == hapticd::hal::ErrorCode::kFull}};
    const std::string words = parts.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    fmt::print(stderr, "{}\n", hapticd::text::printable(words));
  } else {
    fmt::print(stderr, "hapticd-export: {}\n", hapticd::text::printable(error.text()));
  }
  return kRefused;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace hapticd::server;
  CLI::App app(
      "hapticd-export writes a recording of hapticd (MCAP) as HDF5 or CSV, and an HDF5 table of one as CSV. "
      "It needs no daemon.",
      "hapticd-export");
  app.set_version_flag("--version", "hapticd-export " HAPTICD_VERSION);
  ExportRequest request;
  bool json_errors = false;
  app.add_option("RECORDING", request.input,
                 "Made by hapticctl record or by the flight recorder; .h5: without events and metadata")
      ->required();
  app.add_option("-o,--out", request.output, "Where to write: .h5, .hdf5 or .csv, or any name with --format")
      ->required();
  const std::map<std::string, TableFormat> formats{{"hdf5", TableFormat::kHdf5}, {"csv", TableFormat::kCsv}};
  CLI::Option* format = app.add_option("--format", request.format, "hdf5 or csv [by the ending of --out]")
                            ->transform(CLI::CheckedTransformer(formats));
  app.add_option("--columns", request.columns, "Names, separated by commas [all]")->delimiter(',');
  app.add_option("--from", request.from_s, "Seconds after the first row")->capture_default_str();
  app.add_option("--to", request.to_s, "Seconds after the first row; 0 = to the end")->capture_default_str();
  app.add_option("--decimation", request.decimation, "Every n-th row, 1 … 10000")->capture_default_str();
  app.add_flag("--json-errors", json_errors, "")->group("");  // for the daemon and hapticctl
  bool refuse_links = false;
  app.add_flag("--refuse-links", refuse_links, "")->group("");  // for the daemon
  app.footer(
      "Examples:\n  hapticd-export press.mcap --out press.h5\n"
      "  hapticd-export press.mcap --out press.csv --columns contact_reaction_force_n --from 10 --to 20");
  app.failure_message(hapticd::text::usage_message);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kRefused;
  }
  if (format->count() == 0) {
    const bool is_csv = request.output.ends_with(".csv");
    if (!is_csv && !request.output.ends_with(".h5") && !request.output.ends_with(".hdf5")) {
      return refuse({"the format is not known", "--out", request.output,
                     "a name that ends in .h5, .hdf5 or .csv", "or give --format"},
                    json_errors);
    }
    if (is_csv) request.format = TableFormat::kCsv;
  }
  be_modest();
  name_crashes(json_errors);
  if (refuse_links) request.links = hapticd::recording::Links::kRefused;
  try {
    if (const auto error = export_table(request)) return refuse(*error, json_errors);
  } catch (const std::exception& error) {
    return refuse({"the export failed", request.input, error.what(), "", ""}, json_errors);
  }
  return 0;
}
