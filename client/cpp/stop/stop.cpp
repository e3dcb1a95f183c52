#include "client/cpp/stop/stop.h"

#include <grpcpp/grpcpp.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <exception>
#include <memory>
#include <optional>
#include <system_error>
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
  std::shared_ptr<grpc::ClientContext> call GUARDED_BY(mutex);  ///< null: has not begun

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
  /// Waits a moment for the end of the call's thread. One that gRPC keeps is left behind.
  void leave(std::thread& by_call) {
    const auto until = std::chrono::steady_clock::now() + kGrace;
    MutexLock lock(mutex);
    while (!service.is_over && changed.wait_until(mutex, until)) {
    }
    const bool is_over = service.is_over;
    lock.unlock();
    is_over ? by_call.join() : by_call.detach();
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

[[noreturn]] void fail_without_thread() {
  v1::ErrorDetail detail;
  detail.set_what("this user may start no further thread");
  detail.set_remedy("end programs, or raise the limit: ulimit -u");
  throw Error(ErrorKind::kUnreachable, "", detail);
}

v1::StopResponse stop_by_call(Race& race, const ChannelSource& channel, const ClientOptions& options,
                              const std::string& reason) {
  const auto stub = v1::SafetyService::NewStub(channel());
  const auto context = std::make_shared<grpc::ClientContext>();
  context->set_deadline(std::chrono::system_clock::now() + options.timeout);
  {
    const MutexLock lock(race.mutex);
    race.call = context;
  }
  v1::StopRequest request;
  request.set_reason(reason.substr(0, kMaxStopReason));
  v1::StopResponse answer;
  const grpc::Status status = stub->Stop(context.get(), request, &answer);
  {
    // The context is destroyed in this thread as well, because that may wait for ever.
    const MutexLock lock(race.mutex);
    race.call.reset();
  }
  if (status.ok()) return answer;
  throw error_from_status(static_cast<int>(status.error_code()), status.error_message(),
                          status.error_details(), options.address);
}

}  // namespace

StopOutcome stop_by_both(const ClientOptions& options, const ChannelSource& channel,
                         const std::string& reason) {
  const auto began = std::chrono::steady_clock::now();
  const auto race = std::make_shared<Race>();
  const int cancelled = eventfd(0, EFD_CLOEXEC);
  const auto ask_port = [&] {
    race->follow(&Race::port, [&] {
      v1::StopResponse answer;
      answer.set_guard_state(v1::GUARD_STATE_LATCHED);
      answer.set_guard_fault(v1::GUARD_FAULT_STOPPED);
      answer.set_latched_after_tick(
          stop_by_stop_port(options.address, options.certificates, options.timeout, cancelled));
      return answer;
    });
  };
  // Before anything of gRPC, which waits for ever where it can start no thread.
  std::thread by_port;
  std::thread by_call;
  try {
    by_port = run_ahead([&] {
      pthread_setname_np(pthread_self(), "stop-port");
      ask_port();
    });
  } catch (const std::system_error&) {
    ask_port();
  }
  try {
    by_call = std::thread([race, channel, options, reason] {
      pthread_setname_np(pthread_self(), "stop-call");
      race->follow(&Race::service, [&] { return stop_by_call(*race, channel, options, reason); });
    });
  } catch (const std::system_error&) {
    race->follow(&Race::service, []() -> v1::StopResponse { fail_without_thread(); });
  }
  StopOutcome outcome;
  Path port;
  Path called;
  {
    const MutexLock lock(race->mutex);
    while (!race->port.answer && !race->service.answer && !(race->port.is_over && race->service.is_over)) {
      race->changed.wait(race->mutex);
    }
    const auto until = std::chrono::steady_clock::now() + kGrace;
    while (!(race->port.is_over && race->service.is_over) && race->changed.wait_until(race->mutex, until)) {
    }
    port = race->port;
    called = race->service;
    if (race->call) race->call->TryCancel();
  }
  eventfd_write(cancelled, 1);
  if (by_port.joinable()) by_port.join();
  close(cancelled);
  if (by_call.joinable()) race->leave(by_call);
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
  return stop_by_both(
      options, [options] { return make_channel(options); }, reason);
}

}  // namespace hapticd::client
