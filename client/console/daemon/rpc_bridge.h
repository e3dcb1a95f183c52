#pragma once

#include <grpcpp/support/status.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "client/console/daemon/caller.h"
#include "client/console/daemon/channel_pool.h"
#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"
#include "hapticd/v1/common.pb.h"

namespace grpc {
class ClientContext;
}
namespace google::protobuf {
class Descriptor;
class MethodDescriptor;
}  // namespace google::protobuf

namespace hapticd::console {

/// How a call ended, for a browser.
struct RpcEnd {
  unsigned http_status = 200;
  std::string json;  ///< the answer, or {"code", "message", "detail"}
};
/// Makes a refusal by the console itself, in the same form.
RpcEnd refuse_rpc(grpc::StatusCode code, const v1::ErrorDetail& detail);
/// Detail of a refusal, from its parts.
v1::ErrorDetail detail_of(std::string what, std::string where = {}, std::string value = {},
                          std::string limit = {}, std::string remedy = {});

/// A stream of answers. All functions may be called by any thread; the callbacks come from threads of gRPC.
class RpcStream {
 public:
  virtual ~RpcStream() = default;
  /// Allows `count` more messages.
  virtual void grant(std::uint64_t count) = 0;
  /// on_end still comes.
  virtual void cancel() = 0;
};

/// Calls of the service by the name of a method, in proto3 JSON. They pass the same gate, limits and audit as
/// those of all clients.
class RpcBridge {
 public:
  using Done = Callback<void(RpcEnd)>;
  using RawDone = Callback<void(const grpc::Status&, std::string bytes)>;
  using OnMessage = Callback<void(std::string bytes)>;

  /// How long a call may take. Those of the contract take less by their own limits.
  static constexpr std::chrono::milliseconds kTimeout{60'000};

  RpcBridge(ChannelPool::MakeChannel make_channel, std::size_t max_connections)
      : channels_(std::move(make_channel), max_connections) {}
  /// Cancels what is under way and waits for it.
  ~RpcBridge();
  RpcBridge(const RpcBridge&) = delete;
  RpcBridge& operator=(const RpcBridge&) = delete;

  /// "hapticd.v1.SafetyService/Stop"; nullptr if there is no such call.
  static const google::protobuf::MethodDescriptor* find(std::string_view method);
  /// End of a call in JSON; without its answer.
  static RpcEnd to_end(const grpc::Status& status);

  /// Makes a call with one request and one answer. `done` comes once, at once if the request cannot be read.
  void call(std::string_view method, const std::string& request_json, const Caller& caller, Done done);
  /// Calls in bytes, also methods that are not in the contract. `waits`: while the daemon is away, waits for
  /// it, up to `timeout`.
  void call_raw(const std::string& path, const std::string& bytes, const Caller& caller, RawDone done,
                std::chrono::milliseconds timeout = kTimeout, bool waits = false);
  /// Opens a call with one request and a stream of answers, none before they are granted. nullptr if it
  /// cannot begin: then `on_end` has come.
  std::shared_ptr<RpcStream> open(std::string_view method, const std::string& request_json,
                                  const Caller& caller, OnMessage on_message, Done on_end);
  /// Turns a message of the contract into JSON.
  static std::string to_json(const google::protobuf::Descriptor& type, const std::string& bytes);

 private:
  class Unary;
  class Stream;
  void begin(grpc::ClientContext* context, const std::shared_ptr<RpcStream>& stream = nullptr);
  void end(grpc::ClientContext* context);

  ChannelPool channels_;
  Mutex mutex_;
  Condition none_left_;
  std::map<grpc::ClientContext*, std::shared_ptr<RpcStream>> under_way_
      GUARDED_BY(mutex_);  ///< nullptr: one answer
};

}  // namespace hapticd::console
