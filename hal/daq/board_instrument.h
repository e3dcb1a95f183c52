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
  /// Input channels that see the tip along x, y and z of the rig; -1: none.
  std::array<double, 3> channels{-1.0, -1.0, -1.0};
  /// How far the tip has moved along the axis where the reading has grown by 1 V; negative where it falls.
  std::array<double, 3> mm_per_v{1.0, 1.0, 1.0};
  double engage_timeout_s = 3.0;  ///< for the first reading to come
};

/// The first value that makes no sense, by name: no channel along z (walls and objects are pressed along it),
/// a channel twice or not whole, a scale of zero or beyond ±1000 mm/V.
std::optional<hal::Error> check(const BoardInstrumentConfig& config);

/// The board's channels that it needs, for BoardConfig::spare_channels.
std::vector<double> channels_of(const BoardInstrumentConfig& config);

/// The tip's position by those inputs, mean of the board's scans since the last tick. There is no reading
/// while no scan comes, and none where an input is within 1 % of an end of its range: the instrument is at
/// its stop there, or not connected.
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
