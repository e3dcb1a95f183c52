#include "client/console/daemon/stop.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "client/cpp/error.h"
#include "client/cpp/stop/stop_port.h"
#include "hapticd/v1/safety.pb.h"
#include "proto/text/json_depth.h"

namespace hapticd::console {

namespace {

constexpr const char* kStopPath = "/hapticd.v1.SafetyService/Stop";
constexpr std::chrono::seconds kStopTimeout{5};

v1::StopRequest request_of(const StopBody& body) {
  v1::StopRequest request;
  if (body.is_whole && body.text.empty()) return request;
  const bool is_read = body.is_whole && text::is_shallow_json(body.text) &&
                       google::protobuf::util::JsonStringToMessage(std::string(body.text), &request).ok();
  if (is_read) return request;
  request.Clear();
  request.set_reason(body.is_whole
                         ? fmt::format("(the page's request of {} bytes could not be read)", body.text.size())
                         : std::string("(the page's request was not waited for)"));
  return request;
}

std::string answer_by(const char* path, const std::string& response) {
  auto answer = nlohmann::json::parse(RpcBridge::to_json(*v1::StopResponse::descriptor(), response));
  answer["path"] = path;
  return answer.dump();
}

/// Both paths of one stop.
class Race {
 public:
  explicit Race(RpcBridge::Done done) : done_(std::move(done)) {}

  void arrived(std::string json) {
    if (take_first()) done_({200, std::move(json)});
  }
  /// Notes that one path failed. `end`: to be said if the other one fails, too; nothing: the other's is said.
  void failed(std::optional<RpcEnd> end) {
    RpcEnd said;
    {
      const MutexLock lock(mutex_);
      if (end) refusal_ = std::move(*end);
      if (++failed_ < 2) return;
      said = refusal_;
    }
    done_(std::move(said));
  }

 private:
  bool take_first() {
    const MutexLock lock(mutex_);
    return !std::exchange(has_arrived_, true);
  }

  const RpcBridge::Done done_;
  Mutex mutex_;
  bool has_arrived_ GUARDED_BY(mutex_) = false;
  int failed_ GUARDED_BY(mutex_) = 0;
  RpcEnd refusal_ GUARDED_BY(mutex_);
};

}  // namespace

StopPort::StopPort(std::string address, std::string certificates)
    : address_(std::move(address)),
      certificates_(std::move(certificates)),
      cancelled_(eventfd(0, EFD_CLOEXEC)),
      thread_([this] { run(); }) {}

StopPort::~StopPort() {
  {
    const MutexLock lock(mutex_);
    ends_ = true;
    changed_.notify_all();
  }
  eventfd_write(cancelled_, 1);
  thread_.join();
  close(cancelled_);
}

void StopPort::stop(Done done) {
  const MutexLock lock(mutex_);
  waiting_.push_back(std::move(done));
  changed_.notify_all();
}

void StopPort::run() {
  pthread_setname_np(pthread_self(), "stop-port");
  for (;;) {
    std::vector<Done> asked;
    {
      const MutexLock lock(mutex_);
      while (waiting_.empty() && !ends_) changed_.wait(mutex_);
      if (waiting_.empty()) return;
      asked.swap(waiting_);
    }
    std::optional<std::uint64_t> tick;
    try {
      tick = client::stop_by_stop_port(address_, certificates_, kStopTimeout, cancelled_);
    } catch (const client::Error&) {
      // The service's own answer says what is wrong.
    }
    for (const Done& done : asked) done(tick);
  }
}

void stop(RpcBridge& bridge, StopPort& port, const Caller& caller, const StopBody& body,
          RpcBridge::Done done) {
  const auto race = std::make_shared<Race>(std::move(done));
  port.stop([race](std::optional<std::uint64_t> tick) {
    if (!tick) return race->failed(std::nullopt);
    v1::StopResponse answer;
    answer.set_guard_state(v1::GUARD_STATE_LATCHED);
    answer.set_guard_fault(v1::GUARD_FAULT_STOPPED);
    answer.set_latched_after_tick(*tick);
    race->arrived(answer_by("stop port", answer.SerializeAsString()));
  });
  bridge.call_raw(
      kStopPath, request_of(body).SerializeAsString(), caller,
      [race](const grpc::Status& status, const std::string& answer) {
        if (status.ok()) return race->arrived(answer_by("service", answer));
        race->failed(RpcBridge::to_end(status));
      },
      kStopTimeout, true);
}

}  // namespace hapticd::console
