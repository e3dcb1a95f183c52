#include "server/grpc/calls/unreadable_request.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "server/grpc/calls/served_call.h"
#include "server/grpc/messages/status.h"

namespace hapticd::server {

namespace {

using grpc::experimental::InterceptionHookPoints;
using grpc::experimental::InterceptorBatchMethods;
using grpc::experimental::ServerRpcInfo;

/// "/hapticd.v1.RigService/Diagnose" → "RigService.Diagnose".
std::string readable_name(std::string_view method) {
  method.remove_prefix(std::min(method.size(), method.rfind('.', method.rfind('/')) + 1));
  std::string name(method);
  if (const auto slash = name.find('/'); slash != std::string::npos) name[slash] = '.';
  return name;
}

/// The tick of effect that an answer names.
std::optional<std::uint64_t> effective_tick_of(const void* sent) {
  const auto* message =
      dynamic_cast<const google::protobuf::Message*>(static_cast<const google::protobuf::MessageLite*>(sent));
  if (message == nullptr) return std::nullopt;
  for (const char* name : {"effective_tick", "changed_after_tick"}) {
    if (const auto* field = message->GetDescriptor()->FindFieldByName(name)) {
      return message->GetReflection()->GetUInt64(*message, field);
    }
  }
  return std::nullopt;
}

class UnreadableRequest final : public grpc::experimental::Interceptor {
 public:
  explicit UnreadableRequest(std::string method) : method_(std::move(method)) {}

  void Intercept(InterceptorBatchMethods* call) override {
    ServedCall* served = served_call();
    if (served != nullptr && call->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_MESSAGE)) {
      served->effective_tick = effective_tick_of(call->GetSendMessage());
    }
    if (call->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS)) {
      const grpc::Status status = call->GetSendStatus();
      if (status.error_message().empty() && is_of_unreadable(status.error_code())) {
        call->ModifySendStatus(to_status(
            {RefusalKind::kInvalidArgument,
             {"the request cannot be read", method_, "", "a message as the contract has it, texts in UTF-8",
              "generate the client from proto/hapticd/v1 of this version (hapticd --version)"}}));
      }
      if (served != nullptr) served->status = call->GetSendStatus();
    }
    call->Proceed();
  }

 private:
  /// gRPC answers INTERNAL itself for a method of the synchronous interface and UNIMPLEMENTED for one of the
  /// callback interface, also one that the contract has.
  bool is_of_unreadable(grpc::StatusCode code) const {
    if (code != grpc::StatusCode::UNIMPLEMENTED) return code == grpc::StatusCode::INTERNAL;
    return google::protobuf::DescriptorPool::generated_pool()->FindMethodByName("hapticd.v1." + method_) !=
           nullptr;
  }

  std::string method_;
};

}  // namespace

std::unique_ptr<grpc::experimental::Interceptor> watch_for_unreadable_request(const ServerRpcInfo& call) {
  const std::string_view method = call.method();
  const bool watched = call.type() == ServerRpcInfo::Type::UNARY ||
                       call.type() == ServerRpcInfo::Type::SERVER_STREAMING ||
                       call.type() == ServerRpcInfo::Type::CLIENT_STREAMING;
  // For telemetry each batch would be intercepted.
  if (!watched || !method.starts_with("/hapticd.") || method.ends_with("/Subscribe")) return nullptr;
  return std::make_unique<UnreadableRequest>(readable_name(method));
}

}  // namespace hapticd::server
