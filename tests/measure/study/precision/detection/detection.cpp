#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "rt/contact/contact_detector.h"
#include "tests/measure/report/run_time.h"
#include "tests/measure/report/work_precision.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/precision/detection/contact_signals.h"
#include "tests/measure/study/precision/detection/detection_traces.h"

namespace hapticd::study {

namespace {

using report::fixed;
using report::significant;

constexpr double kRateHz = 1000.0;
constexpr double kEncoderMm = 0.03;
constexpr std::size_t kSettledTicks = 500;
constexpr double kSlowMmPerS = 25.0;  ///< slower than anybody taps: a careful touch
/// Thresholds over the one that is just free of false alarms.
constexpr double kQuietMultiples[] = {0.3, 0.4,  0.5, 0.55, 0.6, 0.65, 0.7, 0.75,
                                      0.8, 0.85, 0.9, 0.95, 1.0, 1.2,  1.5, 2.0};

/// A signal with the detector that all share.
template <class Signal>
class Detection {
 public:
  Detection(Signal signal, double threshold, double arming_time_ms)
      : signal_(std::move(signal)), detector_(parameters(threshold, arming_time_ms), kRateHz) {}

  bool update(const DetectionTick& tick) noexcept {
    const double value = signal_.update(tick, detector_.in_contact());
    const bool in_contact = detector_.update(value, tick.depth_mm, contact_depth_mm_);
    if (detector_.just_declared()) contact_depth_mm_ = tick.depth_mm;
    if (detector_.just_left_surface()) signal_.left_surface();
    return in_contact;
  }

 private:
  static rt::ContactParameters parameters(double threshold, double arming_time_ms) {
    rt::ContactParameters p;
    p.threshold_n = threshold;
    p.arming_time_ms = arming_time_ms;
    return p;
  }

  Signal signal_;
  rt::ContactDetector detector_;
  double contact_depth_mm_ = 0.0;
};

/// What a signal does in free motion: the largest it gets in each tenth of a second.
class FreeMotionPeaks {
 public:
  template <class Signal>
  FreeMotionPeaks(Signal signal, const std::vector<DetectionTick>& free_motion) {
    constexpr std::size_t kWindowTicks = 100;
    for (std::size_t k = 0; k < free_motion.size(); ++k) {
      const double value = std::abs(signal.update(free_motion[k], false));
      if (k < kSettledTicks) continue;
      if ((k - kSettledTicks) % kWindowTicks == 0) peaks_.push_back(0.0);
      peaks_.back() = std::max(peaks_.back(), value);
    }
  }
  /// The smallest threshold without a false alarm.
  double largest() const { return *std::max_element(peaks_.begin(), peaks_.end()); }
  /// Tenths of a second with an alarm: a count that falls with the threshold whatever the detector makes of
  /// a force that never rests.
  std::size_t alarms(double threshold) const {
    return static_cast<std::size_t>(
        std::count_if(peaks_.begin(), peaks_.end(), [&](double peak) { return peak > threshold; }));
  }

 private:
  std::vector<double> peaks_;
};

struct Delays {
  std::vector<double> ms;
  int missed = 0;  ///< never declared while it lasted; counted with how long it lasted
  int early = 0;   ///< contact was declared before it was one; there is no delay then

  double mean_ms() const {
    double sum = 0.0;
    for (const double d : ms) sum += d;
    return ms.empty() ? std::nan("") : sum / static_cast<double>(ms.size());
  }
  double largest_ms() const { return ms.empty() ? std::nan("") : *std::max_element(ms.begin(), ms.end()); }
  /// Whether most strikes have a delay: if alarms are the rule, the rest says nothing.
  bool shows() const { return ms.size() > static_cast<std::size_t>(2 * early); }
};

template <class Signal>
void add_delays(const Signal& signal, const TappedTrace& trace, double threshold, Delays& delays) {
  Detection<Signal> detection(signal, threshold, rt::ContactParameters{}.arming_time_ms);
  std::vector<bool> declared;
  for (const DetectionTick& tick : trace.ticks) declared.push_back(detection.update(tick));
  for (const Strike& strike : trace.strikes) {
    if (declared[strike.first_tick - 1]) {
      ++delays.early;
      continue;
    }
    std::size_t k = strike.first_tick;
    while (k < strike.last_tick && !declared[k]) ++k;
    if (!declared[k]) ++delays.missed;
    delays.ms.push_back(1e-6 * static_cast<double>(trace.ticks[k].time_ns) - strike.began_ms);
  }
}

struct Data {
  std::vector<DetectionTick> free_motion;
  std::vector<DetectionTick> other_free_motion;  ///< another seed: does the threshold hold?
  std::vector<TappedTrace> taps;
  std::vector<TappedTrace> slow_taps;

