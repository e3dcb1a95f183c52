#include "client/cpp/message_stream.h"

#include <utility>

#include "client/cpp/server_stream.h"
#include "hapticd/v1/telemetry.grpc.pb.h"  // how gRPC writes and reads messages, of any service

namespace hapticd::client {

template <class Message>
MessageStream<Message>::MessageStream(std::unique_ptr<ServerStream<Message>> stream)
    : stream_(std::move(stream)) {}
template <class Message>
MessageStream<Message>::MessageStream(MessageStream&&) noexcept = default;
template <class Message>
MessageStream<Message>& MessageStream<Message>::operator=(MessageStream&&) noexcept = default;
template <class Message>
MessageStream<Message>::~MessageStream() = default;

template <class Message>
typename MessageStream<Message>::Event MessageStream<Message>::next(Message& message,
                                                                    std::chrono::milliseconds wait) {
  return stream_->next(message, wait);
}
template <class Message>
void MessageStream<Message>::cancel() {
  stream_->cancel();
}

template class MessageStream<v1::CalibrationProgress>;
template class MessageStream<v1::EventBatch>;
template class MessageStream<v1::GuideStatus>;
template class MessageStream<v1::IdentificationProgress>;
template class MessageStream<v1::LeaseState>;
template class MessageStream<v1::Pose>;
template class MessageStream<v1::RecordingPiece>;
template class MessageStream<v1::TelemetryBatch>;
template class MessageStream<v1::TurntableStatus>;

TelemetryStream::Event TelemetryStream::next(v1::TelemetryBatch& batch, std::chrono::milliseconds wait) {
  const Event event = stream_.next(batch, wait);
  if (event != Event::kMessage) return event;
  for (const auto& sample : batch.samples()) account_.add(sample.tick());
  if (batch.has_block()) {
    const bool first = table_.columns().empty();
    table_.set(batch.block());
    if (first) tick_column_ = table_.column("tick").value_or(0);
    for (std::size_t row = 0; row < table_.rows(); ++row)
      account_.add(static_cast<std::uint64_t>(table_.integer(row, tick_column_)));
  }
  account_.set_dropped(batch.dropped_by_subscriber(), batch.dropped_by_server());
  return event;
}

}  // namespace hapticd::client
