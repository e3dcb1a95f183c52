#include "client/console/daemon/channel_pool.h"

#include <grpcpp/channel.h>

#include <algorithm>
#include <utility>

namespace hapticd::console {

namespace {
constexpr long kMaxCalls = 80;
}

ChannelPool::ChannelPool(MakeChannel make_channel, std::size_t max_connections)
    : make_channel_(std::move(make_channel)), max_connections_(max_connections) {}

std::shared_ptr<grpc::GenericStub> ChannelPool::take() {
  {
    const MutexLock lock(mutex_);
    // Each call holds its stub: the pointers in use are the calls.
    const auto fewest = std::min_element(stubs_.begin(), stubs_.end(), [](const auto& a, const auto& b) {
      return a.use_count() < b.use_count();
    });
    if (fewest != stubs_.end() &&
        (fewest->use_count() - 1 < kMaxCalls || stubs_.size() >= max_connections_)) {
      return *fewest;
    }
  }
  auto made = std::make_shared<grpc::GenericStub>(make_channel_());
  const MutexLock lock(mutex_);
  if (stubs_.size() < max_connections_) stubs_.push_back(made);
  return made;
}

}  // namespace hapticd::console
