#include "client/cpp/stop/stop.h"

#include <grpcpp/grpcpp.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <exception>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "client/cpp/channel.h"
#include "client/cpp/error.h"
#include "client/cpp/stop/ahead.h"
#include "client/cpp/stop/both_paths.h"
#include "client/cpp/stop/stop_port.h"
#include "hal/lock/mutex.h"
#include "hapticd/v1/safety.grpc.pb.h"

namespace hapticd::client {
namespace {

/// What the daemon keeps of a reason. Nothing longer is sent: a request may be too large to arrive.
constexpr std::size_t kMaxStopReason = 256;
/// Time for the second answer, after the first.
constexpr std::chrono::milliseconds kGrace{200};

/// One path: under way, answered, or failed.
struct Path {
  bool is_over = false;
  std::optional<v1::StopResponse> answer;
  std::exception_ptr failure;
  std::chrono::steady_clock::time_point at{};
};

struct Race {
  Mutex mutex;
  Condition changed;
  Path port GUARDED_BY(mutex);
  Path service GUARDED_BY(mutex);

  /// Runs one path to its end.
  template <class Run>
  void follow(Path Race::*path, Run&& run) {
    Path end;
    try {
      end.answer = run();
    } catch (...) {
      end.failure = std::current_exception();
    }
    end.at = std::chrono::steady_clock::now();
    end.is_over = true;
    const MutexLock lock(mutex);
    this->*path = std::move(end);
    changed.notify_all();
  }
};

bool was_refused(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const Error& error) {
    return error.kind() == ErrorKind::kRefused;
  } catch (...) {
    return false;
  }
}

std::string words_of(const std::exception_ptr& failure) {
  if (!failure) return {};
  try {
    std::rethrow_exception(failure);
  } catch (const std::exception& error) {
    return error.what();
  }
}

/// Starts a thread that runs ahead of all ordinary ones from its beginning on.
template <class Run>
std::thread run_ahead(Run&& run) {
  const Ahead ahead;
  return std::thread(std::forward<Run>(run));
}

}  // namespace

StopOutcome stop_by_both(const ClientOptions& options, const std::shared_ptr<grpc::Channel>& channel,
                         const std::string& reason) {
  const auto began = std::chrono::steady_clock::now();
  Race race;
  const int cancelled = eventfd(0, EFD_CLOEXEC);
  std::thread by_port = run_ahead([&] {
    pthread_setname_np(pthread_self(), "stop-port");
    race.follow(&Race::port, [&] {
      v1::StopResponse answer;
      answer.set_guard_state(v1::GUARD_STATE_LATCHED);
      answer.set_guard_fault(v1::GUARD_FAULT_STOPPED);
      answer.set_latched_after_tick(
          stop_by_stop_port(options.address, options.certificates, options.timeout, cancelled));
      return answer;
    });
  });
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + options.timeout);
  std::thread by_call([&] {
    pthread_setname_np(pthread_self(), "stop-call");
    race.follow(&Race::service, [&] {
      v1::StopRequest request;
      request.set_reason(reason.substr(0, kMaxStopReason));
      v1::StopResponse answer;
      const grpc::Status status = v1::SafetyService::NewStub(channel)->Stop(&context, request, &answer);
      if (status.ok()) return answer;
      throw error_from_status(static_cast<int>(status.error_code()), status.error_message(),
                              status.error_details(), options.address);
    });
  });
  StopOutcome outcome;
  Path port;
  Path called;
  {
    const MutexLock lock(race.mutex);
    while (!race.port.answer && !race.service.answer && !(race.port.is_over && race.service.is_over)) {
      race.changed.wait(race.mutex);
    }
    const auto until = std::chrono::steady_clock::now() + kGrace;
    while (!(race.port.is_over && race.service.is_over) && race.changed.wait_until(race.mutex, until)) {
    }
    port = race.port;
    called = race.service;
  }
  eventfd_write(cancelled, 1);
  context.TryCancel();
  by_port.join();
  by_call.join();
  close(cancelled);
  if (!port.answer && !called.answer)
    std::rethrow_exception(was_refused(called.failure) ? called.failure : port.failure);
  const bool port_first = port.answer && (!called.answer || port.at <= called.at);
  outcome.first = port_first ? StopPath::kStopPort : StopPath::kService;
  outcome.after = (port_first ? port.at : called.at) - began;
  outcome.answer = called.answer ? *called.answer : *port.answer;
  outcome.both_answered = port.answer && called.answer;
  outcome.problem = words_of(port_first ? called.failure : port.failure);
  return outcome;
}

StopOutcome stop(const ClientOptions& options, const std::string& reason) {
  return stop_by_both(options, make_channel(options), reason);
}

}  // namespace hapticd::client
