#include "server/grpc/recording/event_service.h"

#include <algorithm>
#include <chrono>
#include <string>

#include "server/grpc/calls/call.h"
#include "server/grpc/calls/counted_call.h"
#include "server/grpc/messages/status.h"
#include "server/recording/event_log.h"
#include "server/text/utf8_text.h"

namespace hapticd::server {

namespace {

using recording::EventKind;

static_assert(static_cast<int>(EventKind::kEnd) == v1::RECORDING_EVENT_KIND_END);
static_assert(static_cast<int>(EventKind::kDaemon) == v1::RECORDING_EVENT_KIND_DAEMON);

constexpr std::uint32_t kMaxListed = 1000;
constexpr std::size_t kMaxInBatch = 200;
constexpr std::size_t kMaxText = 1000;
/// How often a watcher that hears nothing is asked whether it is still there.
constexpr std::chrono::milliseconds kEventWatchSlice{100};

v1::EventSeverity severity_of(EventKind kind) {
  switch (kind) {
    case EventKind::kFault:
      return v1::EVENT_SEVERITY_ERROR;
    case EventKind::kStop:
    case EventKind::kOverrun:
    case EventKind::kLoss:
    case EventKind::kIncident:
    case EventKind::kEnd:  // a recording that ended by itself
      return v1::EVENT_SEVERITY_WARNING;
    default:
      return v1::EVENT_SEVERITY_INFO;
  }
}

void fill(const NumberedEvent& numbered, v1::RigEvent& message) {
  message.set_number(numbered.number);
  message.set_severity(severity_of(numbered.event.kind));
  v1::RecordingEvent& event = *message.mutable_event();
  event.set_time_ns(numbered.event.time_ns);
  event.set_tick(numbered.event.tick);
  event.set_unix_ns(numbered.event.unix_ns);
  event.set_kind(static_cast<v1::RecordingEventKind>(numbered.event.kind));
  event.set_text(shortened(repaired_utf8(numbered.event.text), kMaxText));
  event.set_by(numbered.event.by);
  event.set_lost_ticks(numbered.event.lost_ticks);
}

template <class Request>
bool wants(const Request& request, const NumberedEvent& one) {
  const auto& kinds = request.kinds();
  return kinds.empty() ||
         std::find(kinds.begin(), kinds.end(), static_cast<int>(one.event.kind)) != kinds.end();
}

}  // namespace

grpc::Status EventService::ListEvents(grpc::ServerContext*, const v1::ListEventsRequest* request,
                                      v1::ListEventsResponse* response) {
  const std::uint32_t max = request->max_events() == 0 ? kMaxListed : request->max_events();
  if (max > kMaxListed) {
    return to_status({RefusalKind::kOutOfRange,
                      {"too many events", "ListEventsRequest.max_events", std::to_string(max),
                       "1 … " + std::to_string(kMaxListed), "list them in parts, by after_number"}});
  }
  auto events = event_log_.all_after(request->after_number());
  std::erase_if(events, [&](const NumberedEvent& one) { return !wants(*request, one); });
  const std::size_t first = events.size() > max ? events.size() - max : 0;
  for (std::size_t i = first; i < events.size(); ++i) fill(events[i], *response->add_events());
  return grpc::Status::OK;
}

grpc::Status EventService::WatchEvents(grpc::ServerContext* context, const v1::WatchEventsRequest* request,
                                       grpc::ServerWriter<v1::EventBatch>* writer) {
  const PlacedCall counted(watchers_);
  if (!counted.admitted()) return counted.refusal("watchers", "WatchEvents");
  const Caller caller = caller_of(*context);
  // A number that is still to come was one of an earlier run.
  std::uint64_t seen = request->after_number() > event_log_.last() ? 0 : request->after_number();
  bool is_first = true;
  while (event_log_.await_after(seen, is_first ? std::chrono::milliseconds(0) : kEventWatchSlice)) {
    if (caller.cancelled()) return grpc::Status::CANCELLED;
    v1::EventBatch batch;
    const auto write = [&] {
      const bool sent = writer->Write(batch);
      batch.Clear();
      is_first = false;
      return sent;
    };
    for (const NumberedEvent& one : event_log_.all_after(seen)) {
      seen = one.number;
      if (wants(*request, one)) fill(one, *batch.add_events());
      if (static_cast<std::size_t>(batch.events_size()) == kMaxInBatch && !write())
        return grpc::Status::CANCELLED;
    }
    if ((is_first || batch.events_size() > 0) && !write()) return grpc::Status::CANCELLED;
  }
  return to_status(
      {RefusalKind::kUnavailable, {"the service is shutting down", "events", "", "", "connect again later"}});
}

}  // namespace hapticd::server
