#include "tests/measure/report/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "tests/support/temporary_folder.h"

namespace hapticd::report {
namespace {

/// Redirections of a child about to start.
class FileActions {
 public:
  FileActions() { posix_spawn_file_actions_init(&actions_); }
  ~FileActions() { posix_spawn_file_actions_destroy(&actions_); }
  FileActions(const FileActions&) = delete;
  FileActions& operator=(const FileActions&) = delete;
  posix_spawn_file_actions_t* get() noexcept { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_{};
};

}  // namespace

ChildProcess::ChildProcess(const Launch& launch) {
  if (launch.command.empty()) throw std::invalid_argument("no program to start");
  std::vector<char*> arguments;
  for (const std::string& argument : launch.command) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);

  const std::string output = launch.output.empty() ? "/dev/null" : launch.output.string();
  FileActions actions;
  posix_spawn_file_actions_addopen(actions.get(), STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(actions.get(), STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                   0644);
  posix_spawn_file_actions_adddup2(actions.get(), STDOUT_FILENO, STDERR_FILENO);
  if (!launch.folder.empty()) posix_spawn_file_actions_addchdir_np(actions.get(), launch.folder.c_str());

  char* no_environment[] = {nullptr};
  const int code = posix_spawnp(&pid_, arguments[0], actions.get(), nullptr, arguments.data(),
                                launch.clear_environment ? no_environment : environ);
  if (code != 0) {
    pid_ = -1;
    throw std::system_error(code, std::generic_category(), "cannot start '" + launch.command.front() + "'");
  }
}

ChildProcess::~ChildProcess() {
  if (pid_ < 0 || wait(std::chrono::milliseconds(0))) return;
  signal(SIGKILL);
  wait(std::chrono::seconds(10));
}

void ChildProcess::signal(int number) noexcept {
  if (pid_ > 0 && !status_) kill(pid_, number);
}

std::optional<int> ChildProcess::wait(std::chrono::milliseconds timeout) noexcept {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (!status_) {
    int raw = 0;
    const pid_t ended = waitpid(pid_, &raw, WNOHANG);
    if (ended == pid_) {
      status_ = WIFEXITED(raw) ? WEXITSTATUS(raw) : 128 + WTERMSIG(raw);
    } else if (ended < 0 && errno != EINTR) {
      status_ = -1;  // someone else reaped it
    } else if (std::chrono::steady_clock::now() >= deadline) {
      return std::nullopt;
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  return status_;
}

ProgramRun run_program(Launch launch, std::chrono::seconds timeout) {
  const test::TemporaryFolder folder;
  launch.output = folder.path("output");
  ProgramRun run;
  try {
    ChildProcess child(launch);
    run.status = child.wait(timeout).value_or(-1);
  } catch (const std::system_error& error) {
    if (error.code() != std::errc::no_such_file_or_directory) throw;
    run.installed = false;
  }
  run.output = test::file_text(launch.output);
  return run;
}

}  // namespace hapticd::report
