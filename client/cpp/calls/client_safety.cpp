// Stop and clear.

#include "client/cpp/client.h"
#include "client/cpp/client_state.h"
#include "client/cpp/stop/both_paths.h"

namespace hapticd::client {

StopOutcome Client::stop(const std::string& reason) {
  return stop_by_both(
      state_->options, [channel = state_->channel] { return channel; }, reason);
}

v1::ClearResponse Client::clear() {
  return state_->call(&v1::SafetyService::Stub::Clear, v1::ClearRequest());
}

v1::ListFaultsResponse Client::faults() {
  return state_->call(&v1::SafetyService::Stub::ListFaults, v1::ListFaultsRequest());
}

}  // namespace hapticd::client
