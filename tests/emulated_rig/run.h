#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "hal/sim/hand/hand.h"
#include "hal/sim/simulated_rig.h"
#include "rt/loop/engine.h"
#include "rt/model/models.h"
#include "rt/record/tick_record.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/scene_spec.h"
#include "tests/emulated_rig/tapped_rig.h"

namespace hapticd::test {

struct RunConfig {
  sim::SimulationConfig simulation{};
  rt::SceneSpec scene{};
  const rt::ObjectModel* model = nullptr;  ///< of the object, if the scene needs one
  /// How the simulated world lies in the rig's frame, see BenchConfig::turn.
  hal::Quaternion turn{};
  /// Lateness of each tick against even times, over and over; empty = they are even.
  std::vector<double> late_us{};
  /// > 0: an instrument on the board sees the tip along x, y and z, with so many mm/V.
  double instrument_mm_per_v = 0.0;
};

/// A scene that is rendered on a rig of real drivers, with the simulated hand, object and tool behind the
/// emulated peers. What happens is read off the ticks' records; all from one thread.
class Run {
 public:
  virtual ~Run() = default;

  rt::Engine& engine() { return *engine_; }
  TappedRig& rig() { return *tapped_; }
  const rt::SceneSpec& scene() const { return scene_; }
  /// Throws std::runtime_error if it is refused.
  virtual void set_hand(const sim::HandProgram& program) = 0;

  /// Time passes until it comes true; false when it has not within so many seconds of the run.
  bool until(const std::function<bool()>& condition, double within_s);
  void pass(double seconds);
  /// Has the loop perform a command, and waits for it.
  virtual rt::EngineOutcome execute(const rt::EngineCommand& command) = 0;
  /// The guard's latch is left, if it can be.
  rt::EngineOutcome clear();
  /// The scene in force is exchanged for this one, without a model of the object; null: for none. Throws
  /// std::runtime_error if it is refused.
  void exchange(const rt::SceneSpec* scene);
  /// Whether records() grows; what is long and looks at something else needs none of them.
  void keep_records(bool keep) { keeps_records_ = keep; }
  const hal::RigInfo& rig_info() const { return tapped_->info(); }
  const hal::Quaternion& turn() const { return turn_; }  ///< of the world

  /// Records of all ticks of the engine so far, their numbers without a gap as long as whole() holds.
  const std::vector<rt::TickRecord>& records() const { return records_; }
  /// Index among them of the record of a tick.
  std::size_t place_of(std::uint64_t tick) const {
    return static_cast<std::size_t>(tick - records_.front().tick);
  }
  const rt::TickRecord& last() const { return records_.back(); }
  bool whole() { return engine().records_dropped() == 0; }

 protected:
  /// Once, of a rig whose parts are engaged. Throws std::runtime_error if the scene is refused.
  void compose(const RunConfig& config, hal::Rig& rig, std::function<double()> standing_n);

  /// Lets about a tick pass.
  virtual void step() = 0;
  /// The run's own seconds.
  virtual double now_s() const = 0;
  void drain();

 private:
  std::unique_ptr<TappedRig> tapped_;
  rt::SceneSpec scene_;
  std::unique_ptr<rt::Pipeline> pipeline_;
  std::unique_ptr<rt::Engine> engine_;
  std::vector<rt::TickRecord> records_;
  bool keeps_records_ = true;
  hal::Quaternion turn_;
};

double magnitude(const hal::Vector3& v) noexcept;

}  // namespace hapticd::test
