#include "client/cpp/telemetry_stream.h"

#include <algorithm>
#include <utility>

#include "client/cpp/error.h"
#include "client/cpp/telemetry_stream_state.h"

namespace hapticd::client {

// One operation is under way at any time, so the completion queue needs no tags to tell them apart.
TelemetryStream::State::State(const std::shared_ptr<grpc::Channel>& channel,
                              const v1::SubscribeRequest& request, std::string server_address)
    : address(std::move(server_address)),
      account(request.decimation()),
      stub(v1::TelemetryService::NewStub(channel)),
      reader(stub->AsyncSubscribe(&context, request, &queue, nullptr)) {}

TelemetryStream::State::~State() {
  context.TryCancel();
  bool succeeded = false;
  if (phase == Phase::kStarting || phase == Phase::kReading) {
    await(std::chrono::hours(1), succeeded);
    reader->Finish(&status, nullptr);
    phase = Phase::kFinishing;
  }
  if (phase == Phase::kFinishing) await(std::chrono::hours(1), succeeded);
  queue.Shutdown();
  void* tag = nullptr;
  while (queue.Next(&tag, &succeeded)) {
  }
}

bool TelemetryStream::State::await(std::chrono::milliseconds wait, bool& succeeded) {
  void* tag = nullptr;
  return queue.AsyncNext(&tag, &succeeded, std::chrono::system_clock::now() + wait) ==
         grpc::CompletionQueue::GOT_EVENT;
}

TelemetryStream::TelemetryStream(std::unique_ptr<State> state) : state_(std::move(state)) {}
TelemetryStream::TelemetryStream(TelemetryStream&&) noexcept = default;
TelemetryStream& TelemetryStream::operator=(TelemetryStream&&) noexcept = default;
TelemetryStream::~TelemetryStream() = default;

TelemetryStream::Event TelemetryStream::next(v1::TelemetryBatch& batch, std::chrono::milliseconds wait) {
  State& s = *state_;
  const auto until = std::chrono::steady_clock::now() + wait;
  while (s.phase != State::Phase::kDone) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
    bool succeeded = false;
    if (!s.await(std::max(left, std::chrono::milliseconds(0)), succeeded)) return Event::kNothing;

    if (s.phase == State::Phase::kFinishing) {
      s.phase = State::Phase::kDone;
      if (!s.status.ok() && !s.cancelled) {
        throw error_from_status(static_cast<int>(s.status.error_code()), s.status.error_message(),
                                s.status.error_details(), s.address);
      }
    } else if (!succeeded) {
      s.phase = State::Phase::kFinishing;
      s.reader->Finish(&s.status, nullptr);
    } else if (s.phase == State::Phase::kStarting) {
      s.phase = State::Phase::kReading;
      s.reader->Read(&s.incoming, nullptr);
    } else {
      batch.Swap(&s.incoming);
      s.incoming.Clear();
      s.reader->Read(&s.incoming, nullptr);
      for (const auto& sample : batch.samples()) s.account.add(sample.tick());
      s.account.set_dropped(batch.dropped_by_subscriber(), batch.dropped_by_server());
      return Event::kBatch;
    }
  }
  return Event::kEnded;
}

void TelemetryStream::cancel() {
  state_->cancelled = true;
  state_->context.TryCancel();
}

const StreamAccount& TelemetryStream::account() const noexcept {
  return state_->account;
}

}  // namespace hapticd::client
