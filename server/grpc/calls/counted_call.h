#pragma once

#include <grpcpp/support/status.h>

#include <atomic>
#include <map>
#include <string>

#include "hal/lock/mutex.h"

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
  /// Answer to a call that is not admitted: RESOURCE_EXHAUSTED with the limit. `what`: in the plural.
  grpc::Status refusal(const char* what, const char* where) const;

 private:
  std::atomic<int>& count_;
  int max_;
  bool admitted_;
};

/// Places for calls of one kind, e.g. watchers. One identity may have half of them, or `max_for_one`, so that
/// it does not keep the others out. Any thread.
class SharedPlaces {
 public:
  explicit SharedPlaces(int max) : SharedPlaces(max, max / 2) {}
  SharedPlaces(int max, int max_for_one) : max_(max), max_for_one_(max_for_one) {}
  int max_for_one() const noexcept { return max_for_one_; }

 private:
  friend class PlacedCall;
  const int max_;
  const int max_for_one_;
  Mutex mutex_;
  int taken_ GUARDED_BY(mutex_) = 0;
  std::map<std::string, int> by_identity_ GUARDED_BY(mutex_);
};

/// A call in one of them, for as long as this object lives. Of `identity`, or of the one whose call this
/// thread serves.
class PlacedCall {
 public:
  explicit PlacedCall(SharedPlaces& places);
  PlacedCall(SharedPlaces& places, std::string identity);
  ~PlacedCall();
  PlacedCall(const PlacedCall&) = delete;
  PlacedCall& operator=(const PlacedCall&) = delete;

  bool admitted() const { return admitted_; }
  /// Answer to a call that is not admitted, as of CountedCall.
  grpc::Status refusal(const char* what, const char* where) const;

 private:
  SharedPlaces& places_;
  const std::string identity_;
  bool admitted_ = false;
};

}  // namespace hapticd::server
