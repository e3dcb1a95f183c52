#include "server/grpc/calls/counted_call.h"

#include <fmt/format.h>

#include <utility>

#include "server/grpc/calls/served_call.h"
#include "server/grpc/messages/status.h"

namespace hapticd::server {

grpc::Status CountedCall::refusal(const char* what, const char* where) const {
  return to_status({RefusalKind::kResourceExhausted,
                    {fmt::format("too many {} at once", what), where, "", fmt::format("up to {}", max_),
                     "wait for one to end"}});
}

PlacedCall::PlacedCall(SharedPlaces& places)
    : PlacedCall(places, served_call() == nullptr ? std::string() : served_call()->who.name) {}

PlacedCall::PlacedCall(SharedPlaces& places, std::string identity)
    : places_(places), identity_(std::move(identity)) {
  const MutexLock lock(places_.mutex_);
  int& own = places_.by_identity_[identity_];
  admitted_ = places_.taken_ < places_.max_ && own < places_.max_for_one_;
  if (!admitted_) {
    if (own == 0) places_.by_identity_.erase(identity_);
    return;
  }
  ++own;
  ++places_.taken_;
}

PlacedCall::~PlacedCall() {
  if (!admitted_) return;
  const MutexLock lock(places_.mutex_);
  --places_.taken_;
  if (--places_.by_identity_[identity_] == 0) places_.by_identity_.erase(identity_);
}

grpc::Status PlacedCall::refusal(const char* what, const char* where) const {
  return to_status({RefusalKind::kResourceExhausted,
                    {fmt::format("too many {} at once", what), where, "",
                     fmt::format("up to {}, and {} of one client", places_.max_, places_.max_for_one_),
                     "wait for one to end"}});
}

}  // namespace hapticd::server
