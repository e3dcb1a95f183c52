#include "client/cli/view/live_state.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "client/cli/text/names.h"

namespace hapticd::cli {
namespace {

/// Each of these makes the force unusable; the worst first.
constexpr std::array kSensorFaults{v1::GUARD_FAULT_SENSOR_LOST, v1::GUARD_FAULT_SENSOR_STALE,
                                   v1::GUARD_FAULT_SENSOR_FAULT, v1::GUARD_FAULT_SENSOR_SATURATED,
                                   v1::GUARD_FAULT_SENSOR_FROZEN};
/// An older force counts as never received.
constexpr double kNeverMs = 1e9;
/// A smaller force is what a sensor reads of nothing.
constexpr double kNothingN = 0.02;

/// True if the bits have a fault, as in GuardGroup.faults_present_bits.
bool has_fault(std::uint32_t bits, v1::GuardFault fault) {
  return (bits >> static_cast<unsigned>(fault - v1::GUARD_FAULT_NONE) & 1U) != 0;
}

bool has_fault(const v1::RigState& state, v1::GuardFault fault) {
  for (const int present : state.faults_present()) {
    if (present == fault) return true;
  }
  return false;
}

template <class Present>
std::optional<v1::GuardFault> sensor_fault(const Present& present) {
  for (const v1::GuardFault fault : kSensorFaults) {
    if (has_fault(present, fault)) return fault;
  }
  return std::nullopt;
}

std::string sensor_words(v1::GuardFault fault, double force_age_ms) {
  const std::string name = spaced(word(fault));
  if (fault == v1::GUARD_FAULT_SENSOR_SATURATED) return "no usable force: " + name;
  if (force_age_ms >= kNeverMs) return fmt::format("no fresh force: none has come ({})", name);
  return fmt::format("no fresh force: the newest is {:.3g} ms old ({})", force_age_ms, name);
}

std::string contact_words(const LiveState& state) {
  switch (state.reason) {
    case v1::CONTACT_REASON_AWAITING_FREE:
      if (state.uses_sensor == false) return "waiting until the tool is outside the wall";
      if (std::abs(state.detection_force_n) < kNothingN)
        return "waiting to see the tool in free air: move it by some millimetres";
      return fmt::format("waiting until nothing touches the tool: {:.2f} N remain; move it in free air",
                         state.detection_force_n);
    case v1::CONTACT_REASON_WITHDRAWN:
      if (std::abs(state.detection_force_n) < kNothingN)
        return "what was felt was no object; nothing is felt any more";
      return fmt::format("what was felt was no object; waiting until {:.2f} N are gone",
                         state.detection_force_n);
    default:
      break;
  }
  if (!state.in_contact) return "";
  if (!*state.in_contact) return "free";
  if (state.authority >= 1.0) return "in contact";
  return fmt::format("in contact, {:.0f} % of the force so far: the object is not certain yet",
                     std::floor(100.0 * state.authority));
}

}  // namespace

LiveState live_state(const v1::RigState& state) {
  LiveState live;
  live.runs = state.loop().running();
  live.has_scene = !state.scene().empty();
  live.uses_sensor = state.zero_bound_n() > 0.0;
  live.sensor_fault = sensor_fault(state);
  live.force_age_ms = state.force_age_ms();
  live.guard = state.guard_state();
  live.guard_fault = state.guard_fault();
  live.biased = state.bias_serial() > 0;
  live.reason = state.contact_reason();
  if (live.reason != v1::CONTACT_REASON_UNSPECIFIED) live.in_contact = state.in_contact();
  live.detection_force_n = state.detection_force_n();
  live.authority = state.contact_authority();
  return live;
}

LiveState live_state(const v1::TelemetrySample& sample) {
  LiveState live;
  live.has_scene = sample.scene_generation() != 0;
  if (sample.has_zero()) live.uses_sensor = true;
  if (sample.has_guard()) {
    live.sensor_fault = sensor_fault(sample.guard().faults_present_bits());
    live.guard = sample.guard().state();
    live.guard_fault = sample.guard().fault();
  }
  if (sample.has_sample()) {
    live.force_age_ms = sample.sample().force_age_ms();
    live.biased = sample.sample().bias_serial() > 0;
  }
  if (sample.has_contact()) {
    live.in_contact = sample.contact().in_contact();
    live.reason = sample.contact().reason();
    live.detection_force_n = sample.contact().detection_force_n();
    live.authority = sample.contact().authority();
  } else if (sample.has_truth()) {
    live.in_contact = sample.truth().in_contact();
  }
  return live;
}

std::string words(const LiveState& state) {
  if (!state.runs) return "the loop does not run";
  if (!state.has_scene) return "no scene";
  if (state.sensor_fault) return sensor_words(*state.sensor_fault, state.force_age_ms);
  if (state.guard == v1::GUARD_STATE_LATCHED || state.guard == v1::GUARD_STATE_SUSPENDED) {
    return fmt::format("the guard holds the force back: {}, {}", spaced(word(state.guard)),
                       spaced(word(state.guard_fault)));
  }
  const std::string contact = contact_words(state);
  if (state.uses_sensor == true && state.biased == false) {
    return "sensor not biased" + (contact.empty() ? "" : ", so this is not certain: " + contact);
  }
  return contact;
}

namespace {
std::string bias_text(const v1::RigState& state) {
  if (!state.has_sensor_bias()) return fmt::format("bias {}", state.bias_serial());
  const auto now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  const double minutes = static_cast<double>(now - state.sensor_bias().taken_at_unix_s()) / 60.0;
  return fmt::format("the bias of {:.0f} min ago", std::max(0.0, minutes));
}
}  // namespace

std::string sensor_zero_words(const v1::RigState& state) {
  if (state.zero_bound_n() <= 0.0) return "not followed: no scene uses the force sensor";
  if (!state.sensor_bias_lost().empty()) {
    return "lost: the sensor restarted or counts in another way; hapticctl sensor bias, with the tool free "
           "and "
           "at rest";
  }
  if (state.bias_serial() == 0) return "not biased: hapticctl sensor bias, with the tool free and at rest";
  if (has_fault(state, v1::GUARD_FAULT_SENSOR_JUMPED)) {
    const v1::Vector3& jump = state.last_sensor_jump_n();
    return fmt::format(
        "the sensor's reading jumped by {:.2f} N: there is no force before the tool was moved by some "
        "millimetres in free air",
        std::hypot(jump.x(), jump.y(), jump.z()));
  }
  if (!state.has_followed_zero_n()) return "not followed while there is no usable force";
  const v1::Vector3& zero = state.followed_zero_n();
  const std::string followed =
      fmt::format("followed by {:.3f} N of at most {:g} N since {}", std::hypot(zero.x(), zero.y(), zero.z()),
                  state.zero_bound_n(), bias_text(state));
  if (has_fault(state, v1::GUARD_FAULT_SENSOR_ZERO_LOST)) {
    return followed + ": at the bound; hapticctl sensor bias, with the tool free and at rest";
  }
  if (has_fault(state, v1::GUARD_FAULT_SENSOR_ZERO_FAR)) {
    return followed +
           ": far, or it reads something in motion; hapticctl sensor bias, with the tool free and at rest";
  }
  return followed;
}

}  // namespace hapticd::cli
