#include "client/cli/plot/recording_table.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "client/cli/plot/temporary_csv.h"
#include "client/cli/session/own_program.h"
#include "client/cli/session/session.h"
#include "proto/text/json_depth.h"

extern char** environ;

namespace hapticd::cli {

namespace {

constexpr const char* kExport = "hapticd-export";
constexpr int kNotFound = 127;
constexpr std::size_t kMaxWords = std::size_t{1} << 16U;

/// Whether the file is one that hapticd-export reads, by the bytes that it begins with.
bool is_exported(const std::string& path) {
  constexpr std::string_view kMcap = "\x89MCAP0\r\n";
  constexpr std::string_view kHdf5 = "\x89HDF\r\n\x1a\n";
  std::array<char, 8> begin{};
  std::ifstream(path, std::ios::binary).read(begin.data(), begin.size());
  const std::string_view seen(begin.data(), begin.size());
  return seen == kMcap || seen == kHdf5;
}

std::string read_all(int descriptor) {
  std::string text;
  std::array<char, 4096> piece{};
  for (ssize_t count = 0; (count = read(descriptor, piece.data(), piece.size())) > 0;) {
    if (text.size() < kMaxWords) text.append(piece.data(), static_cast<std::size_t>(count));
  }
  return text;
}

/// Runs the program; returns its exit code, or kNotFound. `words` gets what it wrote to its standard error.
int run(std::vector<std::string> line, std::string& words) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw LocalError("no pipe can be made", kExport, std::strerror(errno));
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
  pid_t child = 0;
  std::vector<char*> arguments = argument_pointers(line);
  const int failure = posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  if (failure == 0) words = read_all(ends[0]);
  close(ends[0]);
  if (failure != 0) return kNotFound;
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// The program's own refusal, or that it failed.
LocalError refusal_of(const std::string& words, const std::string& path) {
  const Json parts = text::is_shallow_json(words) ? Json::parse(words, nullptr, false) : Json();
  if (!parts.is_object()) return LocalError("hapticd-export failed", path, words.substr(0, 200));
  return LocalError(parts.value("what", ""), parts.value("where", path), parts.value("value", ""),
                    parts.value("limit", ""), parts.value("remedy", ""));
}

}  // namespace

CsvTable read_recording(const std::string& path) {
  if (!is_exported(path)) return CsvTable::read(path);
  const TemporaryCsv csv;
  std::string words;
  const int code = run({own_program(kExport), path, "--out", csv.path(), "--json-errors"}, words);
  if (code == kNotFound) {
    throw LocalError("this recording is read by a program that is not installed", path, kExport, "",
                     "install it with hapticctl, or draw the recording as CSV: hapticctl record export last "
                     "--out press.csv");
  }
  if (code != 0) throw refusal_of(words, path);
  return CsvTable::read(csv.path(), path);
}

}  // namespace hapticd::cli
