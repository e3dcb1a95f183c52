// A server and a client of gRPC that count in one place. ThreadSanitizer must report it where two threads
// count without a lock, and must not where a lock or gRPC itself orders them: planted_race PLACE, where PLACE
// is
//   handler   a handler of the synchronous interface, as most of the services
//   stream    a stream's call-back, as those of telemetry and poses
//   answer    the call-back of a client's call, as the console's
//   none      all of them, with a lock or in the order in which gRPC calls them
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include "hapticd/v1/clock.grpc.pb.h"
#include "hapticd/v1/telemetry.grpc.pb.h"

namespace {

using namespace hapticd;

constexpr int kBatches = 20;

/// Counts in two threads at once.
class Counted {
 public:
  explicit Counted(bool locks) : locks_(locks) {}

  /// Waits for the other thread in a way that orders nothing, then counts.
  void count_with_another() {
    arrived_.fetch_add(1, std::memory_order_relaxed);
    while (arrived_.load(std::memory_order_relaxed) < 2) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (!locks_) return count();
    const std::unique_lock lock(mutex_, std::chrono::minutes(1));
    count();
  }

 private:
  [[gnu::noinline]] void count() { ++counter_; }

  const bool locks_;
  std::atomic<int> arrived_{0};
  std::timed_mutex mutex_;  // as a SerialMutex
  int counter_ = 0;
};

struct Places {
  explicit Places(std::string_view place)
      : handler(place != "handler"), stream(place != "stream"), answer(place != "answer") {}
  Counted handler;
  Counted stream;
  Counted answer;
};

class Clock final : public v1::ClockService::Service {
 public:
  explicit Clock(Counted& counted) : counted_(counted) {}
  grpc::Status Exchange(grpc::ServerContext*, const v1::ExchangeRequest*, v1::ExchangeResponse*) override {
    counted_.count_with_another();
    return grpc::Status::OK;
  }

 private:
  Counted& counted_;
};

/// Writes batches; what it keeps between them is ordered by gRPC alone.
class Stream final : public grpc::ServerWriteReactor<v1::TelemetryBatch> {
 public:
  explicit Stream(Counted& counted) : counted_(counted) { StartWrite(&batch_); }
  void OnWriteDone(bool ok) override {
    if (++written_ == 1) counted_.count_with_another();
    if (!ok || written_ == kBatches) return Finish(grpc::Status::OK);
    batch_.add_samples();
    StartWrite(&batch_);
  }
  void OnDone() override { delete this; }

 private:
  Counted& counted_;
  v1::TelemetryBatch batch_;
  int written_ = 0;
};

class Telemetry final : public v1::TelemetryService::CallbackService {
 public:
  explicit Telemetry(Counted& counted) : counted_(counted) {}
  grpc::ServerWriteReactor<v1::TelemetryBatch>* Subscribe(grpc::CallbackServerContext*,
                                                          const v1::SubscribeRequest*) override {
    return new Stream(counted_);
  }

 private:
  Counted& counted_;
};

/// Waits for the answer of a call of the callback interface.
class Answer {
 public:
  void come() {
    const std::lock_guard lock(mutex_);
    has_come_ = true;
    came_.notify_one();
  }
  void await() {
    std::unique_lock lock(mutex_);
    came_.wait(lock, [this] { return has_come_; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable came_;
  bool has_come_ = false;
};

void call(const std::shared_ptr<grpc::Channel>& channel, Places& places) {
  const auto clock = v1::ClockService::NewStub(channel);
  const auto telemetry = v1::TelemetryService::NewStub(channel);
  const v1::ExchangeRequest request;
  v1::ExchangeResponse response;
  grpc::ClientContext exchange;
  Answer answer;
  clock->async()->Exchange(&exchange, &request, &response, [&](const grpc::Status& status) {
    if (!status.ok()) std::printf("%s\n", status.error_message().c_str());
    places.answer.count_with_another();
    answer.come();
  });
  places.handler.count_with_another();
  places.answer.count_with_another();
  answer.await();

  grpc::ClientContext subscribe;
  const auto reader = telemetry->Subscribe(&subscribe, {});
  places.stream.count_with_another();
  v1::TelemetryBatch batch;
  int read = 0;
  while (reader->Read(&batch)) ++read;
  std::printf("%d batches\n", read);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view place = argc == 2 ? argv[1] : "";
  if (place != "handler" && place != "stream" && place != "answer" && place != "none") {
    std::fprintf(stderr, "usage: planted_race handler|stream|answer|none\n");
    return 2;
  }
  Places places(place);
  Clock clock(places.handler);
  Telemetry telemetry(places.stream);
  int port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&clock);
  builder.RegisterService(&telemetry);
  const auto server = builder.BuildAndStart();
  if (server == nullptr) return 1;
  call(grpc::CreateChannel("127.0.0.1:" + std::to_string(port), grpc::InsecureChannelCredentials()), places);
  server->Shutdown();
  return 0;
}
