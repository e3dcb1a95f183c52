#pragma once

#include <grpcpp/support/status.h>

#include <atomic>

namespace hapticd::server {

/// Limits how many long calls of one kind are served at once. More are refused, so that no client uses up the
/// threads that other calls need.
inline constexpr int kMaxSlowCalls = 4;

/// One call of a kind; counted for as long as this object lives.
class CountedCall {
 public:
  CountedCall(std::atomic<int>& count, int max)
      : count_(count), max_(max), admitted_(count.fetch_add(1) < max) {}
  ~CountedCall() { count_.fetch_sub(1); }
  CountedCall(const CountedCall&) = delete;
  CountedCall& operator=(const CountedCall&) = delete;

  bool admitted() const { return admitted_; }
  /// The answer to a call that is not admitted: RESOURCE_EXHAUSTED with the limit. `what`: in the plural.
  grpc::Status refusal(const char* what, const char* where) const;

 private:
  std::atomic<int>& count_;
  int max_;
  bool admitted_;
};

}  // namespace hapticd::server
