#include "client/cpp/identification_stream.h"

#include <utility>

#include "client/cpp/identification_stream_state.h"

namespace hapticd::client {

IdentificationStream::IdentificationStream(std::unique_ptr<State> state) : state_(std::move(state)) {}
IdentificationStream::IdentificationStream(IdentificationStream&&) noexcept = default;
IdentificationStream& IdentificationStream::operator=(IdentificationStream&&) noexcept = default;
IdentificationStream::~IdentificationStream() = default;

IdentificationStream::Event IdentificationStream::next(v1::IdentificationProgress& progress,
                                                       std::chrono::milliseconds wait) {
  using Stream = ServerStream<v1::IdentificationProgress>;
  switch (state_->stream.next(progress, wait)) {
    case Stream::Event::kMessage:
      return Event::kProgress;
    case Stream::Event::kEnded:
      return Event::kEnded;
    case Stream::Event::kNothing:
      break;
  }
  return Event::kNothing;
}

}  // namespace hapticd::client
