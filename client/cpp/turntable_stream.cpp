#include "client/cpp/turntable_stream.h"

#include <utility>

#include "client/cpp/turntable_stream_state.h"

namespace hapticd::client {

TurntableStream::TurntableStream(std::unique_ptr<State> state) : state_(std::move(state)) {}
TurntableStream::TurntableStream(TurntableStream&&) noexcept = default;
TurntableStream& TurntableStream::operator=(TurntableStream&&) noexcept = default;
TurntableStream::~TurntableStream() = default;

TurntableStream::Event TurntableStream::next(v1::TurntableStatus& status, std::chrono::milliseconds wait) {
  using Stream = ServerStream<v1::TurntableStatus>;
  switch (state_->stream.next(status, wait)) {
    case Stream::Event::kMessage:
      return Event::kStatus;
    case Stream::Event::kEnded:
      return Event::kEnded;
    case Stream::Event::kNothing:
      break;
  }
  return Event::kNothing;
}

void TurntableStream::cancel() {
  state_->stream.cancel();
}

}  // namespace hapticd::client
