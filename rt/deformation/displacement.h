#pragma once

#include <variant>

#include "hal/samples.h"
#include "rt/deformation/contact_law.h"
#include "rt/deformation/creep_law.h"
#include "rt/deformation/fused_displacement.h"
#include "rt/deformation/hunt_crossley.h"
#include "rt/signal/butterworth_low_pass.h"
#include "rt/signal/tick_interval.h"

namespace hapticd::rt {

/// The contact law of a scene; none if the displacement is found without.
using ContactLaw = std::variant<std::monostate, CreepLaw, HuntCrossleyParameters>;

/// (4.21): the particle that was touched, followed along the surface. Needs no law, and drifts.
struct RecursiveDisplacement {
  hal::Vector3 contacted_mm;
};

/// (4.23): the law of the force through a 60 Hz Butterworth filter.
struct InverseDisplacement {
  static constexpr double kCutoffHz = 60.0;
  ButterworthLowPass filter;
};

/// Method by which a scene finds the displacement, with its contact law. Estimates in contact; out of contact
/// it goes on counting along the last normal, to know where the surface was.
class Displacement {
 public:
  using Way = std::variant<FusedDisplacement, InverseDisplacement, RecursiveDisplacement>;

  Displacement(const Way& way, const ContactLaw& law) noexcept : path_(way), law_(law) {}

  /// Begins a contact that was seen to begin at `began_mm`; the tip is at `tip_mm` by now.
  /// `below_threshold_n`: force that may have gone unnoticed before.
  void begin(const hal::Vector3& began_mm, const hal::Vector3& tip_mm, const hal::Vector3& normal,
             double below_threshold_n) noexcept;
  /// Begins a contact whose beginning was not seen: the law says how deep the tip is.
  void begin_unseen(const hal::Vector3& tip_mm, double normal_n) noexcept;
  /// Advances by one tick in contact. The step is `inward_mm` along the normal *before* this tick's and
  /// `slide_mm` across it: a turn of the normal must not count as path, or an encoder that dithers would add
  /// up.
  void update(const hal::Vector3& tip_mm, double inward_mm, const hal::Vector3& slide_mm,
              const hal::Vector3& normal, double normal_n, double rate_mm_per_s,
              const TickInterval& interval) noexcept;
  /// Advances by one tick out of contact: `path_mm` into the object, and a force that may yet turn out to be
  /// a contact.
  void rest(double path_mm, double unexplained_n, const TickInterval& interval) noexcept;
  void reset() noexcept;

  bool has_law() const noexcept { return !std::holds_alternative<std::monostate>(law_); }
  double displacement_mm() const noexcept { return displacement_mm_; }
  /// Estimate of the law alone.
  const LawEstimate& by_law() const noexcept { return by_law_; }
  /// Deviation as the filter sees it; 0 if there is none.
  double deviation_mm() const noexcept;

 private:
  LawEstimate law_estimate(double normal_n, double rate_mm_per_s, double periods) noexcept;
  double displacement_below_threshold_mm(double below_threshold_n) const noexcept;
  void start(const hal::Vector3& began_mm, double deviation_mm, double min_deviation_mm) noexcept;

  Way path_;
  ContactLaw law_;
  LawEstimate by_law_;
  double displacement_mm_ = 0.0;
};

}  // namespace hapticd::rt
