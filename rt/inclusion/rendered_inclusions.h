#pragma once

#include <cstddef>
#include <vector>

#include "hal/samples.h"
#include "rt/inclusion/inclusion_energy.h"
#include "rt/inclusion/inclusion_parameters.h"

namespace hapticd::rt {

/// The inclusions of a scene, a tick at a time.
class RenderedInclusions {
 public:
  explicit RenderedInclusions(const std::vector<InclusionParameters>& inclusions);

  /// Force on the tip of all of them together; `at.displacement_mm` 0 out of contact.
  hal::Vector3 update(const Indentation& at) noexcept;
  void reset() noexcept;

  /// Number of the inclusion that adds most.
  std::size_t strongest() const noexcept { return strongest_; }
  const hal::Vector3& strongest_place_mm() const noexcept { return strongest_place_mm_; }
  const hal::Vector3& force_n() const noexcept { return force_n_; }

 private:
  struct One {
    InclusionParameters parameters;
    hal::Vector3 moved_mm;
    hal::Vector3 friction_n;  ///< of the tissue on it
    double friction_stiffness_n_per_mm = 0.0;
  };
  static hal::Vector3 internal_friction_n(One& one, const Indentation& at, double added_n) noexcept;

  std::vector<One> all_;
  std::size_t strongest_ = 0;
  hal::Vector3 strongest_place_mm_;
  hal::Vector3 force_n_;
};

}  // namespace hapticd::rt
