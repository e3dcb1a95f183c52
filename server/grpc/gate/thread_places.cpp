#include "server/grpc/gate/thread_places.h"

#include <grpcpp/server_context.h>

#include <optional>
#include <string>
#include <string_view>

#include "server/connection/connection_table.h"

namespace hapticd::server {

namespace {

class PlaceOfReflection final : public grpc::experimental::Interceptor {
 public:
  PlaceOfReflection(grpc::experimental::ServerRpcInfo& call, const ConnectionTable& connections,
                    SharedPlaces& places)
      : call_(call), connections_(connections), places_(places) {}

  // The call has a peer, and can be cancelled, from its headers on.
  void Intercept(grpc::experimental::InterceptorBatchMethods* batch) override {
    if (batch->QueryInterceptionHookPoint(
            grpc::experimental::InterceptionHookPoints::POST_RECV_INITIAL_METADATA)) {
      const auto who = connections_.find(call_.server_context()->peer());
      place_.emplace(places_, who ? who->name : std::string());
      if (!place_->admitted()) end_without_place(call_.server_context()->c_call(), *place_, "reflection");
    }
    batch->Proceed();
  }

 private:
  grpc::experimental::ServerRpcInfo& call_;
  const ConnectionTable& connections_;
  SharedPlaces& places_;
  std::optional<PlacedCall> place_;
};

}  // namespace

grpc::Status end_without_place(grpc_call* call, const PlacedCall& place, const char* where) {
  grpc::Status status = place.refusal("calls without an answer", where);
  grpc_call_cancel_with_status(call, GRPC_STATUS_RESOURCE_EXHAUSTED, status.error_message().c_str(), nullptr);
  return status;
}

std::unique_ptr<grpc::experimental::Interceptor> place_of_reflection(grpc::experimental::ServerRpcInfo& call,
                                                                     const ConnectionTable& connections,
                                                                     SharedPlaces& places) {
  if (!std::string_view(call.method()).starts_with("/grpc.reflection.")) return nullptr;
  return std::make_unique<PlaceOfReflection>(call, connections, places);
}

}  // namespace hapticd::server
