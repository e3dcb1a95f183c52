#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "rt/signal/tool_load.h"
#include "rt/signal/vector.h"
#include "server/identification/estimate/tool_load_fit.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/recording_set.h"
#include "tests/measure/study/identify/recordings/handover_recording.h"

namespace hapticd::study {

namespace {

constexpr const char* kSet = "six_axis_handover";
constexpr double kRateHz = 120.0;
constexpr double kFittedUntilS = 2.2;  // the free part that compensation and threshold are found from
constexpr double kGripS = 3.1;         // the grip's start, from the recording's own description
constexpr double kSettledS = 0.3;      // filters and windows are full
constexpr double kStepN = 0.001;       // by which a threshold is raised
constexpr std::size_t kBaseline = 0;   // window of an acceleration that is not used

double time_s(const hal::RigSample& sample) {
  return 1e-9 * static_cast<double>(sample.time_ns);
}

/// Acceleration of the last `window` positions, by a parabola: only the past, late by half the window.
hal::Vector3 past_acceleration(const std::vector<hal::RigSample>& samples, std::size_t i,
                               std::size_t window) {
  if (window == kBaseline || i + 1 < window) return {};
  double square = 0.0, fourth = 0.0;
  hal::Vector3 moment, sum;
  const double middle = 0.5 * (static_cast<double>(window) - 1.0);
  for (std::size_t k = 0; k < window; ++k) {
    const double t = (static_cast<double>(k) - middle) / kRateHz;
    const hal::Vector3& p = samples[i + 1 - window + k].tip_position_mm;
    square += t * t;
    fourth += t * t * t * t;
    moment = moment + p * (t * t);
    sum = sum + p;
  }
  const double n = static_cast<double>(window);
  return (moment - sum * (square / n)) * (2.0 / (fourth - square * square / n));
}

/// What the tool does not explain, N, at each sample, from samples up to that one only.
std::vector<double> residuals_n(const std::vector<hal::RigSample>& samples,
                                const identification::ToolLoadFit& tool, std::size_t window) {
  const auto inverse = [](const hal::Quaternion& q) { return hal::Quaternion{q.w, -q.x, -q.y, -q.z}; };
  std::vector<double> residuals;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const hal::Vector3 pull =
        hal::Vector3{0.0, 0.0, -rt::ToolLoad::kGravityMmPerS2} - past_acceleration(samples, i, window);
    const hal::Vector3 in_tool =
        rt::rotated(inverse(rt::unit(samples[i].tip_orientation)), pull) * (1e-6 * tool.mass_g);
    const hal::Vector3 expected = rt::rotated(inverse(tool.sensor_to_tool), in_tool) + tool.force_bias_n;
    residuals.push_back(rt::norm(samples[i].sensor_force_n - expected));
  }
  return residuals;
}

/// D§3.2.2: the smallest threshold, raised by steps, without a false alarm in the fitted part.
double smallest_threshold_n(const std::vector<hal::RigSample>& samples,
                            const std::vector<double>& residuals) {
  double greatest = 0.0;
  for (std::size_t i = 0; i < samples.size() && time_s(samples[i]) < kFittedUntilS; ++i) {
    if (time_s(samples[i]) >= kSettledS) greatest = std::max(greatest, residuals[i]);
  }
  return kStepN * std::ceil(greatest / kStepN);
}

double rms_n(const std::vector<hal::RigSample>& samples, const std::vector<double>& values, double from_s,
             double until_s) {
  double square = 0.0, count = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (time_s(samples[i]) < from_s || time_s(samples[i]) >= until_s) continue;
    square += values[i] * values[i];
    count += 1.0;
  }
  return std::sqrt(square / count);
}

}  // namespace

void run_identify_handover(StudyContext& context) {
  report::Figure alarms_figure{"recording_false_alarms", {{"set", kSet}}};
  alarms_figure.goal = 0.0;
  report::Figure detection_figure{"recording_detection_samples", {{"set", kSet}}};
  detection_figure.goal = 2.0;
  const auto fail = [&](const std::string& why) {
    alarms_figure.failed = detection_figure.failed = why;
    context.report.add(alarms_figure);
    context.report.add(detection_figure);
    report::Report::note("handover: " + why);
  };
  const auto folder = recordings_folder();
  if (!folder) return fail(no_recordings_reason());
  const std::string path = (*folder / kSet / "taker.csv").string();

  struct Candidate {
    std::vector<hal::RigSample> samples;
    identification::ToolLoadFit tool;
  };
  std::optional<Candidate> best;
  for (const QuaternionReading& reading : quaternion_readings()) {
    auto loaded = load_handover(path, reading);
    if (!loaded) return fail(loaded.error().text());
    identification::ToolExcitationFilter filter(kRateHz, false);
    identification::ToolMoments fitted;
    for (const hal::RigSample& sample : *loaded) {
      const auto excitation = filter.update(sample);
      if (excitation && time_s(sample) < kFittedUntilS) fitted.add(*excitation);
    }
    // Two seconds of slow turns say no arm.
    const identification::ToolLoadFit tool =
        identification::fit_tool_load(fitted, {.turning = false, .start = {}});
    if (!best || tool.residual < best->tool.residual) best = Candidate{*loaded, tool};
  }
  const std::vector<hal::RigSample>& samples = best->samples;
  // Inertia only as far as it helps where it is fitted.
  std::size_t window = kBaseline;
  double least = HUGE_VAL;
  const std::array<std::size_t, 3> windows{kBaseline, 13, 25};
  for (const std::size_t candidate : windows) {
    const std::vector<double> r = residuals_n(samples, best->tool, candidate);
    const double fitted_rms = rms_n(samples, r, kSettledS, kFittedUntilS);
    if (fitted_rms < least) {
      least = fitted_rms;
      window = candidate;
    }
  }
  std::size_t start = 0;
  while (start < samples.size() && time_s(samples[start]) < kGripS - 1e-9) ++start;
  const std::vector<double> residuals = residuals_n(samples, best->tool, window);
  const double threshold_n = smallest_threshold_n(samples, residuals);
  int alarms = 0;
  std::size_t reported = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (time_s(samples[i]) < kSettledS || residuals[i] <= threshold_n) continue;
    if (i < start) ++alarms;
    if (i >= start && reported == 0) reported = i;
  }
  alarms_figure.value = alarms;
  alarms_figure.source = "before the grip at 3.1 s; tool and threshold from 0-2.2 s; rule of D§3.2.2";
  context.report.add(alarms_figure);
  if (reported != 0) {
    detection_figure.value = static_cast<double>(reported - start);
  } else {
    detection_figure.failed = "the grip is never reported";
  }
  detection_figure.source = "first sample at or after 3.1 s, as the recording is described";
  context.report.add(detection_figure);
}

}  // namespace hapticd::study
