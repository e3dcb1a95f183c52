#include "server/console/rpc_bridge.h"

#include <google/protobuf/any.pb.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/message.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <optional>
#include <utility>
#include <vector>

#include "hapticd/v1/common.pb.h"
#include "server/access/console_metadata.h"

namespace hapticd::server {

namespace {

namespace pb = google::protobuf;

constexpr std::string_view kPackage = "hapticd.v1.";
/// The longest that a call takes by its own limits is well below.
constexpr std::chrono::seconds kDeadline{60};

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
  hapticd::v1::ErrorDetail carrier;  // whose JSON escapes as all other answers do
  carrier.set_what(text);
  pb::util::JsonPrintOptions options;
  std::string json;
  if (!pb::util::MessageToJsonString(carrier, &json, options).ok()) return "\"\"";
  const std::size_t begin = json.find(':') + 1;
  return text.empty() ? "\"\"" : json.substr(begin, json.rfind('}') - begin);
}

struct CodeWords {
  grpc::StatusCode code;
  const char* name;
  unsigned http_status;
};

constexpr CodeWords kCodes[] = {
    {grpc::StatusCode::OK, "OK", 200},
    {grpc::StatusCode::CANCELLED, "CANCELLED", 499},
    {grpc::StatusCode::INVALID_ARGUMENT, "INVALID_ARGUMENT", 400},
    {grpc::StatusCode::DEADLINE_EXCEEDED, "DEADLINE_EXCEEDED", 504},
    {grpc::StatusCode::NOT_FOUND, "NOT_FOUND", 404},
    {grpc::StatusCode::PERMISSION_DENIED, "PERMISSION_DENIED", 403},
    {grpc::StatusCode::RESOURCE_EXHAUSTED, "RESOURCE_EXHAUSTED", 429},
    {grpc::StatusCode::FAILED_PRECONDITION, "FAILED_PRECONDITION", 409},
    {grpc::StatusCode::ABORTED, "ABORTED", 409},
    {grpc::StatusCode::OUT_OF_RANGE, "OUT_OF_RANGE", 400},
    {grpc::StatusCode::UNIMPLEMENTED, "UNIMPLEMENTED", 501},
    {grpc::StatusCode::UNAVAILABLE, "UNAVAILABLE", 503},
    {grpc::StatusCode::UNAUTHENTICATED, "UNAUTHENTICATED", 401},
};

CodeWords words_of(grpc::StatusCode code) {
  for (const CodeWords& words : kCodes) {
    if (words.code == code) return words;
  }
  return {code, "INTERNAL", 500};
}

std::string error_json(grpc::StatusCode code, const std::string& message, const std::string& detail) {
  return std::string("{\"code\":\"") + words_of(code).name + "\",\"message\":" + quoted(message) +
         ",\"detail\":" + detail + "}";
}

/// The first of the details of a google.rpc.Status (field 3), if it is one of ours.
bool read_detail(const std::string& bytes, v1::ErrorDetail& detail) {
  using Wire = pb::internal::WireFormatLite;
  constexpr auto kDetails = Wire::MakeTag(3, Wire::WIRETYPE_LENGTH_DELIMITED);
  pb::io::CodedInputStream input(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                                 static_cast<int>(bytes.size()));
  while (const std::uint32_t tag = input.ReadTag()) {
    if (tag != kDetails) {
      if (!Wire::SkipField(&input, tag)) return false;
      continue;
    }
    std::string text;
    pb::Any any;
    return Wire::ReadBytes(&input, &text) && any.ParseFromString(text) && any.UnpackTo(&detail);
  }
  return false;
}

RpcEnd end_of(const grpc::Status& status) {
  if (status.ok()) return {200, "{\"code\":\"OK\"}"};
  v1::ErrorDetail detail;
  const bool has_detail = read_detail(status.error_details(), detail);
  return {words_of(status.error_code()).http_status, error_json(status.error_code(), status.error_message(),
                                                                has_detail ? message_json(detail) : "null")};
}

void fill(grpc::ClientContext& context, const ConsoleCaller& caller) {
  context.AddMetadata(kConsolePassKey, caller.pass);
  context.AddMetadata(kConsolePeerKey, caller.peer);
  if (!caller.lease.empty()) context.AddMetadata("hapticd-lease", caller.lease);
}

/// Checks the method and makes the request's bytes; the refusal where it cannot be done.
std::optional<RpcEnd> prepare(std::string_view name, const pb::MethodDescriptor* method, bool streams,
                              const std::string& request_json, std::string& bytes) {
  if (method == nullptr) {
    return refuse_rpc(grpc::StatusCode::UNIMPLEMENTED,
                      {"no such call", "path", std::string(name), "hapticd.v1.SERVICE/METHOD of the contract",
                       "see docs/contract.md"});
  }
  if (method->client_streaming() || method->server_streaming() != streams) {
    return refuse_rpc(
        grpc::StatusCode::UNIMPLEMENTED,
        {streams ? "this call has one answer" : "this call is a stream", "path", std::string(name), "",
         method->client_streaming() ? "use hapticctl or a client library"
         : streams                  ? "POST it to /rpc/"
                                    : "open it on the socket /live"});
  }
  const auto message = make_message(*method->input_type());
  const auto status =
      pb::util::JsonStringToMessage(request_json.empty() ? "{}" : request_json, message.get());
  if (!status.ok()) {
    return refuse_rpc(grpc::StatusCode::INVALID_ARGUMENT,
                      {"the request cannot be read: " + std::string(status.message()), std::string(name), "",
                       "proto3 JSON of " + method->input_type()->name(), "see docs/contract.md"});
  }
  bytes = message->SerializeAsString();
  return std::nullopt;
}

}  // namespace

