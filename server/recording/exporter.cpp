#include "server/recording/exporter.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "hal/recording/free_disk.h"
#include "proto/text/json_depth.h"
#include "server/text/toml_text.h"
#include "server/text/utf8_text.h"

extern char** environ;

namespace hapticd::server {

namespace {

namespace fs = std::filesystem;
constexpr const char* kProgram = "hapticd-export";
constexpr int kPollMs = 50;
constexpr int kRefused = 2;
constexpr std::size_t kMaxWords = std::size_t{1} << 16U;

/// Path of the program, next to the daemon's own.
std::string program_path() {
  std::error_code failure;
  const fs::path self = fs::read_symlink("/proc/self/exe", failure);
  return failure ? std::string() : (self.parent_path() / kProgram).string();
}

Refusal cannot_export(const std::string& what, const std::string& value, const std::string& remedy) {
  return {RefusalKind::kInternal, {what, kProgram, value, "", remedy}};
}

/// Refusal with what the program said on its way out.
Refusal refusal_of(const std::string& words, int status) {
  if (WIFEXITED(status) && WEXITSTATUS(status) == kRefused) {
    const auto json =
        text::is_shallow_json(words) ? nlohmann::json::parse(words, nullptr, false) : nlohmann::json();
    if (json.is_object()) {
      hal::Error error{json.value("what", ""), json.value("where", ""), json.value("value", ""),
                       json.value("limit", ""), json.value("remedy", "")};
      if (json.value("is_full", false)) {
        return {RefusalKind::kResourceExhausted, std::move(error), Reason::kDiskFull};
      }
      return {RefusalKind::kInvalidArgument, std::move(error)};
    }
  }
  const std::string end = WIFSIGNALED(status) ? fmt::format("ended by signal {}", WTERMSIG(status))
                                              : fmt::format("exit code {}", WEXITSTATUS(status));
  return cannot_export("the export failed", end + ": " + shortened(repaired_utf8(words), 500), "");
}

constexpr std::size_t kMaxExportedColumns = 1000;
constexpr std::size_t kMaxColumnName = 200;

Refusal no_room(double keep_free_mb) {
  return {RefusalKind::kResourceExhausted,
          hal::Error::of(
              hal::ErrorCode::kFull, "the disk has no room for the export", "export", "",
              fmt::format("{:g} MB stay free: twice [recording] keep_free_mb", kRoomFactor * keep_free_mb),
              "export fewer columns or a shorter span, fetch the recording as it is and use "
              "hapticd-export, or make room"),
          Reason::kDiskFull};
}

/// Checks the columns: they are arguments of a program, whose number the kernel limits.
std::optional<Refusal> check_columns(const ExportOrder& order) {
  const auto refused = [](const char* what, std::size_t value, const std::string& limit) {
    return Refusal{RefusalKind::kInvalidArgument,
                   hal::Error::of(hal::ErrorCode::kTooLong, what, "ExportRecordingRequest.columns",
                                  std::to_string(value), limit, "name no column to export all")};
  };
  if (order.columns.size() > kMaxExportedColumns) {
    return refused("too many columns", order.columns.size(), fmt::format("at most {}", kMaxExportedColumns));
  }
  for (const std::string& column : order.columns) {
    if (column.size() > kMaxColumnName) {
      return refused("the name of a column is too long", column.size(),
                     fmt::format("at most {} bytes", kMaxColumnName));
    }
  }
  return std::nullopt;
}

void replace(std::string& text, const std::string& what, const std::string& by) {
  if (const std::size_t at = text.find(what); at != std::string::npos) text.replace(at, what.size(), by);
}

class ExportProcess {
 public:
  explicit ExportProcess(std::vector<std::string> words) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) return;
    words_ = ends[0];
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&files, ends[1], STDERR_FILENO);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t none;
    sigemptyset(&none);
    posix_spawnattr_setsigmask(&attributes, &none);  // the daemon holds back what ends it
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
    failure_ = posix_spawn(&pid_, arguments[0], &files, &attributes, arguments.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
    close(ends[1]);
  }
  ~ExportProcess() {
    if (words_ >= 0) close(words_);
    if (failure_ == 0 && !ended_) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
  }
  ExportProcess(const ExportProcess&) = delete;
  ExportProcess& operator=(const ExportProcess&) = delete;

  int failure() const { return failure_; }
  enum class End { kOver, kLeft, kNoRoom };
  /// Reads what it says until it ends, the caller leaves or `has_room` is no longer true.
  template <class HasRoom>
  End await(const Caller& caller, HasRoom has_room, std::string& said, int& status) {
    for (;;) {
      if (caller.cancelled() || Caller::Clock::now() > caller.deadline) return End::kLeft;
      if (!has_room()) return End::kNoRoom;
      pollfd wait{words_, POLLIN, 0};
      if (poll(&wait, 1, kPollMs) <= 0) continue;
      char bytes[4096];
      const ssize_t got = read(words_, bytes, sizeof bytes);
      if (got > 0 && said.size() < kMaxWords) said.append(bytes, static_cast<std::size_t>(got));
      if (got == 0) break;
    }
    ended_ = waitpid(pid_, &status, 0) == pid_;
    return End::kOver;
  }

 private:
  int words_ = -1;
  pid_t pid_ = -1;
  int failure_ = EAGAIN;
  bool ended_ = false;
};

}  // namespace

TemporaryExport::~TemporaryExport() {
  if (!path_.empty()) unlink(path_.c_str());
}

Outcome<TemporaryExport> export_recording(const std::string& recording, const std::string& folder,
                                          double keep_free_mb, const ExportOrder& order,
                                          const Caller& caller) {
  if (auto refusal = check_columns(order)) return *refusal;
  const auto has_room = [&] { return recording::free_disk_mb(folder) >= kRoomFactor * keep_free_mb; };
  if (!has_room()) return no_room(keep_free_mb);
  // Made here: a name that someone else has put there is not written through.
  std::string path = folder + "/export-XXXXXX.part";
  const int made = mkostemps(path.data(), 5, O_CLOEXEC);
  if (made < 0) return cannot_export("no file for the export can be made", std::strerror(errno), "");
  close(made);
  TemporaryExport table(path);
  std::vector<std::string> words{program_path(), recording,    "--out",         table.path(),
                                 "--format",     order.format, "--json-errors", "--refuse-links"};
  words.insert(words.end(), {"--from", toml_number(order.from_s), "--to", toml_number(order.to_s),
                             "--decimation", std::to_string(order.decimation)});
  for (const std::string& column : order.columns) words.push_back("--columns=" + column);
  ExportProcess process(words);
  if (process.failure() != 0) {
    return cannot_export("the program that exports cannot be started", std::strerror(process.failure()),
                         "install it next to hapticd");
  }
  std::string said;
  int status = 0;
  switch (process.await(caller, has_room, said, status)) {
    case ExportProcess::End::kOver:
      break;
    case ExportProcess::End::kLeft:
      return Refusal{RefusalKind::kCancelled,
                     {"the client left, or its deadline is over", "export", "", "", ""}};
    case ExportProcess::End::kNoRoom:
      return no_room(keep_free_mb);
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    Refusal refusal = refusal_of(said, status);
    // Its owner knows it by its id; the folders of this machine do not concern a client.
    for (std::string* part : {&refusal.error.where, &refusal.error.value}) {
      replace(*part, recording, fs::path(recording).stem().string());
      replace(*part, table.path(), "export");
    }
    return refusal;
  }
  return table;
}

}  // namespace hapticd::server