  double minutes() const {
    return static_cast<double>(free_motion.size() - kSettledTicks) / (60.0 * kRateHz);
  }
};

template <class Signal>
Delays delays_of(const Signal& signal, const Data& data, double threshold) {
  Delays delays;
  for (const TappedTrace& trace : data.taps) add_delays(signal, trace, threshold, delays);
  return delays;
}

struct CurvePoint {
  double delay_ms, alarms_per_min;
};

struct MethodResult {
  std::string name;
  bool is_default = false;
  double quiet_threshold = 0.0;
  std::size_t alarms_again = 0;  ///< tenths of a second with an alarm, in the other free motion
  Delays delays;                 ///< at the quiet threshold
  std::map<std::string, Delays> by_object;
  Delays slow;  ///< touched slowly
  std::vector<CurvePoint> curve;
  double run_time_ns = 0.0;
};

template <class Signal>
MethodResult measured(const std::string& name, const Signal& signal, const Data& data, double seconds) {
  MethodResult result;
  result.name = name;
  const FreeMotionPeaks peaks(signal, data.free_motion);
  result.quiet_threshold = peaks.largest();
  result.alarms_again = FreeMotionPeaks(signal, data.other_free_motion).alarms(result.quiet_threshold);
  for (const double multiple : kQuietMultiples) {
    const double threshold = multiple * result.quiet_threshold;
    const Delays delays = delays_of(signal, data, threshold);
    if (multiple == 1.0) result.delays = delays;
    if (!delays.shows()) continue;
    result.curve.push_back({delays.mean_ms(), static_cast<double>(peaks.alarms(threshold)) / data.minutes()});
  }
  for (const TappedTrace& trace : data.taps) {
    add_delays(signal, trace, result.quiet_threshold, result.by_object[trace.object]);
  }
  for (const TappedTrace& trace : data.slow_taps) {
    add_delays(signal, trace, result.quiet_threshold, result.slow);
  }
  const std::size_t timed = std::min<std::size_t>(data.free_motion.size(), 20'000);
  result.run_time_ns = report::run_time_ns(
      timed,
      [&] {
        Detection<Signal> detection(signal, result.quiet_threshold, 1);
        std::uint32_t sum = 0;
        for (std::size_t k = 0; k < timed; ++k) sum += detection.update(data.free_motion[k]) ? 1U : 0U;
        return sum;
      },
      seconds);
  return result;
}

std::vector<MethodResult> measure_all(const Data& data, double seconds) {
  std::vector<MethodResult> all;
  all.push_back(measured("matched inertia", MatchedInertia(kRateHz), data, seconds));
  all.back().is_default = true;
  all.push_back(measured("published (3.4)", PublishedReaction(kEncoderMm, kRateHz), data, seconds));
  all.push_back(measured("raw force", RawForce{}, data, seconds));
  return all;
}

void show_curves(StudyContext& context, const std::vector<MethodResult>& all, const Data& data) {
  report::Plot plot;
  plot.title = "Contact: delay of detection against false alarms (after D Fig. 3.4)";
  plot.x = {"mean delay of detection, taps at 100-800 mm/s", "ms"};
  plot.x.minimum = 0.0;
  plot.y = {"tenths of a second with a false alarm, plus 0.1", "1/min", true};
  for (const MethodResult& method : all) {
    report::PlotSeries series{method.name + (method.is_default ? " (default)" : "")};
    series.mark = report::PlotMark::kOfColor;
    for (const CurvePoint& point : method.curve) {
      series.add(point.delay_ms, point.alarms_per_min + 0.1);
    }
    plot.series.push_back(series);
  }
  context.report.add_plot("detection_curves", plot);

  std::vector<std::string> headers{
      "method", "ε_f without alarm", "alarms, other seed", "mean ms", "largest ms", "missed", "early"};
  for (const auto& [object, delays] : all.front().by_object) headers.push_back(object + " ms");
  headers.push_back("at " + fixed(kSlowMmPerS, 0) + " mm/s ms");
  report::MarkdownTable table(headers);
  for (const MethodResult& method : all) {
    std::vector<std::string> row{method.name + (method.is_default ? " (default)" : ""),
                                 fixed(1e3 * method.quiet_threshold, 1) + " mN",
                                 std::to_string(method.alarms_again),
                                 fixed(method.delays.mean_ms(), 2),
                                 fixed(method.delays.largest_ms(), 1),
                                 std::to_string(method.delays.missed),
                                 std::to_string(method.delays.early)};
    for (const auto& [object, delays] : method.by_object) row.push_back(fixed(delays.mean_ms(), 2));
    row.push_back(fixed(method.slow.mean_ms(), 1) +
                  (method.slow.missed > 0 ? ", " + std::to_string(method.slow.missed) + " missed" : ""));
    table.add_row(row);
  }
  context.report.add_table("detection_quiet", "Contact: at the smallest threshold without a false alarm",
                           table,
                           "Other seed: tenths of a second with an alarm at the same threshold in another " +
                               fixed(data.minutes(), 1) +
                               " min. Missed: never declared; counted with how long the contact lasted. "
                               "Early: declared in flight, "
                               "no delay.");
}

/// What taps do not part.
void say_careful(StudyContext& context, const std::vector<MethodResult>& all) {
  constexpr double kPromptMs = 2.0;
  const auto prompt = std::count_if(all.begin(), all.end(),
                                    [](const MethodResult& m) { return m.delays.mean_ms() <= kPromptMs; });
  std::string careful;
  for (const MethodResult& method : all) {
    careful += (careful.empty() ? "" : "; ") + method.name + ": " + fixed(method.slow.mean_ms(), 0) + " ms" +
               (method.slow.missed > 0 ? ", " + std::to_string(method.slow.missed) + " missed" : "");
  }
  context.report.say("Struck at 100 mm/s and more, " + std::to_string(prompt) + " of " +
                     std::to_string(all.size()) + " signals see the object within " + fixed(kPromptMs, 0) +
                     " ms on average. A careful touch at " + fixed(kSlowMmPerS, 0) + " mm/s parts them. " +
                     careful + ".");
}

/// The shipped threshold is not the smallest one.
void say_shipped(StudyContext& context, const Data& data) {
  const double shipped_n = rt::ContactParameters{}.threshold_n;
  const MatchedInertia signal(kRateHz);
  const Delays delays = delays_of(signal, data, shipped_n);
  context.report.say("The default ships with ε_f = " + fixed(1e3 * shipped_n, 0) + " mN, " +
                     fixed(shipped_n / FreeMotionPeaks(signal, data.free_motion).largest(), 1) +
                     " times what shaking asks for, as a margin for other motions and tools: " +
                     fixed(delays.mean_ms(), 2) + " ms on the same taps (largest " +
                     fixed(delays.largest_ms(), 1) + " ms), of which half a tick is sampling.");
}

}  // namespace

void run_detection_precision(StudyContext& context) {
  const double shaken_s = context.quick ? 30.0 : 600.0;
  const int taps = context.quick ? 3 : 12;
  Data data{shaken_trace(shaken_s, 1), shaken_trace(shaken_s, 2), {}, {}};
  std::uint64_t seed = 10;
  for (const std::string object : {"sponge_block", "foam_ball", "rubber_ball", "rubber_eraser"}) {
    for (const double speed : {100.0, 200.0, 400.0, 800.0}) {
      if (context.quick && (speed == 200.0 || speed == 800.0)) continue;
      data.taps.push_back(tapped_trace(object, speed, taps, ++seed));
    }
    data.slow_taps.push_back(tapped_trace(object, kSlowMmPerS, taps, ++seed));
  }
  const std::vector<MethodResult> all = measure_all(data, context.quick ? 0.01 : 0.2);

  report::WorkPrecision stage;
  stage.stage = "contact_detection";
  stage.error_name = "mean delay without false alarms";
  stage.error_unit = "ms";
  stage.logarithmic_error = false;
  std::size_t strikes = 0;
  for (const TappedTrace& trace : data.taps) strikes += trace.strikes.size();
  stage.remark =
      fixed(shaken_s, 0) +
      " s of free motion, shaken at 5 Hz and 1 N (seed 1), give each method the smallest threshold "
      "without a false alarm; at it, " +
      std::to_string(strikes) +
      " taps on sponge, foam, rubber ball and eraser at 100-800 mm/s give the delay, from the true "
      "instant of contact to the tick that declares it. PHANToM 1.0, 1 kHz, one axis; the same "
      "detector behind every signal. ";
  stage.justification = "what is cheaper waits longer, on taps or on a careful touch.";
  for (const MethodResult& method : all) {
    stage.methods.push_back(
        {method.name, method.delays.mean_ms(), method.run_time_ns, method.is_default, {}});
    if (!method.delays.shows()) {
      stage.methods.back().failed = "declares contact in flight: most taps have no delay";
    }
  }
  add_stage(context.report, stage);
  show_curves(context, all, data);
  say_careful(context, all);
  say_shipped(context, data);
}

}  // namespace hapticd::study
