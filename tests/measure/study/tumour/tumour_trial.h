#pragma once

#include <string>
#include <vector>

#include "rt/inclusion/inclusion_parameters.h"
#include "tests/measure/study/tumour/phantom_palpation.h"

namespace hapticd::study {

/// Force at the hand over the depth of the tip, both vertical, while pressing.
struct PressCurve {
  std::vector<double> depth_mm, force_n;
  double largest_jump_n = 0.0;   ///< second difference of the force from the device, tick to tick
  double largest_force_n = 0.0;  ///< of the device
  double energy_n_mm = 0.0;      ///< that the hand put in from the first to the last contact; ≥ 0 passive
};

/// The tumour of a phantom as identified, once a run.
struct IdentifiedTumour {
  identification::InclusionFit
      by_pair;  ///< response by two palpations straight over it (5.3), its place known: published
  identification::InclusionFit by_scan;  ///< place, response and how it falls off, by a scan of both phantoms
};
const IdentifiedTumour& identified_tumour(const char* phantom);

/// Presses the phantom with its real tumour; nothing is rendered.
PressCurve press_real(const char* phantom, const PhantomPress& press);
/// Presses the phantom without a tumour while inclusions are rendered.
PressCurve press_rendered(const std::vector<rt::InclusionParameters>& inclusions, const PhantomPress& press);
/// The scene that renders them: explore_bearing, the object as it is.
rt::SceneSpec inclusion_scene(const std::vector<rt::InclusionParameters>& inclusions);

/// rms of the difference of the forces at the same depth over the rms of the real one, while loading, from
/// 1 mm on.
double curve_error(const PressCurve& rendered, const PressCurve& real);

/// Presses of a scan: a grid of `spacing_mm` within `reach_mm` of the apex.
std::vector<PhantomPress> scan_presses(double reach_mm, double spacing_mm, double depth_mm);

}  // namespace hapticd::study
