#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "hal/replay/recording.h"
#include "hal/samples.h"
#include "rt/deformation/creep_law.h"
#include "tests/measure/study/common/recording_set.h"
#include "tests/measure/study/identify/contact_palpation.h"

namespace hapticd::study {

/// Reads a recording and takes off its bias; none, with a note, if it cannot be read.
std::optional<replay::Recording> load(const RecordingEntry& entry);

/// A tick of it as a rig gives it.
hal::RigSample sample_of(const replay::Recording& recording, std::size_t i);

/// Samples of a recording; whatever is above a millinewton counts as contact, a preload too.
Palpation palpation_of(const replay::Recording& recording);

/// The force of a law with memory at each sample, the object rested, its surface `surface_mm` deep.
std::vector<double> creep_force_n(const rt::CreepParameters& law, const Palpation& samples, double step_s,
                                  double surface_mm = 0.0);

/// What a law leaves of a force.
struct Squares {
  double left = 0.0, whole = 0.0;
  void add(const Palpation& samples, const std::vector<double>& force_n, double scale = 1.0) {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      left += std::pow(scale * force_n[i] - samples[i].normal_force_n, 2);
      whole += std::pow(samples[i].normal_force_n, 2);
    }
  }
  /// rms left over rms.
  double residual() const { return std::sqrt(left / whole); }
};

}  // namespace hapticd::study
