#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "hal/composed_rig.h"
#include "hal/sim/simulated_rig.h"
#include "rt/loop/periodic_loop.h"
#include "tests/emulated_rig/run.h"
#include "tests/emulators/bench/emulated_bench.h"
#include "tests/emulators/board/scripted_board.h"
#include "tests/emulators/netft/netft_box.h"
#include "tests/emulators/openhaptics/page.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {

struct EmulatedRigConfig : RunConfig {
  double stall_s = 0.1;  ///< see OpenHapticsConfig
  /// SCHED_FIFO for all threads of the peers and the drivers, if the machine grants it; 0 = ordinary.
  int fifo_priority = 40;
  bool sensor_on_board = false;  ///< the force sensor's gauges on an analog board, not a Net F/T box
};

/// The whole way live: simulated physics at 7 kHz, a Net F/T box over UDP and HTTP, the driver that reads it,
/// a PHANToM behind the stand-in for the vendor's library, whose scheduler is the clock, the driver that
/// loads it, both composed to a rig, the engine and the loop. Or a mix: the sensor on a board. One at a time
/// in a process: the library finds its page by the environment.
class EmulatedRig final : public Run {
 public:
  /// Throws std::runtime_error with the full complaint of the one who refused.
  explicit EmulatedRig(const EmulatedRigConfig& config);
  ~EmulatedRig() override;
  EmulatedRig(const EmulatedRig&) = delete;
  EmulatedRig& operator=(const EmulatedRig&) = delete;

  void set_hand(const sim::HandProgram& program) override;
  rt::EngineOutcome execute(const rt::EngineCommand& command) override;

  emulators::NetFtBox& box() { return *box_; }  ///< of a sensor that is not on the board
  emulators::HdPage& page() { return *page_; }
  emulators::EmulatedBench& bench() { return *bench_; }
  rt::LoopStatistics statistics() const { return loop_->statistics(); }

  /// Forgives stalls: while it does, samples that are old because this machine paused do not look old; by
  /// default it does not.
  void forgive_stalls(bool forgives) { forgives_.store(forgives); }
  std::uint64_t forgiven() const { return forgiven_.load(); }  ///< ticks

  /// Done once, on the bench's thread, just before the next record of the box is made.
  void before_record(std::function<void()> action);
  /// CLOCK_MONOTONIC when that record had been sent, or would have been; none yet.
  std::optional<std::int64_t> sent_ns() const noexcept;

 protected:
  void step() override;
  double now_s() const override;

 private:
  void feed(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm);

  TemporaryFolder folder_{memory_folder()};
  std::unique_ptr<emulators::HdPage> page_;
  std::unique_ptr<emulators::NetFtBox> box_;
  std::shared_ptr<emulators::ScriptedBoard> board_;  ///< of the sensor or of the instrument
  std::unique_ptr<emulators::EmulatedBench> bench_;
  std::unique_ptr<hal::ComposedRig> composed_;
  std::unique_ptr<rt::PeriodicLoop> loop_;

  std::atomic<bool> forgives_{false};
  std::atomic<std::uint64_t> forgiven_{0};
  std::mutex action_mutex_;
  std::function<void()> action_;
  std::atomic<bool> action_waits_{false};
  std::atomic<std::int64_t> sent_ns_{0};
};

}  // namespace hapticd::test
