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
/// was let in; its end is noted by the service itself, which alone knows when that is.
template <class Request, class Response, class Serve>
GatedCallback gated_unary(const AccessGate& gate, const char* service, const char* method, Serve serve) {
  const AccessRow* row = find_access_row(std::string(service) + "/" + method);
  auto handler = std::make_unique<grpc::internal::CallbackUnaryHandler<Request, Response>>(
      [&gate, row, serve](grpc::CallbackServerContext* context, const Request* request,
                          Response* response) -> grpc::ServerUnaryReactor* {
        ServedCall call;
        const auto refusal = gate.admit(row, *context, call);
        const ServedCallScope scope(call);
        return refusal ? finish(*context, to_status(*refusal)) : serve(context, request, response);
      });
  return {method, std::move(handler), std::is_same_v<Request, grpc::ByteBuffer>};
}

/// Reads the one request of a call that was let in, and answers it.
template <class Serve>
class CallAtHeaders final : public grpc::ServerReadReactor<grpc::ByteBuffer> {
 public:
  CallAtHeaders(grpc::CallbackServerContext& context, grpc::ByteBuffer& response, ServedCall call,
                Serve serve)
      : context_(context), response_(response), call_(std::move(call)), serve_(std::move(serve)) {
    StartRead(&request_);
  }
  void OnReadDone(bool has_come) override {
    Finish(serve(has_come ? &request_ : nullptr));  // no served call is known then: the answer is bytes
  }
  void OnDone() override { delete this; }

 private:
  grpc::Status serve(const grpc::ByteBuffer* request) {
    const ServedCallScope scope(call_);
    return serve_(context_, request, response_);
  }

  grpc::CallbackServerContext& context_;
  grpc::ByteBuffer& response_;
  ServedCall call_;
  Serve serve_;
  grpc::ByteBuffer request_;
};

class RefusedAtHeaders final : public grpc::ServerReadReactor<grpc::ByteBuffer> {
 public:
  explicit RefusedAtHeaders(const grpc::Status& status) { Finish(status); }
  void OnDone() override { delete this; }
};

/// A method whose call begins with its headers: `first(context)` is called at once, before the gate is asked,
/// and whatever follows of the request, or never does. `serve(context, request, response)` returns how the
/// call ends; `request`: the bytes, nullptr if they did not come.
template <class Serve>
GatedCallback gated_at_headers(const AccessGate& gate, const char* service, const char* method, Serve serve,
                               std::function<void(const grpc::CallbackServerContext&)> first) {
  using Handler = grpc::internal::CallbackClientStreamingHandler<grpc::ByteBuffer, grpc::ByteBuffer>;
  const AccessRow* row = find_access_row(std::string(service) + "/" + method);
  auto handler = std::make_unique<Handler>(
      [&gate, row, serve, first](grpc::CallbackServerContext* context,
                                 grpc::ByteBuffer* response) -> grpc::ServerReadReactor<grpc::ByteBuffer>* {
        first(*context);
        ServedCall call;
        if (const auto refusal = gate.admit(row, *context, call)) {
          call.note_end(to_status(*refusal), std::nullopt);
          return new RefusedAtHeaders(call.status);
        }
        return new CallAtHeaders<Serve>(*context, *response, std::move(call), serve);
      });
  return {method, std::move(handler), true, true};
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
