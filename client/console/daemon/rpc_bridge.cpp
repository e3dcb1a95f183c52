#include "client/console/daemon/rpc_bridge.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <google/protobuf/util/json_util.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <optional>
#include <utility>
#include <vector>

#include "proto/text/json_depth.h"
#include "client/cpp/error.h"

namespace hapticd::console {

namespace {

namespace pb = google::protobuf;

constexpr std::string_view kPackage = "hapticd.v1.";

std::unique_ptr<pb::Message> make_message(const pb::Descriptor& type) {
  return std::unique_ptr<pb::Message>(pb::MessageFactory::generated_factory()->GetPrototype(&type)->New());
}

grpc::ByteBuffer to_buffer(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}

std::string to_bytes(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  std::string bytes;
  if (!buffer.Dump(&slices).ok()) return bytes;
  bytes.reserve(buffer.Length());
  for (const grpc::Slice& slice : slices) {
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return bytes;
}

/// Names as in the contract, and every field: a page can show what is 0.
std::string message_json(const pb::Message& message) {
  pb::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  std::string json;
  if (!pb::util::MessageToJsonString(message, &json, options).ok()) return "{}";
  return json;
}

std::string quoted(const std::string& text) {
  v1::ErrorDetail carrier;  // whose JSON escapes as all other answers do
  carrier.set_what(text);
  pb::util::JsonPrintOptions options;
  std::string json;
  if (!pb::util::MessageToJsonString(carrier, &json, options).ok()) return "\"\"";
  const std::size_t begin = json.find(':') + 1;
  return text.empty() ? "\"\"" : json.substr(begin, json.rfind('}') - begin);
}

unsigned http_status_of(grpc::StatusCode code) {
  switch (code) {
    case grpc::StatusCode::OK:
      return 200;
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::OUT_OF_RANGE:
      return 400;
    case grpc::StatusCode::UNAUTHENTICATED:
      return 401;
    case grpc::StatusCode::PERMISSION_DENIED:
      return 403;
    case grpc::StatusCode::NOT_FOUND:
      return 404;
    case grpc::StatusCode::FAILED_PRECONDITION:
    case grpc::StatusCode::ABORTED:
      return 409;
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return 429;
    case grpc::StatusCode::CANCELLED:
      return 499;
    case grpc::StatusCode::UNIMPLEMENTED:
      return 501;
    case grpc::StatusCode::UNAVAILABLE:
      return 503;
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return 504;
    default:
      return 500;
  }
}

std::string error_json(grpc::StatusCode code, const std::string& message, const v1::ErrorDetail& detail) {
  return "{\"code\":\"" + std::string(client::status_code_name(code)) + "\",\"message\":" + quoted(message) +
         ",\"detail\":" + message_json(detail) + "}";
}

RpcEnd end_of(const grpc::Status& status) {
  if (status.ok()) return {200, "{\"code\":\"OK\"}"};
  const client::Error error = client::error_from_status(status.error_code(), status.error_message(),
                                                        status.error_details(), "hapticd");
  return {http_status_of(status.error_code()), error_json(status.error_code(), error.what(), error.detail())};
}

/// Checks the method and makes the request's bytes; the refusal if it cannot be done.
std::optional<RpcEnd> prepare(std::string_view name, const pb::MethodDescriptor* method, bool streams,
                              const std::string& request_json, std::string& bytes) {
  if (method == nullptr) {
    return refuse_rpc(grpc::StatusCode::UNIMPLEMENTED,
                      detail_of("no such call", "path", std::string(name),
                                "hapticd.v1.SERVICE/METHOD of the contract", "see docs/contract.md"));
  }
  if (method->client_streaming() || method->server_streaming() != streams) {
    return refuse_rpc(grpc::StatusCode::UNIMPLEMENTED,
                      detail_of(streams ? "this call has one answer" : "this call is a stream", "path",
                                std::string(name), "",
                                method->client_streaming() ? "use hapticctl or a client library"
                                : streams                  ? "POST it to /rpc/"
                                                           : "open it on the socket /live"));
  }
  if (!text::is_shallow_json(request_json)) {
    return refuse_rpc(grpc::StatusCode::INVALID_ARGUMENT,
                      detail_of("the request nests too deep", std::string(name), "",
                                "brackets within brackets, at most " + std::to_string(text::kMaxJsonDepth),
                                "see docs/contract.md"));
  }
  const auto message = make_message(*method->input_type());
  const auto status =
      pb::util::JsonStringToMessage(request_json.empty() ? "{}" : request_json, message.get());
  if (!status.ok()) {
    return refuse_rpc(
        grpc::StatusCode::INVALID_ARGUMENT,
        detail_of("the request cannot be read: " + std::string(status.message()), std::string(name), "",
                  "proto3 JSON of " + method->input_type()->name(), "see docs/contract.md"));
  }
  bytes = message->SerializeAsString();
  return std::nullopt;
}

grpc::Status cannot_name() {
  return {grpc::StatusCode::UNAUTHENTICATED, "this browser's identity cannot be sent to the daemon"};
}

}  // namespace

v1::ErrorDetail detail_of(std::string what, std::string where, std::string value, std::string limit,
                          std::string remedy) {
  v1::ErrorDetail detail;
  detail.set_what(std::move(what));
  detail.set_where(std::move(where));
  detail.set_value(std::move(value));
  detail.set_limit(std::move(limit));
  detail.set_remedy(std::move(remedy));
  return detail;
}

RpcEnd refuse_rpc(grpc::StatusCode code, const v1::ErrorDetail& detail) {
  return {http_status_of(code), error_json(code, client::one_line(detail), detail)};
}

/// Kept alive by itself until its callback.
class RpcBridge::Unary {
 public:
  Unary(RpcBridge& bridge, RawDone done)
      : bridge_(bridge), done_(std::move(done)), stub_(bridge.channels_.take()) {}

