#pragma once

#include <functional>
#include <memory>

#include "hal/composed_rig.h"
#include "hal/phantom/phantom_device.h"
#include "hal/sim/simulated_rig.h"
#include "tests/emulated_rig/run.h"
#include "tests/emulators/board/scripted_board.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {

/// Rig without the vendor's library and without a box, in virtual time: the simulated physics between the
/// gauges, encoders and motors of a scripted board, ten times a tick; the sensor's driver with its
/// calibration file, the device's with its kinematics, currents and limits; the engine. Repeatable, but for
/// the device's watchdog, which has its own thread.
class BoardRig final : public Run {
 public:
  /// Throws std::runtime_error with the full complaint of the one who refused. The device is homed.
  explicit BoardRig(const RunConfig& config);
  ~BoardRig() override;

  void set_hand(const sim::HandProgram& program) override;
  rt::EngineOutcome execute(const rt::EngineCommand& command) override;

  emulators::ScriptedBoard& board() { return *board_; }
  phantom::PhantomDevice& device() { return *device_; }
  const hal::TruthSample& truth() const { return truth_; }

  /// Ticks after the turns of the world that belong to it; a late tick after more, those behind it after
  /// fewer.
  void tick();
  /// Lets time pass for the world and the board, without a tick.
  void pass_without_tick(double seconds);
  /// Done to the samples of the ticks to come; empty = nothing.
  void tamper(std::function<void(hal::RigSample&)> change) { tamper_ = std::move(change); }
  /// Force at the motors by the board's outputs, magnitude.
  double output_n() const;

 protected:
  void step() override { tick(); }
  double now_s() const override { return time_s_; }

 private:
  void place_arm(const RunConfig& config, phantom::PhantomConfig& arm);
  void move_world();

  TemporaryFolder folder_;
  std::unique_ptr<sim::SimulatedRig> world_;
  std::shared_ptr<emulators::ScriptedBoard> board_;
  phantom::PhantomDevice* device_ = nullptr;  ///< the composed rig's
  std::unique_ptr<hal::ComposedRig> composed_;
  std::function<void(hal::RigSample&)> tamper_;
  hal::TruthSample truth_;
  double instrument_v_per_mm_ = 0.0;
  std::vector<double> late_us_;
  std::size_t next_late_ = 0;
  double behind_us_ = 0.0;  ///< by how much the last tick was later than even
  std::int64_t started_ns_ = 0;
  double time_s_ = 0.0;
};

}  // namespace hapticd::test
