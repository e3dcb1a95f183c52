#pragma once

#include <grpcpp/generic/generic_stub.h>

#include <memory>
#include <vector>

#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"

namespace grpc {
class Channel;
}

namespace hapticd::console {

/// Connections to the daemon, as many as the calls need: the daemon serves at most 100 calls of one
/// connection at once, and a call beyond them would wait for another to end. Any thread.
class ChannelPool {
 public:
  using MakeChannel = Callback<std::shared_ptr<grpc::Channel>()>;

  /// `max_connections`: beyond, calls share the one with the fewest.
  ChannelPool(MakeChannel make_channel, std::size_t max_connections);

  /// A connection for one more call, which keeps the pointer as long as it lasts.
  std::shared_ptr<grpc::GenericStub> take();

 private:
  const MakeChannel make_channel_;
  const std::size_t max_connections_;
  Mutex mutex_;
  std::vector<std::shared_ptr<grpc::GenericStub>> stubs_ GUARDED_BY(mutex_);
};

}  // namespace hapticd::console
