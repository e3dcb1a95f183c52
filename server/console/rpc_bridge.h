#pragma once

#include <grpcpp/generic/generic_stub.h>

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "hal/error.h"

namespace google::protobuf {
class MethodDescriptor;
}

namespace hapticd::server {

/// Who calls: goes into the metadata of a call.
struct ConsoleCaller {
  std::string pass;   ///< of the session, see ConsoleDoor
  std::string peer;   ///< address of the browser
  std::string lease;  ///< token; empty: none
};

/// How a call ended, for a browser.
struct RpcEnd {
  unsigned http_status = 200;
  std::string json;  ///< the answer, or {"code", "message", "detail"}
};
/// A refusal by the console itself, in the same form.
RpcEnd refuse_rpc(grpc::StatusCode code, const hal::Error& error);

/// A stream of answers. All functions may be called by any thread; the callbacks come from threads of gRPC.
class RpcStream {
 public:
  virtual ~RpcStream() = default;
  /// Allows `count` more messages.
  virtual void grant(std::uint64_t count) = 0;
  /// on_end still comes.
  virtual void cancel() = 0;
};

/// Calls of the service by the name of a method, in proto3 JSON. They go through a channel within the process
/// and pass the same gate, limits and audit as those of all clients.
class RpcBridge {
 public:
  using Done = std::function<void(RpcEnd)>;
  using OnMessage = std::function<void(std::string bytes)>;

  explicit RpcBridge(std::shared_ptr<grpc::Channel> channel);
  /// Cancels what is under way and waits for it.
  ~RpcBridge();
  RpcBridge(const RpcBridge&) = delete;
  RpcBridge& operator=(const RpcBridge&) = delete;

  /// "hapticd.v1.SafetyService/Stop"; nullptr where there is no such call.
  static const google::protobuf::MethodDescriptor* find(std::string_view method);

  /// A call with one request and one answer. `done` comes once, at once where the request cannot be read.
  void call(std::string_view method, const std::string& request_json, const ConsoleCaller& caller, Done done);
  /// A call with one request and a stream of answers, none before they are granted. nullptr where it cannot
  /// begin: then `on_end` has come.
  std::shared_ptr<RpcStream> open(std::string_view method, const std::string& request_json,
                                  const ConsoleCaller& caller, OnMessage on_message, Done on_end);
  /// A message of a stream as JSON.
  static std::string to_json(const google::protobuf::MethodDescriptor& method, const std::string& bytes);

 private:
  class Unary;
  class Stream;
  void begin(grpc::ClientContext* context, const std::shared_ptr<RpcStream>& stream = nullptr);
  void end(grpc::ClientContext* context);

  grpc::GenericStub stub_;
  std::mutex mutex_;
  std::condition_variable none_left_;
  std::map<grpc::ClientContext*, std::shared_ptr<RpcStream>> under_way_;  ///< nullptr: one answer
  bool closing_ = false;
};

}  // namespace hapticd::server
