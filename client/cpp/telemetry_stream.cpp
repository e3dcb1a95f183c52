#include "client/cpp/telemetry_stream.h"

#include <utility>

#include "client/cpp/telemetry_stream_state.h"

namespace hapticd::client {

TelemetryStream::TelemetryStream(std::unique_ptr<State> state) : state_(std::move(state)) {}
TelemetryStream::TelemetryStream(TelemetryStream&&) noexcept = default;
TelemetryStream& TelemetryStream::operator=(TelemetryStream&&) noexcept = default;
TelemetryStream::~TelemetryStream() = default;

TelemetryStream::Event TelemetryStream::next(v1::TelemetryBatch& batch, std::chrono::milliseconds wait) {
  using Stream = ServerStream<v1::TelemetryBatch>;
  switch (state_->stream.next(batch, wait)) {
    case Stream::Event::kNothing:
      return Event::kNothing;
    case Stream::Event::kEnded:
      return Event::kEnded;
    case Stream::Event::kMessage:
      break;
  }
  for (const auto& sample : batch.samples()) state_->account.add(sample.tick());
  state_->account.set_dropped(batch.dropped_by_subscriber(), batch.dropped_by_server());
  return Event::kBatch;
}

void TelemetryStream::cancel() {
  state_->stream.cancel();
}

const StreamAccount& TelemetryStream::account() const noexcept {
  return state_->account;
}

}  // namespace hapticd::client