RpcEnd refuse_rpc(grpc::StatusCode code, const hal::Error& error) {
  v1::ErrorDetail detail;
  detail.set_what(error.what);
  detail.set_where(error.where);
  detail.set_value(error.value);
  detail.set_limit(error.limit);
  detail.set_remedy(error.remedy);
  return {words_of(code).http_status, error_json(code, error.text(), message_json(detail))};
}

class RpcBridge::Unary {
 public:
  Unary(RpcBridge& bridge, Done done) : bridge_(bridge), done_(std::move(done)) {}

  static void run(std::unique_ptr<Unary> self, const pb::MethodDescriptor& method, const std::string& path,
                  const std::string& bytes, const ConsoleCaller& caller) {
    Unary* call = self.release();  // ends in its callback
    fill(call->context_, caller);
    call->context_.set_deadline(std::chrono::system_clock::now() + kDeadline);
    call->method_ = &method;
    call->request_ = to_buffer(bytes);
    call->bridge_.begin(&call->context_);
    call->bridge_.stub_.UnaryCall(&call->context_, path, {}, &call->request_, &call->response_,
                                  [call](const grpc::Status& status) { call->finish(status); });
  }

 private:
  void finish(const grpc::Status& status) {
    const std::unique_ptr<Unary> self(this);
    RpcEnd end = status.ok() ? RpcEnd{200, to_json(*method_, to_bytes(response_))} : end_of(status);
    done_(std::move(end));
    bridge_.end(&context_);
  }

  RpcBridge& bridge_;
  const Done done_;
  const pb::MethodDescriptor* method_ = nullptr;
  grpc::ClientContext context_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
};

/// Kept alive by itself until gRPC is done with it.
class RpcBridge::Stream final : public RpcStream,
                                public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  Stream(RpcBridge& bridge, OnMessage on_message, Done on_end)
      : bridge_(bridge), on_message_(std::move(on_message)), on_end_(std::move(on_end)) {}

  void run(const std::shared_ptr<Stream>& self, const std::string& path, const std::string& bytes,
           const ConsoleCaller& caller) {
    self_ = self;
    fill(context_, caller);
    request_ = to_buffer(bytes);
    bridge_.begin(&context_, self);
    bridge_.stub_.PrepareBidiStreamingCall(&context_, path, {}, this);
    AddHold();  // reads may be started outside of the callbacks
    StartWriteLast(&request_, {});
    StartCall();
  }

  void grant(std::uint64_t count) override {
    const std::lock_guard lock(mutex_);
    granted_ += count;
    read_if_granted();
  }

  void cancel() override {
    context_.TryCancel();
    const std::lock_guard lock(mutex_);
    is_cancelled_ = true;
    if (!is_reading_) let_go();
  }

  void OnReadDone(bool ok) override {
    if (ok) on_message_(to_bytes(response_));
    const std::lock_guard lock(mutex_);
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
  void read_if_granted() {
    if (granted_ == 0 || is_reading_ || is_over_ || is_cancelled_) return;
    --granted_;
    is_reading_ = true;
    StartRead(&response_);
  }
  void let_go() {
    if (is_over_) return;
    is_over_ = true;
    RemoveHold();
  }

  RpcBridge& bridge_;
  const OnMessage on_message_;
  const Done on_end_;
  std::shared_ptr<Stream> self_;
  grpc::ClientContext context_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
  std::mutex mutex_;
  std::uint64_t granted_ = 0;
  bool is_reading_ = false;
  bool is_over_ = false;
  bool is_cancelled_ = false;
};

RpcBridge::RpcBridge(std::shared_ptr<grpc::Channel> channel) : stub_(std::move(channel)) {}

RpcBridge::~RpcBridge() {
  std::vector<std::shared_ptr<RpcStream>> streams;
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
    for (const auto& [context, stream] : under_way_) {
      if (stream == nullptr) context->TryCancel();
      if (stream != nullptr) streams.push_back(stream);
    }
  }
  for (const auto& stream : streams) stream->cancel();
  streams.clear();
  std::unique_lock lock(mutex_);
  none_left_.wait(lock, [this] { return under_way_.empty(); });
}

void RpcBridge::begin(grpc::ClientContext* context, const std::shared_ptr<RpcStream>& stream) {
  const std::lock_guard lock(mutex_);
  under_way_[context] = stream;
}

void RpcBridge::end(grpc::ClientContext* context) {
  std::shared_ptr<RpcStream> last;  // goes after the lock
  const std::lock_guard lock(mutex_);
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

void RpcBridge::call(std::string_view method, const std::string& request_json, const ConsoleCaller& caller,
                     Done done) {
  const auto* found = find(method);
  std::string bytes;
  if (auto refusal = prepare(method, found, false, request_json, bytes)) return done(std::move(*refusal));
  Unary::run(std::make_unique<Unary>(*this, std::move(done)), *found, "/" + std::string(method), bytes,
             caller);
}

std::shared_ptr<RpcStream> RpcBridge::open(std::string_view method, const std::string& request_json,
                                           const ConsoleCaller& caller, OnMessage on_message, Done on_end) {
  std::string bytes;
  if (auto refusal = prepare(method, find(method), true, request_json, bytes)) {
    on_end(std::move(*refusal));
    return nullptr;
  }
  auto stream = std::make_shared<Stream>(*this, std::move(on_message), std::move(on_end));
  stream->run(stream, "/" + std::string(method), bytes, caller);
  return stream;
}

std::string RpcBridge::to_json(const pb::MethodDescriptor& method, const std::string& bytes) {
  const auto message = make_message(*method.output_type());
  if (!message->ParseFromString(bytes)) return "{}";
  return message_json(*message);
}

}  // namespace hapticd::server
