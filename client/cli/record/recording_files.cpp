#include "client/cli/record/recording_files.h"

#include <filesystem>
#include <sstream>
#include <utility>

#include "client/cli/record/download.h"
#include "client/cli/record/recording_view.h"
#include "client/cli/session/print.h"
#include "client/cli/session/replaced_file.h"
#include "client/cli/terminal/terminal.h"
#include "client/cli/text/message_json.h"

namespace hapticd::cli {
namespace {

constexpr const char* kIdHelp = "As `list` shows it, or `last`";

/// "record", "incident": the command above these.
std::string command_of(v1::RecordingKind kind) {
  return kind == v1::RECORDING_KIND_INCIDENT ? "incident" : "record";
}

v1::ExportFormat format_of(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  if (ending == ".h5" || ending == ".hdf5") return v1::EXPORT_FORMAT_HDF5;
  if (ending == ".csv") return v1::EXPORT_FORMAT_CSV;
  throw LocalError("the format is not known", "--out", path, "a name that ends in .h5, .hdf5 or .csv",
                   "an .mcap file is what `get` fetches");
}

/// What is fetched is MCAP, whatever the name.
void refuse_all_but_mcap(const std::string& path, v1::RecordingKind kind) {
  const std::string ending = std::filesystem::path(path).extension().string();
  for (const char* other : {".h5", ".hdf5", ".hdf", ".csv"}) {
    if (ending != other) continue;
    throw LocalError("files are fetched as MCAP only", "--out", path, "a name that ends in .mcap",
                     "for HDF5 and CSV: hapticctl " + command_of(kind) + " export");
  }
}

/// Name of a file; the daemon may have given the id, so it must not lead to another folder.
std::string file_name(const std::string& id) {
  if (id.empty() || id.starts_with('.') || id.find('/') != std::string::npos || printable(id) != id) {
    throw LocalError("the id cannot be the name of a file", "ID", id, "an id without '/'",
                     "name the file with --out");
  }
  return id + ".mcap";
}

void fetch_to(client::RecordingStream stream, const std::string& path, const Session& session) {
  const bool replaces = is_replaced(path);
  const std::uint64_t bytes = download(std::move(stream), path);
  if (session.json) return print_json({{"file", path}, {"bytes", bytes}, {"replaced", replaces}});
  print_line("{}: {}{}", path, size_words(bytes), replaced_words(replaces));
}

}  // namespace

std::string file_id(client::Client& client, const std::string& id, v1::RecordingKind kind) {
  if (id != "last") return id;
  const v1::ListRecordingsResponse list = client.recordings(kind);
  if (list.recordings().empty()) {
    throw LocalError("there is none yet", command_of(kind), "", "",
                     "see hapticctl " + command_of(kind) + " list");
  }
  return list.recordings(list.recordings_size() - 1).id();
}

void add_list_command(CLI::App& parent, Session& session, v1::RecordingKind kind, const std::string& name) {
  CLI::App* list = parent.add_subcommand("list", "All " + name + "s that the daemon keeps, oldest first");
  list->footer("Example:\n  hapticctl " + command_of(kind) + " list");
  list->callback([&session, kind, name] {
    const v1::ListRecordingsResponse all = session.connect().recordings(kind);
    if (session.json) return print_json(to_json(all));
    if (all.recordings().empty()) {
      print_line("no {}s in {}", name, all.folder());
      return;
    }
    const auto lines = kind == v1::RECORDING_KIND_INCIDENT ? incident_table(all, Terminal::detect())
                                                           : recording_table(all, Terminal::detect());
    for (const std::string& line : lines) print_line(line);
    print_line("in {}", all.folder());
  });
}

void add_get_command(CLI::App& parent, Session& session, v1::RecordingKind kind, const std::string& name) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App* get = parent.add_subcommand("get", "Fetches the file of a " + name + " (MCAP)");
  get->footer("An existing file is replaced.\n\nExamples:\n  hapticctl " + command_of(kind) +
              " get last\n  hapticctl " + command_of(kind) +
              " get 00012_20261124T005200Z_press --out press.mcap");
  get->add_option("ID", options->id, kIdHelp)->required();
  get->add_option("-o,--out", options->out, "Where to write [ID.mcap]");
  get->callback([&session, options, kind] {
    refuse_all_but_mcap(options->out, kind);
    client::Client client = session.connect();
    v1::GetRecordingRequest request;
    request.set_id(file_id(client, options->id, kind));
    request.set_kind(kind);
    const std::string out = options->out.empty() ? file_name(request.id()) : options->out;
    fetch_to(client.get_recording(request), out, session);
  });
}

void add_export_command(CLI::App& parent, Session& session, v1::RecordingKind kind, const std::string& name) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App* command = parent.add_subcommand("export", "A " + name + " as HDF5 or CSV, with units");
  const std::string call = "  hapticctl " + command_of(kind) + " export last --out ";
  command->footer("An existing file is replaced.\n\nExamples:\n" + call + "press.h5\n" + call +
                  "press.csv --columns contact_reaction_force_n,deformation_displacement_mm --from 1 --to 3");
  command->add_option("ID", options->id, kIdHelp)->required();
  command->add_option("-o,--out", options->out, "Where to write: .h5, .hdf5 or .csv")->required();
  command->add_option("--columns", options->columns, "Names, separated by commas [all]");
  command->add_option("--from", options->from_s, "Seconds after the first row")->capture_default_str();
  command->add_option("--to", options->to_s, "Seconds after the first row; 0 = to the end")
      ->capture_default_str();
  command->add_option("--decimation", options->decimation, "Every n-th row")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  command->callback([&session, options, kind] {
    v1::ExportRecordingRequest request;
    request.set_format(format_of(options->out));
    client::Client client = session.connect();
    request.set_id(file_id(client, options->id, kind));
    request.set_kind(kind);
    std::istringstream names(options->columns);
    for (std::string one; std::getline(names, one, ',');) request.add_columns(one);
    request.set_from_s(options->from_s);
    request.set_to_s(options->to_s);
    request.set_decimation(options->decimation);
    fetch_to(client.export_recording(request), options->out, session);
  });
}

void add_delete_command(CLI::App& parent, Session& session, v1::RecordingKind kind, const std::string& name) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App* command = parent.add_subcommand("delete", "Deletes a " + name + " for good");
  command->footer("Example:\n  hapticctl " + command_of(kind) + " delete 00012_20261124T005200Z_press");
  command->add_option("ID", options->id, kIdHelp)->required();
  command->callback([&session, options, kind] {
    client::Client client = session.connect();
    v1::DeleteRecordingRequest request;
    request.set_id(file_id(client, options->id, kind));
    request.set_kind(kind);
    const v1::RecordingFile file = client.delete_recording(request);
    if (session.json) return print_json(to_json(file));
    print_line("deleted {}", recording_line(file));
  });
}

}  // namespace hapticd::cli
