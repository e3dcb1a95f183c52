#include <fcntl.h>
#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <spdlog/async.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/syscall.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <thread>

#include "client/console/console_server.h"
#include "client/console/options.h"

namespace {

using namespace hapticd;

/// Lines of the log that may wait for a reader; beyond that the oldest are dropped.
constexpr std::size_t kMaxLogLines = 1024;
/// Time in which the log is written when the console ends, and between two looks whether it is.
constexpr std::chrono::seconds kEndWithin{3};
constexpr std::chrono::milliseconds kLooks{10};

/// Lets go of the terminal or program that waits, once all it waits for has been said: a program that goes on
/// in the background holds no pipe open.
void let_go_of_terminal() {
  const int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
  for (const int standard : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(nothing, standard);
  close(nothing);
}

/// Waits until the lines of the log are written. Ends the process if they are not read.
void end_log() {
  spdlog::default_logger()->flush();  // a last entry: when it has been taken, all before it are written
  const auto until = std::chrono::steady_clock::now() + kEndWithin;
  while (spdlog::thread_pool()->queue_size() > 0) {
    // Not by _exit(): a sanitizer's flushes what is not read.
    if (std::chrono::steady_clock::now() > until) syscall(SYS_exit_group, 0);
    std::this_thread::sleep_for(kLooks);
  }
}

int run(int argc, char** argv) {
  int exit_code = 0;
  const auto options = console::read_options(argc, argv, exit_code);
  if (!options) return exit_code;
  // A thread writes the lines: a reader that does not read (a terminal, a pipe) must hold up no page.
  spdlog::init_thread_pool(kMaxLogLines, 1);
  spdlog::set_default_logger(spdlog::create_async_nb<spdlog::sinks::stderr_sink_mt>("hapticd-console"));
  spdlog::set_pattern("[%Y-%m-%d %H:%M:%S.%e] %l: %v");
  // What a page or a daemon sends must not fill the log.
  google::protobuf::SetLogHandler(nullptr);
  gpr_set_log_verbosity(GPR_LOG_SEVERITY_ERROR);
  std::signal(SIGPIPE, SIG_IGN);
  console::ConsoleServer server(*options);
  server.run([&] {
    // For scripts and people: the one line on standard output.
    std::printf("hapticd-console listens on %s\n", server.url().c_str());
    std::fflush(stdout);
    if (options->is_personal) return let_go_of_terminal();
    sd_notifyf(0, "READY=1\nSTATUS=serves %s", server.url().c_str());
  });
  sd_notify(0, "STOPPING=1");
  end_log();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hapticd-console: %s\n", error.what());
    return 3;
  }
}
