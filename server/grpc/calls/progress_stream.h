#pragma once

#include <grpcpp/support/sync_stream.h>

#include <cstdint>
#include <string>

#include "server/grpc/messages/status.h"
#include "server/session/caller.h"

namespace hapticd::server {

/// Sends what a runner reports of a run (an identification, a calibration): now, and after every change until
/// it is over. An empty id is the run at present, and stays with it.
template <class Runner, class Message, class Over>
grpc::Status stream_progress(Runner& runner, std::string id, const Caller& caller,
                             grpc::ServerWriter<Message>& writer, Over over) {
  for (std::uint64_t seen = 0;;) {
    const auto report = runner.report(id, seen, caller);
    if (!report) return to_status(report.refusal());
    if (caller.cancelled()) return grpc::Status::CANCELLED;
    id = report->id;
    if (report->version != seen) {
      Message message;
      fill(*report, message);
      if (!writer.Write(message)) return grpc::Status::CANCELLED;
    }
    seen = report->version;
    if (over(*report)) return grpc::Status::OK;
  }
}

}  // namespace hapticd::server