  static void run(std::unique_ptr<Unary> self, const std::string& path, const std::string& bytes,
                  const Caller& caller, std::chrono::milliseconds timeout, bool waits) {
    if (!fill(self->context_, caller)) return self->done_(cannot_name(), {});
    Unary* call = self.release();
    call->context_.set_deadline(std::chrono::system_clock::now() + timeout);
    call->context_.set_wait_for_ready(waits);
    call->request_ = to_buffer(bytes);
    call->bridge_.begin(&call->context_);
    call->stub_->UnaryCall(&call->context_, path, {}, &call->request_, &call->response_,
                           [call](const grpc::Status& status) { call->finish(status); });
  }

 private:
  void finish(const grpc::Status& status) {
    const std::unique_ptr<Unary> self(this);
    done_(status, status.ok() ? to_bytes(response_) : std::string());
    bridge_.end(&context_);
  }

  RpcBridge& bridge_;
  const RawDone done_;
  const std::shared_ptr<grpc::GenericStub> stub_;
  grpc::ClientContext context_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
};

/// Kept alive by itself until gRPC is done with it.
class RpcBridge::Stream final : public RpcStream,
                                public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  Stream(RpcBridge& bridge, OnMessage on_message, Done on_end)
      : bridge_(bridge),
        on_message_(std::move(on_message)),
        on_end_(std::move(on_end)),
        stub_(bridge.channels_.take()) {}

  /// False if it cannot begin.
  bool run(const std::shared_ptr<Stream>& self, const std::string& path, const std::string& bytes,
           const Caller& caller) {
    if (!fill(context_, caller)) {
      on_end_(end_of(cannot_name()));
      return false;
    }
    self_ = self;
    request_ = to_buffer(bytes);
    bridge_.begin(&context_, self);
    stub_->PrepareBidiStreamingCall(&context_, path, {}, this);
    AddHold();  // reads may be started outside of the callbacks
    StartWriteLast(&request_, {});
    StartCall();
    return true;
  }

  void grant(std::uint64_t count) override {
    const MutexLock lock(mutex_);
    granted_ += count;
    read_if_granted();
  }

  void cancel() override {
    context_.TryCancel();
    const MutexLock lock(mutex_);
    is_cancelled_ = true;
    if (!is_reading_) let_go();
  }

  void OnReadDone(bool ok) override {
    if (ok) on_message_(to_bytes(response_));
    const MutexLock lock(mutex_);
    is_reading_ = false;
    if (!ok || is_cancelled_) {
      let_go();
    } else {
      read_if_granted();
    }
  }

