#pragma once

#include <chrono>
#include <memory>

#include "hal/lock/callback.h"

namespace hapticd::openhaptics {

/// Calls the vendor's library, which may never return, on its own thread, so that the caller waits for the
/// result no longer than it wants to. All calls outside the vendor's callback go through one of these: the
/// library also sees one and the same thread.
class VendorThread {
 public:
  VendorThread();
  ~VendorThread();
  VendorThread(const VendorThread&) = delete;
  VendorThread& operator=(const VendorThread&) = delete;

  /// Runs the job and returns true; false if the job did not return within the timeout. Then it continues
  /// in the background, must own all it uses, and every later call is refused at once.
  bool call(Callback<void()> job, std::chrono::milliseconds timeout);
  bool stuck() const;

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

}  // namespace hapticd::openhaptics
