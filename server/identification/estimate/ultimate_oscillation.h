#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace hapticd::identification {

/// Tells a sustained oscillation from one that dies away, within a few cycles: half-cycles of a signal about
/// its slow mean that keep their size, keep their length and are larger than what hand and encoder do by
/// themselves.
class UltimateOscillation {
 public:
  /// Makes a detector. Half-cycles smaller than `least` (amplitude, in the signal's unit) do not count; those
  /// greater than `violent` that still grow are reported at once.
  UltimateOscillation(double rate_hz, double least, double violent) noexcept;

  void update(double value) noexcept;
  void reset() noexcept;

  bool sustained() const noexcept { return sustained_; }
  /// True if it grows beyond anything tolerable: do not wait for more cycles.
  bool violent() const noexcept { return violent_; }
  /// Number of half-cycles in a row, whether they keep their size or not.
  std::size_t swings() const noexcept { return count_; }
  /// Period of the oscillation found, else of the last half-cycles; 0 while there are none.
  double period_s() const noexcept;
  double amplitude() const noexcept { return amplitude_; }

  static constexpr double kMinHz = 4.0;  ///< slower is the hand
  static constexpr double kMaxHz = 160.0;
  static constexpr double kKeeps = 0.85;   ///< share of its size that it keeps over three half-cycles
  static constexpr double kRegular = 1.7;  ///< longest over shortest half-cycle

 private:
  static constexpr std::size_t kHalves = 8;
  struct Half {
    double amplitude = 0.0;
    double duration_s = 0.0;
  };
  void judge() noexcept;

  double period_tick_s_;
  double least_;
  double violent_size_;
  double slow_share_;
  bool started_ = false;
  double slow_ = 0.0;
  double last_ = 0.0;
  double since_s_ = 0.0;
  double extreme_ = 0.0;
  std::array<Half, kHalves> halves_{};
  std::size_t count_ = 0;
  bool sustained_ = false;
  bool violent_ = false;
  double period_s_ = 0.0;
  double amplitude_ = 0.0;
};

}  // namespace hapticd::identification
