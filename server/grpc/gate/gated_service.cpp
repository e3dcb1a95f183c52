#include "server/grpc/gate/gated_service.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>
#include <grpc/byte_buffer.h>
#include <grpc/byte_buffer_reader.h>
#include <grpc/slice.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/support/method_handler.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "proto/text/utf8_text.h"
#include "server/grpc/calls/served_call.h"
#include "server/grpc/gate/access_gate.h"
#include "server/grpc/gate/thread_places.h"
#include "server/grpc/messages/status.h"

namespace hapticd::server {

namespace {

using grpc::internal::MethodHandler;
using grpc::internal::RpcMethod;

constexpr std::size_t kMaxArguments = 2048;  ///< bytes of a request that the audit log shows
constexpr int kMaxText = 80;

/// Copies the request's bytes, if they are few.
std::optional<std::string> copy_of(grpc_byte_buffer* request) {
  if (request == nullptr || grpc_byte_buffer_length(request) > kMaxArguments) return std::nullopt;
  grpc_byte_buffer_reader reader;
  if (grpc_byte_buffer_reader_init(&reader, request) == 0) return std::nullopt;
  const grpc_slice whole = grpc_byte_buffer_reader_readall(&reader);
  std::string bytes(reinterpret_cast<const char*>(GRPC_SLICE_START_PTR(whole)), GRPC_SLICE_LENGTH(whole));
  grpc_slice_unref(whole);
  grpc_byte_buffer_reader_destroy(&reader);
  return bytes;
}

std::string as_text(const google::protobuf::Descriptor& type, const std::string& bytes) {
  const auto* prototype = google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type);
  const std::unique_ptr<google::protobuf::Message> message(prototype->New());
  if (!message->ParseFromString(bytes)) return "(unreadable)";
  google::protobuf::TextFormat::Printer printer;
  printer.SetSingleLineMode(true);
  printer.SetTruncateStringFieldLongerThan(kMaxText);
  printer.SetUseUtf8StringEscaping(true);
  std::string written;
  printer.PrintToString(*message, &written);
  while (!written.empty() && written.back() == ' ') written.pop_back();
  return text::printable(written);  // a long text may have been cut within a character
}

void drop(grpc_byte_buffer* request) {
  if (request != nullptr) grpc_byte_buffer_destroy(request);
}

/// Answers with a status, whatever kind of call it is.
void refuse(const MethodHandler::HandlerParameter& call, const grpc::Status& status) {
  static grpc::internal::RpcMethodHandler<grpc::Service, grpc::ByteBuffer, grpc::ByteBuffer> refusing(
      nullptr, nullptr);
  refusing.RunHandler({call.call, call.server_context, nullptr, status, nullptr, nullptr});
}

/// A method of the synchronous interface behind the gate. gRPC reads a request before it runs the handler:
/// here its bytes go through as they are, and are read once the call was let in.
class GatedHandler final : public MethodHandler {
 public:
  GatedHandler(const AccessGate& gate, ThreadPlaces& threads, MethodHandler& inner,
               const google::protobuf::MethodDescriptor& method)
      : gate_(gate),
        threads_(threads),
        inner_(inner),
        method_(method),
        row_(find_access_row(method.service()->name() + "/" + method.name())) {}

  void* Deserialize(grpc_call*, grpc_byte_buffer* request, grpc::Status* status, void**) override {
    *status = grpc::Status::OK;
    return request;
  }

  void RunHandler(const HandlerParameter& call) override {
    auto* bytes = static_cast<grpc_byte_buffer*>(call.request);
    ServedCall served;
    const auto refusal = gate_.admit(row_, *call.server_context, served);
    const PlacedCall place(threads_.calls, served.who.name);
    if (!place.admitted()) return refuse_without_place(call, served, bytes, place);
    const bool has_line = row_ == nullptr || row_->is_audited || refusal;
    const auto shown = has_line ? copy_of(bytes) : std::nullopt;
    if (refusal) {
      drop(bytes);
      served.status = to_status(*refusal);
      refuse(call, served.status);
    } else {
      const ServedCallScope scope(served);
      grpc::Status readable = call.status;
      void* request = nullptr;
      if (!method_.client_streaming()) {
        request = inner_.Deserialize(call.call->call(), bytes, &readable, nullptr);
      }
      inner_.RunHandler({call.call, call.server_context, request, readable, nullptr, nullptr});
    }
    if (shown) served.arguments = as_text(*method_.input_type(), *shown);
    served.note_end();
  }

 private:
  /// The thread must not wait here for a client that reads no answer.
  void refuse_without_place(const HandlerParameter& call, ServedCall& served, grpc_byte_buffer* request,
                            const PlacedCall& place) const {
    drop(request);
    served.status = end_without_place(call.call->call(), place, method_.name().c_str());
    refuse(call, served.status);
    served.note_end();
  }

  const AccessGate& gate_;
  ThreadPlaces& threads_;
  MethodHandler& inner_;
  const google::protobuf::MethodDescriptor& method_;
  const AccessRow* const row_;
};

RpcMethod::RpcType type_of(const google::protobuf::MethodDescriptor& method) {
  if (method.client_streaming()) {
    return method.server_streaming() ? RpcMethod::BIDI_STREAMING : RpcMethod::CLIENT_STREAMING;
  }
  return method.server_streaming() ? RpcMethod::SERVER_STREAMING : RpcMethod::NORMAL_RPC;
}

/// grpc::Service shows the handlers of a service only to what derives from it.
struct Handlers : grpc::Service {
  using grpc::Service::GetHandler;
};

}  // namespace

GatedService::GatedService(const google::protobuf::ServiceDescriptor& contract, grpc::Service& inner,
                           const AccessGate& gate, ThreadPlaces& threads,
                           std::vector<GatedCallback> callbacks) {
  names_.reserve(static_cast<std::size_t>(contract.method_count()));
  for (int i = 0; i < contract.method_count(); ++i) {
    const auto& method = *contract.method(i);
    names_.push_back("/" + contract.full_name() + "/" + method.name());
    const auto given = std::find_if(callbacks.begin(), callbacks.end(),
                                    [&](const GatedCallback& one) { return one.method == method.name(); });
    MethodHandler* inner_handler = (inner.*&Handlers::GetHandler)(i);
    auto handler = given == callbacks.end()
                       ? std::make_unique<GatedHandler>(gate, threads, *inner_handler, method)
                       : std::unique_ptr<MethodHandler>();
    // gRPC hands on a call whose requests are a stream before the first one is there.
    const bool at_headers = given != callbacks.end() && given->at_headers;
    AddMethod(new grpc::internal::RpcServiceMethod(names_.back().c_str(),
                                                   at_headers ? RpcMethod::CLIENT_STREAMING : type_of(method),
                                                   handler.release()));
    if (given == callbacks.end()) continue;
    if (given->raw) {
      MarkMethodRawCallback(i, given->handler.release());
    } else {
      MarkMethodCallback(i, given->handler.release());
    }
  }
}

}  // namespace hapticd::server
