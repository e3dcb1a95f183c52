#pragma once

#include <grpcpp/impl/service_type.h>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace google::protobuf {
class ServiceDescriptor;
}

namespace hapticd::server {

class AccessGate;
struct ThreadPlaces;

/// A handler that was made for a gate already; see gated_callback.h.
struct GatedCallback {
  std::string_view method;  ///< "Stop"
  std::unique_ptr<grpc::internal::MethodHandler> handler;
  bool raw = false;         ///< takes its request as bytes
  bool at_headers = false;  ///< begins before its request has come, and reads it itself
};

/// A service as the network sees it: every call passes the gate, before its request is read, and then goes to
/// `inner`, which is not registered itself. Methods of the callback interface come as `callbacks`.
class GatedService final : public grpc::Service {
 public:
  /// `inner`, `gate` and `threads` must outlive it.
  GatedService(const google::protobuf::ServiceDescriptor& contract, grpc::Service& inner,
               const AccessGate& gate, ThreadPlaces& threads, std::vector<GatedCallback> callbacks = {});

 private:
  std::vector<std::string> names_;  ///< of the methods; gRPC keeps pointers
};

}  // namespace hapticd::server
