#include "tests/measure/study/rig/recording_analysis.h"

#include <algorithm>
#include <vector>

#include "rt/scene/compose.h"
#include "rt/scene/renderer.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::study {
namespace {

/// Least-squares slope of y over x, fed point by point.
class SlopeFit {
 public:
  void add(double x, double y) noexcept {
    ++count_;
    // About running means (Welford), so that a narrow span far from zero loses no digits.
    const double dx = x - mean_x_;
    mean_x_ += dx / count_;
    mean_y_ += (y - mean_y_) / count_;
    sxx_ += dx * (x - mean_x_);
    sxy_ += dx * (y - mean_y_);
  }
  double slope() const noexcept { return sxx_ > 0.0 ? sxy_ / sxx_ : 0.0; }

 private:
  double count_ = 0.0;
  double mean_x_ = 0.0;
  double mean_y_ = 0.0;
  double sxx_ = 0.0;
  double sxy_ = 0.0;
};

/// A recorded tick, as far as it is looked at afterwards.
struct Moment {
  double displacement_mm;
  double reaction_force_n;
};

}  // namespace

hal::Result<RecordingAnalysis> analyse_recording(const replay::ReplayConfig& recording,
                                                 double target_n_per_mm) {
  auto rig = replay::ReplayRig::open(recording);
  if (!rig) return rig.error();

  rt::SceneSpec spec;
  spec.name = "tap_1d";
  spec.kind = rt::SceneKind::kTap1d;
  spec.tool_mass_g = 0.0;
  // A testing machine's cell does not drift, and loads more slowly than a hand: below 2.5 mN/s its force
  // would be taken for drift.
  spec.contact.zero_bound_n = 0.0;
  spec.target.stiffness_n_per_mm = target_n_per_mm;
  const auto resolved = rt::resolve(spec, (*rig)->info());
  if (!resolved) return resolved.error();
  const auto pipeline = rt::compose(*resolved, (*rig)->info());
  if (!pipeline) return pipeline.error();

  rt::Renderer renderer(resolved->guard, (*rig)->info().rate_hz);
  renderer.exchange(pipeline->get(), resolved->guard);

  RecordingAnalysis analysis;
  std::vector<Moment> loading;  // from the first contact on, cut at the peak below
  std::size_t peak = 0;
  hal::RigSample sample;
  while (!(*rig)->exhausted()) {
    (*rig)->read(sample);
    rt::TickRecord record;
    renderer.tick(sample, record);
    if (record.guard_state == rt::GuardState::kLatched) {
      analysis.fault =
          "the guard latched at " + std::to_string(static_cast<double>(record.time_ns) / 1e9) + " s";
      break;
    }
    const double time_s = static_cast<double>(record.time_ns) / 1e9;
    analysis.contacts = static_cast<int>(record.contact_count);
    if (record.in_contact && !analysis.contact_time_s) {
      analysis.contact_time_s = time_s;
      analysis.contact_force_n = record.reaction_force_n;
    }
    if (record.reaction_force_n > analysis.peak_force_n) {
      analysis.peak_force_n = record.reaction_force_n;
      analysis.contacts_to_peak = analysis.contacts;
      peak = loading.size();
    }
    if (!analysis.contact_time_s) continue;
    loading.push_back({record.displacement_mm, record.reaction_force_n});
    if (record.in_contact && !analysis.loading && record.reaction_force_n >= kReadOffForceN) {
      LoadingPoint point;
      point.time_s = time_s;
      point.displacement_mm = record.displacement_mm;
      point.secant_stiffness_n_per_mm = record.reaction_force_n / record.displacement_mm;
      point.rendered_force_n = dot(record.device_command_n, resolved->press_axis);
      analysis.loading = point;
    }
  }
  loading.resize(std::min(loading.size(), peak + 1));

  SlopeFit fit;
  for (const Moment& moment : loading) {
    if (moment.reaction_force_n > 0.9 * kReadOffForceN && moment.reaction_force_n < 1.1 * kReadOffForceN) {
      fit.add(moment.displacement_mm, moment.reaction_force_n);
    }
  }
  if (analysis.loading) analysis.loading->local_stiffness_n_per_mm = fit.slope();
  return analysis;
}

}  // namespace hapticd::study
