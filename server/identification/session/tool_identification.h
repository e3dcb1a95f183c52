#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "hal/rig.h"
#include "server/identification/estimate/tool_load_fit.h"
#include "server/identification/gate/sample_gate.h"
#include "server/identification/session/identification_session.h"
#include "server/identification/session/tasks.h"

namespace hapticd::identification {

/// Mass, centre of mass, biases and mounting of what hangs on the sensor, from free motion ((4.5)-(4.8)): the
/// tool is turned and waved while nothing touches it. What the motion did not show has an infinite standard
/// error; blocks of time that fit four times worse than the others (something was touched) are left out.
class ToolIdentification final : public IdentificationSession {
 public:
  ToolIdentification(const ToolTask& task, const hal::RigInfo& rig);

  void add(const rt::Observation& observation) override;

  static constexpr std::size_t kMaxBlocks = 128;  ///< when they are full, neighbours are joined

 private:
  void find(IdentificationProgress& progress) const override;
  std::optional<hal::Error> conclude(const IdentificationProgress& now,
                                     rt::IdentifiedModel& model) const override;

  struct Estimate {
    ToolLoadFit fit;
    std::size_t left_out = 0;
    std::size_t blocks = 0;
  };
  Estimate estimate(std::size_t blocks) const;
  /// Sums of all, stretch by stretch about its own mean but for the last: the sensor's zero drifts, and the
  /// bias wanted is that of the end.
  ToolMoments without_drift(const std::vector<ToolMoments>& blocks) const;
  std::vector<rt::EstimatedParameter> parameters(const ToolLoadFit& fit) const;

  std::uint64_t stride_;  ///< filtered ticks between two that are summed
  double summed_hz_;
  SampleGate gate_;
  ToolExcitationFilter filter_;
  double samples_per_block_;
  std::vector<ToolMoments> blocks_;    ///< the last one is being filled
  std::vector<ToolExcitation> shown_;  ///< a few, for the plot
  std::uint64_t show_every_ = 10;

  std::uint64_t filtered_ = 0, used_ = 0;
};

}  // namespace hapticd::identification
