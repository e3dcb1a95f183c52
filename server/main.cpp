#include <pthread.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>

#include "proto/text/utf8_text.h"
#include "rt/loop/loop_cpu.h"
#include "server/command_line.h"
#include "server/config/config.h"
#include "server/daemon.h"
#include "server/model/store/default_model_store.h"
#include "server/process/crash_guard.h"
#include "server/process/end_limit.h"
#include "server/process/ending_signals.h"
#include "server/process/log.h"
#include "server/process/memory_budget.h"
#include "server/process/service_manager.h"
#include "server/process/standard_streams.h"
#include "server/stop/stop_memory.h"

namespace {

using namespace hapticd;
using server::ExitCode;

int fail(ExitCode code, const hal::Error& error) {
  std::fprintf(stderr, "hapticd: %s\n", text::printable(error.text()).c_str());
  return static_cast<int>(code);
}

/// Raises the limit of descriptors, one for each connection: as many as the system allows.
void raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == limit.rlim_max) return;
  limit.rlim_cur = limit.rlim_max;
  if (setrlimit(RLIMIT_NOFILE, &limit) != 0)
    server::log_warning("the limit of open files could not be raised");
}

/// Time for the network to end, which usually takes one second at most.
constexpr std::chrono::seconds kNetworkEnd{3};

/// Descriptors that the thread that stops needs at least, to wait for its connections.
constexpr rlim_t kMinDescriptors = 256;

std::optional<hal::Error> check_descriptors() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= kMinDescriptors) return std::nullopt;
  return hal::Error{"this process may open too few files and connections", "RLIMIT_NOFILE",
                    std::to_string(limit.rlim_cur), "at least " + std::to_string(kMinDescriptors),
                    "ulimit -n 4096, or LimitNOFILE=4096 in the service's unit"};
}

/// The stacks of all threads that calls may use, and the reserve of the allocator for each: address space,
/// not memory. With less a thread cannot start, and then gRPC aborts the process, even in contact.
constexpr rlim_t kMinAddressSpace = rlim_t{2048} << 20U;

std::optional<hal::Error> check_address_space() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY ||
      limit.rlim_cur >= kMinAddressSpace) {
    return std::nullopt;
  }
  return hal::Error{"the address space of this process is limited too far", "RLIMIT_AS",
                    std::to_string(limit.rlim_cur >> 20U) + " MiB",
                    "at least " + std::to_string(kMinAddressSpace >> 20U) + " MiB",
                    "ulimit -v unlimited, or LimitAS=infinity in the service's unit"};
}

/// Lets user and group read what it writes: recordings, incidents, the store of models. A stricter mask
/// stays.
void write_for_own_group() {
  const mode_t given = umask(0077);
  umask(given | 0027);
}

int run(int argc, char** argv) {
  write_for_own_group();
  int exit_code = 0;
  const auto line = server::read_command_line(argc, argv, exit_code);
  if (!line) return exit_code;

  auto config = line->config_file.empty() ? hal::Result<server::DaemonConfig>(server::DaemonConfig{})
                                          : server::read_config(line->config_file);
  if (config) config = server::override_config(*config, line->overrides);
  if (!config) return fail(ExitCode::kBadConfiguration, config.error());

  if (!config->model_store) config->model_store = server::default_model_store();
  config->state_folder = server::state_directory();
  if (line->check_config) {
    if (const auto failure = server::Daemon::check(*config)) return fail(failure->code, failure->error);
    std::fputs(server::write_config(*config).c_str(), stdout);
    return static_cast<int>(ExitCode::kClean);
  }

  // Next to the models; if these are in memory, nothing is written.
  if (config->recording.folder.empty() && config->model_store != ":memory:") {
    config->recording.folder = !config->state_folder.empty()
                                   ? config->state_folder
                                   : std::filesystem::path(*config->model_store).parent_path().string();
  }
  if (const auto failure = check_address_space()) {
    std::fprintf(stderr, "hapticd: %s\n", failure->text().c_str());
    return 1;
  }
  server::set_memory_budget();
  server::hold_back_ending_signals();  // before there are threads: they inherit it
  server::install_crash_handlers();
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error of its writer, not the end
  // Comes before the first line of the log, which has its own thread.
  if (const std::string why = rt::leave_to_the_loop(config->loop.cpu); !why.empty()) {
    server::log_warning("threads of the service may run on the loop's CPU: " + why);
  }
  if (config->listen_tls && !server::has_separate_stop_memory()) {
    server::log_warning("stops with certificates share their memory with the service");
  }
  raise_descriptor_limit();
  if (const auto failure = check_descriptors()) {
    std::fprintf(stderr, "hapticd: %s\n", failure->text().c_str());
    return 1;
  }
  server::StartFailure failure;
  const auto daemon = server::Daemon::start(*config, failure);
  if (!daemon) return fail(failure.code, failure.error);
  // For scripts and people: the one line on standard output.
  const std::string address = server::ListenAddress{config->listen.host, daemon->port()}.text();
  server::write_if_ready(STDOUT_FILENO, "hapticd listens on " + address + "\n");
  // Waits, if the service manager's queue is full: not in the thread that waits for signals.
  std::thread([address] {
    pthread_setname_np(pthread_self(), "notify");
    server::notify_ready("serves " + address);
  }).detach();

  server::log_info(server::name_of_signal(server::await_ending_signal()) + ": shutting down");
  daemon->stop();
  server::end_within(kNetworkEnd);
  server::notify_stopping();
  daemon->shutdown();
  return static_cast<int>(ExitCode::kClean);
}

}  // namespace

int main(int argc, char** argv) {
  hapticd::server::open_standard_streams();  // before anything is opened
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {  // out of memory, out of threads
    std::fprintf(stderr,
                 "hapticd: the system refuses memory or threads (%s); see its limits: ulimit -v, ulimit -u\n",
                 error.what());
    return 1;
  }
}
