#pragma once

#include <grpcpp/grpcpp.h>
#include <grpcpp/support/server_callback.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "server/grpc/calls/served_call.h"
#include "server/grpc/gate/access_gate.h"
#include "server/grpc/gate/gated_service.h"
#include "server/grpc/messages/status.h"

namespace hapticd::server {

/// A method of the callback interface behind the gate. `serve(context, request, response)` is called for what
/// was let in; its end is noted by the service itself, which alone knows when that is. `first(context)` is
/// called before the gate is asked.
template <class Request, class Response, class Serve>
GatedCallback gated_unary(
    const AccessGate& gate, const char* service, const char* method, Serve serve,
    std::function<void(const grpc::CallbackServerContext&)> first = [](const auto&) {}) {
  const AccessRow* row = find_access_row(std::string(service) + "/" + method);
  auto handler = std::make_unique<grpc::internal::CallbackUnaryHandler<Request, Response>>(
      [&gate, row, serve, first](grpc::CallbackServerContext* context, const Request* request,
                                 Response* response) -> grpc::ServerUnaryReactor* {
        first(*context);
        ServedCall call;
        if (const auto refusal = gate.admit(row, *context, call)) {
          call.note_end(to_status(*refusal), std::nullopt);
          grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
          reactor->Finish(call.status);
          return reactor;
        }
        const ServedCallScope scope(call);
        return serve(context, request, response);
      });
  return {method, std::move(handler), std::is_same_v<Request, grpc::ByteBuffer>};
}

/// Ends a call before it began.
class RefusedByGate final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  explicit RefusedByGate(const grpc::Status& status) { Finish(status); }
  void OnDone() override { delete this; }
};

/// Gated callback for a stream of answers as bytes.
template <class Serve>
GatedCallback gated_stream(const AccessGate& gate, const char* service, const char* method, Serve serve) {
  using Handler = grpc::internal::CallbackServerStreamingHandler<grpc::ByteBuffer, grpc::ByteBuffer>;
  const AccessRow* row = find_access_row(std::string(service) + "/" + method);
  auto handler = std::make_unique<Handler>(
      [&gate, row, serve](grpc::CallbackServerContext* context,
                          const grpc::ByteBuffer* request) -> grpc::ServerWriteReactor<grpc::ByteBuffer>* {
        ServedCall call;
        if (const auto refusal = gate.admit(row, *context, call)) {
          call.note_end(to_status(*refusal), std::nullopt);
          return new RefusedByGate(call.status);
        }
        const ServedCallScope scope(call);
        return serve(context, request);
      });
  return {method, std::move(handler), true};
}

}  // namespace hapticd::server
