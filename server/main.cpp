#include <pthread.h>
#include <signal.h>

#include <cstdio>
#include <exception>
#include <string>

#include "rt/loop/loop_cpu.h"
#include "server/command_line.h"
#include "server/config.h"
#include "server/daemon.h"
#include "server/default_model_store.h"
#include "server/log.h"

namespace {

using namespace hapticd;
using server::ExitCode;

int fail(ExitCode code, const hal::Error& error) {
  std::fprintf(stderr, "hapticd: %s\n", error.text().c_str());
  return static_cast<int>(code);
}

/// SIGTERM and SIGINT are waited for in main() and nowhere else; a client that vanishes in mid-write is no
/// signal.
sigset_t hold_back_signals() {
  sigset_t ending;
  sigemptyset(&ending);
  sigaddset(&ending, SIGTERM);
  sigaddset(&ending, SIGINT);
  pthread_sigmask(SIG_BLOCK, &ending, nullptr);
  signal(SIGPIPE, SIG_IGN);
  return ending;
}

int run(int argc, char** argv) {
  int exit_code = 0;
  const auto line = server::read_command_line(argc, argv, exit_code);
  if (!line) return exit_code;

  auto config = line->config_file.empty() ? hal::Result<server::DaemonConfig>(server::DaemonConfig{})
                                          : server::read_config(line->config_file);
  if (config) config = server::override_config(*config, line->overrides);
  if (!config) return fail(ExitCode::kBadConfiguration, config.error());

  if (!config->model_store) config->model_store = server::default_model_store();
  if (line->check_config) {
    if (const auto failure = server::Daemon::check(*config)) return fail(failure->code, failure->error);
    std::fputs(server::write_config(*config).c_str(), stdout);
    return static_cast<int>(ExitCode::kClean);
  }

  const sigset_t ending = hold_back_signals();  // before there are threads: they inherit it
  if (const std::string why = rt::leave_to_the_loop(config->loop.cpu); !why.empty()) {
    server::log_warning("threads of the service may run on the loop's CPU: " + why);
  }
  server::StartFailure failure;
  const auto daemon = server::Daemon::start(*config, failure);
  if (!daemon) return fail(failure.code, failure.error);
  // For scripts and people: the one line on standard output.
  std::printf("hapticd listens on %s\n",
              server::ListenAddress{config->listen.host, daemon->port()}.text().c_str());
  std::fflush(stdout);

  int signal_number = 0;
  while (sigwait(&ending, &signal_number) != 0) {
  }
  server::log_info(signal_number == SIGTERM ? "SIGTERM: shutting down" : "SIGINT: shutting down");
  daemon->shutdown();
  return static_cast<int>(ExitCode::kClean);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {  // out of memory, out of threads
    std::fprintf(stderr, "hapticd: %s\n", error.what());
    return 1;
  }
}
