#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "hal/samples.h"
#include "tests/integration/running_service.h"

namespace hapticd::test {

/// Commands that went to the device, tick by tick, as a subscriber sees them; kept by a separate thread until
/// stop().
class CommandRecord {
 public:
  struct Tick {
    std::int64_t time_ns = 0;
    hal::Vector3 force_n;
    v1::GuardState state = v1::GUARD_STATE_UNSPECIFIED;
    double target_n_per_mm = 0.0;
    double displacement_mm = 0.0;
  };

  explicit CommandRecord(const std::shared_ptr<grpc::Channel>& channel);
  ~CommandRecord();
  CommandRecord(const CommandRecord&) = delete;
  CommandRecord& operator=(const CommandRecord&) = delete;

  /// The first tick from `from` on in which the guard is latched; waits for it.
  std::uint64_t await_latched(std::uint64_t from);
  /// Waits for a tick.
  void await_tick(std::uint64_t tick);
  std::uint64_t last_tick();
  /// Ends the stream and returns what came.
  std::map<std::uint64_t, Tick> stop();
  /// Reads until the service ends the stream, and returns what came.
  std::map<std::uint64_t, Tick> read_to_the_end();

 private:
  template <class Found>
  std::uint64_t await(std::uint64_t from, Found found);

  std::unique_ptr<v1::TelemetryService::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::TelemetryBatch>> reader_;
  std::mutex mutex_;
  std::map<std::uint64_t, Tick> ticks_;
  std::thread thread_;
};

/// The largest change of the command between two ticks that follow each other while the guard renders, and
/// what was commanded around it.
struct LargestStep {
  double step_n = 0.0;
  std::string around;
};
LargestStep largest_step(const std::map<std::uint64_t, CommandRecord::Tick>& ticks);

}  // namespace hapticd::test
