#include <fmt/core.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/commands/commands.h"
#include "client/cli/session/interrupt.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"
#include "client/cli/view/lease_view.h"

namespace hapticd::cli {

namespace {

struct HoldOptions {
  std::string purpose;
  std::string take;
  std::string on_expiry;
  double ttl_s = 5.0;
  std::vector<std::string> command;
};

void show(const v1::LeaseState& state, const Session& session) {
  if (session.json) return print_json_line(to_json(state));
  print_line(lease_words(state));
  std::fflush(stdout);
}

void watch(Session& session) {
  catch_interrupts();
  client::Client client = session.connect();
  client::LeaseStream stream = client.watch_lease();
  v1::LeaseState state;
  while (!interrupted()) {
    const auto event = stream.next(state, std::chrono::milliseconds(100));
    if (event == client::LeaseStream::Event::kEnded) return;
    if (event == client::LeaseStream::Event::kMessage) show(state, session);
  }
}

v1::LeaseExpiry expiry_of(const std::string& text) {
  if (text == "keep") return v1::LEASE_EXPIRY_KEEP;
  if (text == "ramp_to_zero") return v1::LEASE_EXPIRY_RAMP_TO_ZERO;
  return text == "stop" ? v1::LEASE_EXPIRY_STOP : v1::LEASE_EXPIRY_UNSPECIFIED;
}

template <class Request>
Request request_of(const HoldOptions& options) {
  Request request;
  request.set_purpose(options.purpose);
  request.set_ttl_s(options.ttl_s);
  request.set_on_expiry(expiry_of(options.on_expiry));
  return request;
}

v1::LeaseGrant get_lease(client::Client& client, const HoldOptions& options) {
  if (options.take.empty()) return client.acquire_lease(request_of<v1::AcquireLeaseRequest>(options));
  auto request = request_of<v1::TakeLeaseRequest>(options);
  request.set_reason(options.take);
  return client.take_lease(request);
}

/// Words of the program, or a shell of the user.
std::vector<char*> words_of(HoldOptions& options) {
  if (options.command.empty()) {
    const char* shell = std::getenv("SHELL");
    options.command.emplace_back(shell == nullptr ? "/bin/sh" : shell);
  }
  std::vector<char*> words;
  for (std::string& word : options.command) words.push_back(word.data());
  words.push_back(nullptr);
  return words;
}

/// What is known of the lease while a program runs under it.
class HeldLease {
 public:
  HeldLease(client::Client& client, std::uint64_t number)
      : client_(client), number_(number), changes_(client.watch_lease()) {}

