#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/samples.h"
#include "hal/sim/simulated_rig.h"
#include "hal/sim/tracker/simulated_tracker.h"
#include "tests/emulators/openhaptics/page.h"
#include "tests/support/free_air_judge.h"

namespace hapticd::emulators {

struct BenchConfig {
  /// What is simulated; `real_time` and `rate_hz` are the bench's to set.
  sim::SimulationConfig simulation{};
  double rate_hz = 7000.0;  ///< of its turns: as fast as a Net F/T box measures
  /// Origin of the rig in the device's coordinates (vendor's frame).
  hal::Vector3 origin_mm{};
  /// How the simulated world lies in the rig's frame; of length 1. The tool turns with it.
  hal::Quaternion turn{};
  std::size_t page_device = 0;
  int truth_every = 7;                   ///< turns between two of the truths kept
  std::size_t truth_capacity = 600'000;  ///< ten minutes; memory is taken as it is filled
};

/// What was true at one turn. Frame of the simulated world: the rig's, unless the world is turned in it.
struct BenchTruth {
  std::int64_t monotonic_ns = 0;  ///< CLOCK_MONOTONIC
  std::int64_t time_ns = 0;       ///< of the simulation
  hal::TruthSample truth;
  hal::Vector3 encoder_position_mm;  ///< what the device's peer was shown
  hal::Vector3 sensor_force_n;       ///< what the sink was reported
  hal::Vector3 asked_force_n;        ///< what the device's peer asked for, before the device's own lag
};
static_assert(std::is_trivially_copyable_v<BenchTruth>);

/// The simulated physics between emulated peers: on one thread, several times per tick of the one who drives
/// the peers, the hand, the object, the tool and the sensor move on by the wall clock; the pose goes to the
/// page of the stand-in library, the sensor's reading to a sink (a Net F/T box, a board), and the force the
/// stand-in's device gives comes back. The simulated device adds its own latency of a millisecond.
class EmulatedBench {
 public:
  /// Called from the bench's thread with the sensor's reading, tool frame; must not block.
  using ForceSink = std::function<void(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm)>;
  /// What the world is coupled to. Called from the bench's thread, must not block; what is empty is not
  /// there. Rig frame, but for the sensor's load.
  struct Peers {
    std::function<void(const hal::Vector3& tip_mm, const hal::Quaternion& orientation,
                       const hal::DeviceAngles& angles)>
        pose;                               ///< encoders'
    std::function<hal::Vector3()> force_n;  ///< of the device on the tip
    ForceSink load;
    std::function<void(const hal::Vector3& tip_mm)> instrument;  ///< where an instrument from outside sees it
  };

  static hal::Result<std::unique_ptr<EmulatedBench>> create(const BenchConfig& config, Peers peers);
  /// The device of a page, which outlives them.
  static Peers peers_of(HdPage& page, const BenchConfig& config);
  /// The device is one of the page, which outlives the bench. An empty sink is none.
  static hal::Result<std::unique_ptr<EmulatedBench>> create(const BenchConfig& config, HdPage& page,
                                                            ForceSink sink);
  ~EmulatedBench();
  EmulatedBench(const EmulatedBench&) = delete;
  EmulatedBench& operator=(const EmulatedBench&) = delete;

  /// The world begins to move; it already shows its first pose.
  void start();
  /// The world is at rest; what was recorded stays.
  void stop();

  const hal::RigInfo& info() const noexcept;
  // Any thread, at any time; see SimulatedRig.
  std::optional<hal::Error> set_program(const sim::HandProgram& program);
  std::optional<hal::Error> set_object(const std::string& name);
  std::optional<hal::Error> happen(const sim::ObjectEvent& event);
  /// Force asked for in free air. Call it while the world is at rest.
  const test::FreeAirJudge& free_air() const noexcept;
  /// What a tracker of the tool has sent since the last call; frame of the simulated world, stamps of
  /// CLOCK_MONOTONIC but for what its own clock is off by. One thread. Empty if the conditions have none.
  std::vector<sim::TrackerPose> tracker_poses();

  // -- any thread, at any time
  /// How many truths are kept so far. Each is final once it is counted.
  std::size_t truth_count() const noexcept;
  BenchTruth truth(std::size_t index) const;
  std::vector<BenchTruth> truth_from(std::size_t index) const;
  /// The newest; nothing before the first.
  std::optional<BenchTruth> latest() const;
  std::uint64_t truths_lost() const noexcept;  ///< for want of capacity
  std::uint64_t turns() const noexcept;
  std::uint64_t turns_missed() const noexcept;  ///< the machine was late by more than a period
  /// Longest time that the world was held up: then the tool jumps as no arm does, and what is measured of it
  /// says nothing about the program under test.
  double longest_pause_ms() const noexcept;

 private:
  struct State;
  explicit EmulatedBench(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::emulators
