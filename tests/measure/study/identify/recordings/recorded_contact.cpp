#include "tests/measure/study/identify/recordings/recorded_contact.h"

#include "server/identification/gate/palpation_tracker.h"
#include "tests/measure/report/report.h"
#include "tests/reference/creep_force.h"

namespace hapticd::study {

std::optional<replay::Recording> load(const RecordingEntry& entry) {
  auto recording = replay::load_recording(entry.config.path,
                                          {entry.config.time, entry.config.force, entry.config.position});
  if (!recording) {
    report::Report::note(recording.error().text());
    return std::nullopt;
  }
  if (const auto error = replay::remove_bias(*recording, entry.config.bias_s, entry.name)) {
    report::Report::note(error->text());
    return std::nullopt;
  }
  return std::move(*recording);
}

hal::RigSample sample_of(const replay::Recording& recording, std::size_t i) {
  hal::RigSample sample;
  sample.tick = i;
  sample.time_ns = std::llround(1e9 * recording.time_s[i]);
  sample.tip_position_mm = {0.0, 0.0, -recording.depth_mm[i]};
  sample.sensor_force_n = {0.0, 0.0, recording.force_n[i]};
  return sample;
}

Palpation palpation_of(const replay::Recording& recording) {
  constexpr double kTraceN = 1e-3;
  identification::RecordedPalpation tracker(kTraceN, 1.0 / recording.median_step_s);
  identification::PalpationSample sample;
  Palpation samples;
  for (std::size_t i = 0; i < recording.time_s.size(); ++i) {
    if (tracker.update(sample_of(recording, i), sample)) samples.push_back(sample);
  }
  return samples;
}

std::vector<double> creep_force_n(const rt::CreepParameters& law, const Palpation& samples, double step_s,
                                  double surface_mm) {
  identification::CreepForce inverse(law);
  std::vector<double> force_n;
  for (const identification::PalpationSample& s : samples) {
    force_n.push_back(inverse.update(s.displacement_mm - surface_mm, step_s));
  }
  return force_n;
}

}  // namespace hapticd::study