  void OnDone(const grpc::Status& status) override {
    on_end_(end_of(status));
    bridge_.end(&context_);
    const std::shared_ptr<Stream> last = std::move(self_);
  }

 private:
  void read_if_granted() REQUIRES(mutex_) {
    if (granted_ == 0 || is_reading_ || is_over_ || is_cancelled_) return;
    --granted_;
    is_reading_ = true;
    StartRead(&response_);
  }
  void let_go() REQUIRES(mutex_) {
    if (is_over_) return;
    is_over_ = true;
    RemoveHold();
  }

  RpcBridge& bridge_;
  const OnMessage on_message_;
  const Done on_end_;
  const std::shared_ptr<grpc::GenericStub> stub_;
  std::shared_ptr<Stream> self_;
  grpc::ClientContext context_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
  Mutex mutex_;
  std::uint64_t granted_ GUARDED_BY(mutex_) = 0;
  bool is_reading_ GUARDED_BY(mutex_) = false;
  bool is_over_ GUARDED_BY(mutex_) = false;
  bool is_cancelled_ GUARDED_BY(mutex_) = false;
};

RpcBridge::~RpcBridge() {
  std::vector<std::shared_ptr<RpcStream>> streams;
  {
    const MutexLock lock(mutex_);
    for (const auto& [context, stream] : under_way_) {
      if (stream == nullptr) context->TryCancel();
      if (stream != nullptr) streams.push_back(stream);
    }
  }
  for (const auto& stream : streams) stream->cancel();
  streams.clear();
  MutexLock lock(mutex_);
  while (!under_way_.empty()) none_left_.wait(mutex_);
}

void RpcBridge::begin(grpc::ClientContext* context, const std::shared_ptr<RpcStream>& stream) {
  const MutexLock lock(mutex_);
  under_way_[context] = stream;
}

void RpcBridge::end(grpc::ClientContext* context) {
  std::shared_ptr<RpcStream> last;  // goes after the lock
  const MutexLock lock(mutex_);
  last = std::move(under_way_[context]);
  under_way_.erase(context);
  if (under_way_.empty()) none_left_.notify_all();
}

const pb::MethodDescriptor* RpcBridge::find(std::string_view method) {
  const std::size_t slash = method.find('/');
  if (!method.starts_with(kPackage) || slash == std::string_view::npos) return nullptr;
  const auto* service =
      pb::DescriptorPool::generated_pool()->FindServiceByName(std::string(method.substr(0, slash)));
  return service == nullptr ? nullptr : service->FindMethodByName(std::string(method.substr(slash + 1)));
}

RpcEnd RpcBridge::to_end(const grpc::Status& status) {
  return end_of(status);
}

void RpcBridge::call(std::string_view method, const std::string& request_json, const Caller& caller,
                     Done done) {
  const auto* found = find(method);
  std::string bytes;
  if (auto refusal = prepare(method, found, false, request_json, bytes)) return done(std::move(*refusal));
  call_raw("/" + std::string(method), bytes, caller,
           [found, done = std::move(done)](const grpc::Status& status, const std::string& answer) {
             done(status.ok() ? RpcEnd{200, to_json(*found->output_type(), answer)} : end_of(status));
           });
}

void RpcBridge::call_raw(const std::string& path, const std::string& bytes, const Caller& caller,
                         RawDone done, std::chrono::milliseconds timeout, bool waits) {
  Unary::run(std::make_unique<Unary>(*this, std::move(done)), path, bytes, caller, timeout, waits);
}

std::shared_ptr<RpcStream> RpcBridge::open(std::string_view method, const std::string& request_json,
                                           const Caller& caller, OnMessage on_message, Done on_end) {
  std::string bytes;
  if (auto refusal = prepare(method, find(method), true, request_json, bytes)) {
    on_end(std::move(*refusal));
    return nullptr;
  }
  auto stream = std::make_shared<Stream>(*this, std::move(on_message), std::move(on_end));
  if (!stream->run(stream, "/" + std::string(method), bytes, caller)) return nullptr;
  return stream;
}

std::string RpcBridge::to_json(const pb::Descriptor& type, const std::string& bytes) {
  const auto message = make_message(type);
  if (!message->ParseFromString(bytes)) return "{}";
  return message_json(*message);
}

}  // namespace hapticd::console
