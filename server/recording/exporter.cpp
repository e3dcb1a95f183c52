#include "server/recording/exporter.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

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

/// Next to the daemon's own program.
std::string program_path() {
  std::error_code failure;
  const fs::path self = fs::read_symlink("/proc/self/exe", failure);
  return failure ? std::string() : (self.parent_path() / kProgram).string();
}

Refusal cannot_export(const std::string& what, const std::string& value, const std::string& remedy) {
  return {RefusalKind::kInternal, {what, kProgram, value, "", remedy}};
}

/// What the program said on its way out.
Refusal refusal_of(const std::string& words, int status) {
  if (WIFEXITED(status) && WEXITSTATUS(status) == kRefused) {
    const auto json = nlohmann::json::parse(words, nullptr, false);
    if (json.is_object()) {
      return {RefusalKind::kInvalidArgument,
              {json.value("what", ""), json.value("where", ""), json.value("value", ""),
               json.value("limit", ""), json.value("remedy", "")}};
    }
  }
  const std::string end = WIFSIGNALED(status) ? fmt::format("ended by signal {}", WTERMSIG(status))
                                              : fmt::format("exit code {}", WEXITSTATUS(status));
  return cannot_export("the export failed", end + ": " + shortened(repaired_utf8(words), 500), "");
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
  /// Reads what it says until it ends; false where the caller left.
  bool await(const Caller& caller, std::string& said, int& status) {
    for (;;) {
      if (caller.cancelled() || Caller::Clock::now() > caller.deadline) return false;
      pollfd wait{words_, POLLIN, 0};
      if (poll(&wait, 1, kPollMs) <= 0) continue;
      char bytes[4096];
      const ssize_t got = read(words_, bytes, sizeof bytes);
      if (got > 0 && said.size() < kMaxWords) said.append(bytes, static_cast<std::size_t>(got));
      if (got == 0) break;
    }
    ended_ = waitpid(pid_, &status, 0) == pid_;
    return true;
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
                                          const ExportOrder& order, const Caller& caller) {
  static std::atomic<std::uint64_t> count{0};
  TemporaryExport table(fmt::format("{}/export-{}-{}.part", folder, getpid(), ++count));
  std::vector<std::string> words{program_path(), recording,    "--out",        table.path(),
                                 "--format",     order.format, "--json-errors"};
  words.insert(words.end(), {"--from", toml_number(order.from_s), "--to", toml_number(order.to_s),
                             "--decimation", std::to_string(order.decimation)});
  for (const std::string& column : order.columns) words.push_back("--columns=" + column);
  ExportProcess process(words);
  if (process.failure() != 0) {
    return cannot_export("the program that exports cannot be started", std::strerror(process.failure()),
                         "install it next to hapticd: " + words[0]);
  }
  std::string said;
  int status = 0;
  if (!process.await(caller, said, status)) {
    return Refusal{RefusalKind::kCancelled,
                   {"the client left, or its deadline is over", "export", "", "", ""}};
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    Refusal refusal = refusal_of(said, status);
    // Its owner knows it by its id.
    if (const std::size_t at = refusal.error.where.find(recording); at != std::string::npos) {
      refusal.error.where.replace(at, recording.size(), fs::path(recording).stem().string());
    }
    return refusal;
  }
  return table;
}

}  // namespace hapticd::server