  /// Waits a moment; reports on standard error when the lease is about to be taken, or is over.
  void look() {
    if (lost_) {
      usleep(50'000);
      return;
    }
    if (heard(std::chrono::milliseconds(50)) || client_.holds_lease()) return;
    // What the daemon says about it may be on its way.
    if (heard(std::chrono::seconds(1))) return;
    lose(ExitCode::kUnreachable, client_.address() + " did not answer for the lease's time to live");
  }

  /// Exit code of a lease that is over.
  std::optional<ExitCode> lost() const { return lost_; }

 private:
  /// True if the daemon said something, or is lost.
  bool heard(std::chrono::milliseconds wait) {
    v1::LeaseState state;
    try {
      const auto event = changes_.next(state, wait);
      if (event == client::LeaseStream::Event::kNothing) return false;
      if (event == client::LeaseStream::Event::kEnded) {
        lose(ExitCode::kUnreachable, "the daemon ended");
      } else {
        note(state);
      }
    } catch (const client::Error& error) {
      lose(ExitCode::kUnreachable, error.what());
    }
    return true;
  }
  void lose(ExitCode code, const std::string& why) {
    lost_ = code;
    print_error_line("hapticctl: the lease is over: {}", why);
  }
  void note(const v1::LeaseState& state) {
    if (state.number() != number_) {
      lose(ExitCode::kRefused, fmt::format("{} by {}{}", word(state.change()), state.changed_by(),
                                           state.reason().empty() ? "" : ": " + state.reason()));
    } else if (!state.taker().empty()) {
      print_error_line("hapticctl: {} takes the lease in {:.1f} s: {}", state.taker(), state.taken_in_s(),
                       state.take_reason());
    }
  }

  client::Client& client_;
  const std::uint64_t number_;
  client::LeaseStream changes_;
  std::optional<ExitCode> lost_;
};

/// Runs a program under the lease. If the daemon is lost the program is asked to end (SIGTERM), as it could
/// only wait for answers; a shell goes on. If another client has the lease, the program hears it itself.
int run_under(client::Client& client, std::uint64_t number, HoldOptions& options) {
  const bool is_shell = options.command.empty();
  const std::vector<char*> words = words_of(options);
  HeldLease lease(client, number);
  const pid_t child = fork();
  if (child == 0) {
    execvp(words.front(), words.data());
    print_error_line("hapticctl: {}: {}", words.front(), std::strerror(errno));
    _exit(127);
  }
  if (child < 0) throw LocalError(std::string("no program can be started: ") + std::strerror(errno));
  int status = 0;
  bool asked_to_end = is_shell;
  while (waitpid(child, &status, WNOHANG) == 0) {
    lease.look();
    if (asked_to_end || lease.lost() != ExitCode::kUnreachable) continue;
    print_error_line("hapticctl: {} is asked to end: it has no lease any more", words.front());
    kill(child, SIGTERM);
    asked_to_end = true;
  }
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  const bool was_ended = lease.lost() == ExitCode::kUnreachable && !is_shell;
  // A 0 would say that all of it ran under the lease.
  return lease.lost() && (code == 0 || was_ended) ? static_cast<int>(*lease.lost()) : code;
}

void hold(Session& session, HoldOptions& options) {
  Session own = session;
  own.lease_token.clear();
  client::Client client = own.connect();
  const v1::LeaseGrant grant = get_lease(client, options);
  if (!session.json) {
    print_error_line("hapticctl: lease {} is yours until this program ends", grant.lease().number());
  }
  // The programs that run now find it there.
  setenv("HAPTICD_LEASE", grant.token().c_str(), 1);
  setenv("HAPTICD_SERVER", session.server.c_str(), 1);
  const int code = run_under(client, grant.lease().number(), options);
  client.return_lease();
  if (code != 0) session.exit_code = static_cast<ExitCode>(code);
}

}  // namespace

void add_lease_commands(CLI::App& app, Session& session) {
  CLI::App* lease = app.add_subcommand("lease", "Exclusive control of the rig");
  lease->require_subcommand(1);
  CLI::App* get = lease->add_subcommand("get", "Who controls the rig");
  get->footer("Example:\n  hapticctl lease get");
  get->callback([&session] { show(session.connect().lease(), session); });

  CLI::App* watching = lease->add_subcommand("watch", "The same, and every change, until Ctrl-C");
  watching->footer("Example:\n  hapticctl lease watch");
  watching->callback([&session] { watch(session); });

  const auto options = std::make_shared<HoldOptions>();
  CLI::App* holding =
      lease->add_subcommand("hold", "Acquires the lease, runs a program under it, and returns it");
  holding->footer(
      "Examples:\n"
      "  hapticctl lease hold                                  a shell: its commands control the rig\n"
      "  hapticctl lease hold --purpose \"subject 7\" -- ./experiment.sh\n"
      "  hapticctl lease hold --take \"needed for the demo\"     from its holder, who is informed first\n\n"
      "The exit code is the program's; where it is 0 and the lease was lost meanwhile: 1 by another client, "
      "3 with "
      "the daemon.\nWith the daemon lost, the program is asked to end (SIGTERM), a shell is not.");
  // The "--" before PROGRAM is taken for the text if that was forgotten.
  const auto is_text = [](const std::string& value) { return std::string(value == "--" ? "no text" : ""); };
  holding->add_option("--purpose", options->purpose, "What for; others see it")
      ->check(is_text)
      ->type_name("TEXT");
  holding->add_option("--take", options->take, "Take it from its holder, for this reason")
      ->check(is_text)
      ->type_name("WHY");
  holding->add_option("--ttl", options->ttl_s, "Seconds until it expires if this program is stopped or lost")
      ->check(CLI::Range(1.0, 60.0))
      ->capture_default_str();
  holding
      ->add_option("--on-expiry", options->on_expiry,
                   "Then: keep, ramp_to_zero or stop [keep on this machine, ramp_to_zero from others]")
      ->check(CLI::IsMember({"keep", "ramp_to_zero", "stop"}));
  holding->add_option("PROGRAM", options->command, "With its arguments; without one, your shell");
  holding->callback([&session, options] { hold(session, *options); });
}

}  // namespace hapticd::cli
