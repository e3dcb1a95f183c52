#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "client/console/daemon/rpc_bridge.h"
#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"

namespace hapticd::console {

/// Maximum part of a stop's body that is read, bytes.
inline constexpr std::size_t kMaxStopBody = 4096;

/// What a page has sent with a stop.
struct StopBody {
  std::string_view text;  ///< what has come of it
  bool is_whole = false;
};

/// Stops by the daemon's stop port, one after the other, on a separate thread: as this program, since that
/// path carries no other name. Stops that come while one is under way share the next.
class StopPort {
 public:
  /// The last completed tick when the daemon took the stop; nothing: it did not come through.
  using Done = Callback<void(std::optional<std::uint64_t> tick)>;

  /// `address` and `certificates` of the daemon: see client::ClientOptions.
  StopPort(std::string address, std::string certificates);
  /// Gives up what is under way; its Done comes.
  ~StopPort();
  StopPort(const StopPort&) = delete;
  StopPort& operator=(const StopPort&) = delete;

  /// Stops; for any thread. `done` comes once, from this class's own thread.
  void stop(Done done);

 private:
  void run();

  const std::string address_;
  const std::string certificates_;
  const int cancelled_;
  Mutex mutex_;
  Condition changed_;
  std::vector<Done> waiting_ GUARDED_BY(mutex_);
  bool ends_ GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

/// Stops the rig for `caller` by both paths at once: the service, and the stop port. Any body stops; one that
/// cannot be read is the reason itself, in words. `bridge`: with a connection that no other call uses. While
/// the daemon is away, the service's stop waits for it, up to 5 s. `done` comes once, with the first answer:
/// that of SafetyService/Stop, and "path", by which it came; or with the service's refusal if neither came
/// through.
void stop(RpcBridge& bridge, StopPort& port, const Caller& caller, const StopBody& body, RpcBridge::Done done);

}  // namespace hapticd::console
