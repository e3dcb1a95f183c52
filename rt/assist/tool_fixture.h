#pragma once

#include <optional>
#include <string>

#include "hal/error.h"
#include "hal/samples.h"

namespace hapticd::rt {

/// Walls that keep a press in its place, as in D§3.4.1: the tool must not rise above the contact point (no
/// tapping), nor go aside.
struct FixtureParameters {
  double stiffness_n_per_mm = 0.5;
  double damping_n_s_per_mm = 0.002;
  double max_force_n = 2.0;  ///< of both walls together
  double ceiling_mm = 0.5;   ///< above the contact point, where the upper wall is
  double corridor_mm = 1.0;  ///< radius about the press line through the contact point
  double let_go_mm = 10.0;   ///< this far beyond a wall the tool is let go until the next contact

  bool operator==(const FixtureParameters&) const = default;
};
/// Nothing, or which value is outside its range.
std::optional<hal::Error> check(const FixtureParameters& parameters, const std::string& where);

/// Both walls only push, back to where the press is allowed, and never along the press: f = k d + b v min(1,
/// d/0.5 mm), d > 0 how deep the tip is in the wall and v >= 0 how fast it goes deeper. On the way out f = k
/// d max(0, 1 - |v|/(40 mm/s)): a tool that the hand lets go comes back slowly. So a cycle takes energy:
/// passive for b > k T/2 (0.00025 N·s/mm at 1 kHz). With the 7 ms of ToolSpeed it settles for 30 to 115 g.
class ToolFixture {
 public:
  /// `press_axis`: unit vector into the object.
  ToolFixture(const FixtureParameters& parameters, const hal::Vector3& press_axis) noexcept
      : parameters_(parameters), axis_(press_axis) {}

  struct Situation {
    hal::Vector3 tip_mm;
    hal::Vector3 velocity_mm_per_s;
    double interval_s = 0.0;  ///< since the last tick, > 0
    bool in_contact = false;
    bool is_withdrawn = false;  ///< the contact turned out to be none
    double displacement_mm = 0.0;
    bool is_guided = false;
    bool is_force_allowed = true;
  };
  /// Force on the tip, rig frame. Zero before a contact, and while the tool is guided.
  hal::Vector3 update(const Situation& now) noexcept;
  /// Forgets the contact: the next one is another one.
  void forget() noexcept { is_anchored_ = false; }

 private:
  static constexpr double kFadeS = 0.05;
  static constexpr double kFullDampingMm = 0.5;
  static constexpr double kReturnMmPerS = 40.0;

  hal::Vector3 walls_n(const Situation& now) noexcept;
  double push_n(double depth_mm, double speed_mm_per_s) const noexcept;

  FixtureParameters parameters_;
  hal::Vector3 axis_;
  bool is_anchored_ = false;
  bool is_first_contact_ = false;  ///< still the one whose point it is; a later one takes no walls away
  hal::Vector3 anchor_mm_;         ///< the contact point
  double share_ = 0.0;
  hal::Vector3 last_n_;  ///< before the share; what fades after it was let go
};

}  // namespace hapticd::rt
