#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "hal/daq/board.h"
#include "hal/tip_instrument.h"

namespace hapticd::daq {

/// An LVDT, a dial gauge with an output, a laser: up to one input of the board for each axis of the rig.
struct BoardInstrumentConfig {
  /// Input channels that measure the tip along x, y and z of the rig; -1: none.
  std::array<double, 3> channels{-1.0, -1.0, -1.0};
  /// Motion of the tip along the axis for a rise of the reading by 1 V; negative if the reading falls.
  std::array<double, 3> mm_per_v{1.0, 1.0, 1.0};
  double engage_timeout_s = 3.0;  ///< for the first reading
};

/// Names the first invalid value: no channel along z (walls and objects are pressed along it), a channel
/// used twice or not a whole number, a scale of zero or beyond ±1000 mm/V.
std::optional<hal::Error> check(const BoardInstrumentConfig& config);

/// The board's channels that the instrument needs, for BoardConfig::spare_channels.
std::vector<double> channels_of(const BoardInstrumentConfig& config);

/// The tip's position from those inputs, mm: mean of the board's scans since the last tick. No reading
/// while no scan comes, or while an input is within 1 % of an end of its range: then the instrument is at
/// its stop or not connected.
class BoardInstrument final : public hal::TipInstrument {
 public:
  /// Opens nothing. Errors: check(), and a board that does not scan the channels.
  static hal::Result<std::unique_ptr<BoardInstrument>> create(const BoardInstrumentConfig& config,
                                                              std::shared_ptr<Board> board);
  ~BoardInstrument() override;

  std::optional<hal::Error> engage() override;
  void disengage() noexcept override;
  hal::PartReport report() const override;
  bool read(hal::Vector3& position_mm) noexcept override;

 private:
  struct State;
  explicit BoardInstrument(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::daq
