#include "server/diagnosis/force_monitor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/geometry.h"

namespace hapticd::server {

namespace {

using enum FindingSeverity;

using geometry::norm;

constexpr const char* kForceSensor = "force sensor";
constexpr const char* kBiasRemedy = "hapticctl sensor bias, with the tool free and at rest";

/// "(0.00, 0.98, -0.17)"; a zero has no sign.
std::string text(const hal::Vector3& v) {
  const auto rounded = [](double value) { return std::round(100.0 * value) / 100.0 + 0.0; };
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", rounded(v.x), rounded(v.y), rounded(v.z));
}

}  // namespace

ForceMonitor::ForceMonitor(const rt::SceneSpec& resolved)
    : one_dimensional_(resolved.kind == rt::SceneKind::kTap1d),
      press_axis_(resolved.press_axis),
      zero_bound_n_(resolved.contact.zero_bound_n) {}

void ForceMonitor::add(const rt::TickRecord& record) {
  if (record.scene_generation != generation_) {
    generation_ = record.scene_generation;
    ticks_ = usable_ticks_ = 0;
    pressed_ticks_ = 0;
    pressed_sum_n_ = {};
  }
  ++ticks_;
  if ((record.channels & rt::channel::kZero) == 0) return;  // the samples were not fit for the scene
  ++usable_ticks_;
  last_ = record;
  const hal::Vector3 force_n = record.sensor_force_n - record.zero.force_n;
  if (norm(force_n) > kPressedN) add_pressed(record, force_n);
}

void ForceMonitor::add_pressed(const rt::TickRecord& record, const hal::Vector3& force_n) {
  const double depth_mm = dot(press_axis_, record.tip_position_mm);
  if (pressed_ticks_++ == 0) first_depth_mm_ = deepest_mm_ = depth_mm;
  deepest_mm_ = std::max(deepest_mm_, depth_mm);
  pressed_sum_n_ = pressed_sum_n_ + force_n;
}

Findings ForceMonitor::findings() const {
  if (ticks_ == 0) return {};
  if (usable_ticks_ == 0) {
    return {{kProblem, kForceSensor, "no usable force reached the scene while it was watched",
             "hapticctl status names what keeps it away"}};
  }
  Findings findings;
  if (last_.bias_serial == 0) {
    findings.push_back(
        {kWarning, kForceSensor, "was never biased: what it reads at rest is taken for a load", kBiasRemedy});
  }
  add_zero_findings(findings);
  if (last_.jump_count > 0) {
    const bool waits = (last_.faults_present & rt::set_of(rt::GuardFault::kSensorJumped)) != 0;
    findings.push_back(
        {kWarning, kForceSensor,
         fmt::format("its reading jumped by {:.2f} N without a load ({} jumps so far){}",
                     norm(last_.last_jump_n), last_.jump_count,
                     waits ? "; there is no force before the tool was moved in free air" : ""),
         "move the tool by some millimetres in free air; look who else biases the sensor, and at its cable "
         "and transducer"});
  }
  if (last_.withdrawn_count > 0) {
    findings.push_back(
        {kNote, kForceSensor,
         fmt::format("{} of {} contacts were taken back: what was felt was no object, but a wrong zero, a "
                     "wrong tool mass or late samples",
                     last_.withdrawn_count, last_.contact_count),
         "bias the sensor (hapticctl sensor bias), find the tool's mass (hapticctl identify tool), see the "
         "findings on the loop"});
  }
  // Without a bias a load at rest cannot be distinguished from a press.
  if (one_dimensional_ && last_.bias_serial != 0) findings.push_back(of_press());
  return findings;
}

void ForceMonitor::add_zero_findings(Findings& findings) const {
  const bool lost = (last_.faults_present & rt::set_of(rt::GuardFault::kSensorZeroLost)) != 0;
  const bool far = (last_.faults_present & rt::set_of(rt::GuardFault::kSensorZeroFar)) != 0;
  if (!lost && !far) return;
  const double followed_n = norm(last_.zero.force_n - last_.jump_n);
  if (!lost && followed_n < 0.5 * zero_bound_n_) {
    findings.push_back({kWarning, kForceSensor,
                        fmt::format("it reads {:.3f} N in motion while a free tool is waited for, so nothing is "
                                    "rendered",
                                    last_.contact_force_n),
                        kBiasRemedy});
    return;
  }
  findings.push_back(
      {lost ? kProblem : kWarning, kForceSensor,
       fmt::format("its zero has moved by {:.3f} N since the bias; it is followed up to {:g} N",
                   followed_n, zero_bound_n_),
       kBiasRemedy});
}

Finding ForceMonitor::of_press() const {
  const hal::Vector3 mean_n = pressed_sum_n_ * (1.0 / std::max(1U, pressed_ticks_));
  const double size_n = norm(mean_n);
  // A force that varies in all directions is the inertia of a heavy tool.
  if (pressed_ticks_ < kMinPressedTicks || size_n < kPressedN) {
    return {kNote, kForceSensor,
            "whether its force follows the press axis was not seen: the tool is not pressed",
            fmt::format("press onto an object until the sensor reads more than {:g} N, straight down the "
                        "press axis, while "
                        "hapticctl doctor runs",
                        kPressedN)};
  }
  const hal::Vector3 expected = press_axis_ * -1.0;  // an object pushes the tool back
  const double cosine = std::clamp(dot(mean_n, expected) / size_n, -1.0, 1.0);
  const double off_deg = std::acos(cosine) * 180.0 / std::numbers::pi;
  if (off_deg <= kMaxOffDeg) {
    return {kGood, kForceSensor,
            fmt::format("its force follows the press axis: {:.2f} N, {:.0f}° off it", size_n, off_deg), ""};
  }
  const bool wrong_sign = off_deg >= 180.0 - kMaxOffDeg;
  return {
      kProblem, kForceSensor,
      fmt::format("its force does not follow the press axis {}: pressed {:.2f} mm deeper, it reads {:.2f} "
                  "N along {}, {}, where an object pushes back along {}",
                  text(press_axis_), deepest_mm_ - first_depth_mm_, size_n, text(mean_n * (1.0 / size_n)),
                  wrong_sign ? std::string("the wrong sign") : fmt::format("{:.0f}° off", off_deg),
                  text(expected)),
      "press straight down the press axis and look again; if it stays, correct the sensor's axes in the "
      "rig file (axes = ... of the sensor's section), or the scene's press axis"};
}

}  // namespace hapticd::server
