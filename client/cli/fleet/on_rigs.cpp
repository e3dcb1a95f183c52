#include "client/cli/fleet/on_rigs.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>
#include <variant>

#include "client/cli/session/print.h"
#include "client/cli/text/report.h"
#include "proto/text/json_depth.h"

extern char** environ;

namespace hapticd::cli {

namespace {

/// Bytes that are kept of a run's output; the rest is read and dropped.
constexpr std::size_t kMaxText = std::size_t{16} << 20U;

/// A run of this program whose whole output is read.
class Run {
 public:
  /// Throws LocalError if it cannot be started.
  explicit Run(std::vector<std::string> arguments) {
    int pipe[2];
    if (pipe2(pipe, O_CLOEXEC) != 0) throw LocalError("no pipe for a command", "", std::strerror(errno));
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, pipe[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, pipe[1], STDERR_FILENO);
    arguments.insert(arguments.begin(), "hapticctl");
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    const int failure = posix_spawn(&pid_, "/proc/self/exe", &actions, nullptr, pointers.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    close(pipe[1]);
    output_ = pipe[0];
    if (failure != 0) {
      close(output_);
      throw LocalError("the command cannot be started", "hapticctl", std::strerror(failure));
    }
    reader_ = std::thread([this] { read_all(); });
  }
  ~Run() {
    if (reader_.joinable()) reader_.join();
    close(output_);
  }
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  /// Waits for its end. The exit code.
  int wait() {
    reader_.join();
    int status = 0;
    waitpid(pid_, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : static_cast<int>(ExitCode::kUsage);
  }
  const std::string& text() const { return text_; }

 private:
  void read_all() {
    std::array<char, 4096> part{};
    for (ssize_t n = 0; (n = read(output_, part.data(), part.size())) > 0;) {
      if (text_.size() < kMaxText) text_.append(part.data(), static_cast<std::size_t>(n));
    }
  }

  pid_t pid_ = -1;
  int output_ = -1;
  std::string text_;
  std::thread reader_;
};

std::vector<std::string> arguments_for(const ListedRig& rig, const std::vector<std::string>& command,
                                       const Session& session) {
  std::vector<std::string> arguments{"--server", rig.server, "--timeout",
                                     fmt::format("{}", session.timeout_s)};
  const std::string& certificates = rig.certificates.empty() ? session.certificates : rig.certificates;
  if (!certificates.empty()) arguments.insert(arguments.end(), {"--certificates", certificates});
  if (session.json) arguments.emplace_back("--json");
  arguments.insert(arguments.end(), command.begin(), command.end());
  return arguments;
}

}  // namespace

void run_on_rigs(const std::vector<ListedRig>& rigs, const std::vector<std::string>& command,
                 Session& session) {
  std::vector<std::variant<std::unique_ptr<Run>, LocalError>> runs;
  for (const ListedRig& rig : rigs) {
    try {
      runs.emplace_back(std::make_unique<Run>(arguments_for(rig, command, session)));
    } catch (const LocalError& error) {  // the rigs behind it must be stopped, too
      runs.emplace_back(error);
    }
  }
  Json answers = Json::object();
  int worst = 0;
  for (std::size_t i = 0; i < rigs.size(); ++i) {
    if (!session.json) {
      if (i > 0) print_line("");
      print_line("{} ({})", Terminal::detect().bold(rigs[i].name), rigs[i].server);
    }
    if (const auto* error = std::get_if<LocalError>(&runs[i])) {
      worst = std::max(worst, static_cast<int>(ExitCode::kUsage));
      if (session.json) {
        answers[rigs[i].name] = to_json(*error);
      } else {
        report(*error, session);
      }
      continue;
    }
    Run& run = *std::get<0>(runs[i]);
    worst = std::max(worst, run.wait());
    if (session.json) {
      const std::string& words = run.text();
      Json answer = text::is_shallow_json(words) ? Json::parse(words, nullptr, false) : Json(words);
      answers[rigs[i].name] = answer.is_discarded() ? Json(words) : std::move(answer);
    } else {
      print_text(run.text());
    }
  }
  if (session.json) print_json(answers);
  session.exit_code = static_cast<ExitCode>(worst);
}

bool run_on_named_rigs(const std::vector<std::string>& command, Session& session) {
  if (session.rigs.empty()) return false;
  const std::string path = rigs_file_path();
  run_on_rigs(choose_rigs(read_rigs(path), session.rigs, path), command, session);
  return true;
}

}  // namespace hapticd::cli
