#include "server/grpc/calls/unreadable_request.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

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

class UnreadableRequest final : public grpc::experimental::Interceptor {
 public:
  explicit UnreadableRequest(std::string method) : method_(std::move(method)) {}

  void Intercept(InterceptorBatchMethods* call) override {
    if (call->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS)) {
      const grpc::Status status = call->GetSendStatus();
      if (status.error_code() == grpc::StatusCode::INTERNAL && status.error_message().empty()) {
        call->ModifySendStatus(to_status(
            {RefusalKind::kInvalidArgument,
             {"the request cannot be read", method_, "", "a message as the contract has it, texts in UTF-8",
              "generate the client from proto/hapticd/v1 of this version (hapticd --version)"}}));
      }
    }
    call->Proceed();
  }

 private:
  std::string method_;
};

}  // namespace

std::unique_ptr<grpc::experimental::Interceptor> watch_for_unreadable_request(const ServerRpcInfo& call) {
  const std::string_view method = call.method();
  const bool one_request =
      call.type() == ServerRpcInfo::Type::UNARY || call.type() == ServerRpcInfo::Type::SERVER_STREAMING;
  // For telemetry each batch would be intercepted.
  if (!one_request || !method.starts_with("/hapticd.") || method.ends_with("/Subscribe")) return nullptr;
  return std::make_unique<UnreadableRequest>(readable_name(method));
}

}  // namespace hapticd::server
