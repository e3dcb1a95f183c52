#pragma once

#include "hapticd/v1/event.grpc.pb.h"
#include "server/grpc/calls/counted_call.h"

namespace hapticd::server {

class EventLog;

class EventService final : public v1::EventService::Service {
 public:
  /// Streams at once; more are refused, since each holds one of the server's threads.
  static constexpr int kMaxWatchers = 16;

  explicit EventService(const EventLog& event_log) : event_log_(event_log) {}

  grpc::Status ListEvents(grpc::ServerContext* context, const v1::ListEventsRequest* request,
                          v1::ListEventsResponse* response) override;
  grpc::Status WatchEvents(grpc::ServerContext* context, const v1::WatchEventsRequest* request,
                           grpc::ServerWriter<v1::EventBatch>* writer) override;

 private:
  const EventLog& event_log_;
  SharedPlaces watchers_{kMaxWatchers};
};

}  // namespace hapticd::server
