#include "hal/openhaptics/device_report.h"

#include <cmath>
#include <cstdlib>
#include <string_view>

#include "hal/openhaptics/config_folder.h"
#include "hal/openhaptics/device_figures.h"
#include "hal/samples.h"
#include "hal/shown_text.h"

namespace hapticd::openhaptics {

namespace {

constexpr double kRateTolerance = 0.1;
constexpr std::int64_t kRecentNs = 2'000'000'000;

std::string connection_of(const OpenHapticsConfig& config, const DeviceFacts& facts) {
  if (facts.loaded_library.empty()) return {};
  std::string text =
      facts.loaded_library + ", " + (config.device_name.empty() ? "default device" : config.device_name);
  if (!facts.model_type.empty()) text += ", " + facts.vendor + " " + facts.model_type;
  if (!facts.serial_number.empty()) text += " " + facts.serial_number;
  if (!facts.driver_version.empty()) text += ", driver " + facts.driver_version;
  return text + ", " + hal::number_text(config.rate_hz, 5) + " Hz";
}

std::string how_to_calibrate(const DeviceFacts& facts) {
  if ((facts.calibration_styles & hd::kCalibrationInkwell) != 0) {
    return "put the stylus into its inkwell and hold it there for a second";
  }
  if ((facts.calibration_styles & hd::kCalibrationAuto) != 0)
    return "move the arm slowly through its workspace";
  if ((facts.calibration_styles & hd::kCalibrationEncoderReset) != 0) {
    return "put the arm into its reset position (all links at right angles), set reset_encoders = true and "
           "engage the device again";
  }
  return "calibrate it with the vendor's tool";
}

void find_of_model(const OpenHapticsConfig& config, const DeviceFacts& facts,
                   std::vector<std::string>& findings) {
  const auto known = device_figures(config.model);
  if ((known && !known->supported_on_linux) || names_high_force(facts.model_type)) {
    findings.push_back(
        "the vendor does not support High Force models on Linux: drive it through its encoders and "
        "amplifiers "
        "instead (the 'phantom' driver, hal/phantom)");
  }
}

void find_of_facts(const OpenHapticsConfig& config, const DeviceFacts& facts,
                   std::vector<std::string>& findings) {
  if (facts.max_force_n == 0.0 || facts.max_continuous_force_n == 0.0) {
    findings.push_back("the device does not show its force limits: those of the data sheet of " +
                       config.model + " hold; check that this is the model");
  }
  if (facts.max_force_n > 0.0 && config.max_force_n && *config.max_force_n > facts.max_force_n) {
    findings.push_back("max_force_n = " + hal::number_text(*config.max_force_n, 5) +
                       " N is beyond the device's " + hal::number_text(facts.max_force_n, 5) +
                       " N, which are used; lower it");
  }
  if (!facts.calibration_known) {
    findings.push_back(
        "the library cannot know whether the device is calibrated: it is taken as such; check with the "
        "vendor's tool");
  }
}

void find_of_servo(const OpenHapticsConfig& config, const DeviceView& view,
                   std::vector<std::string>& findings) {
  const ServoReport& servo = *view.servo;
  if (!servo.calibrated) findings.push_back("the device is not calibrated: " + how_to_calibrate(view.facts));
  if (servo.force_off || (!view.running && view.facts.output_stays_off)) {
    findings.push_back(
        "the device accepts no force, its output stays off: check its power and its emergency switch, then "
        "start "
        "again");
  }
  if (servo.wants_calibration_update) {
    findings.push_back(
        "the device requests an update of its calibration, which moves its position: done when it is "
        "engaged "
        "again");
  }
  for (int motor = 0; motor < servo.motors; ++motor) {
    const double share = servo.temperatures[static_cast<std::size_t>(motor)];
    if (share < config.warm_share) continue;
    findings.push_back("motor " + std::to_string(motor + 1) + " is at " + hal::number_text(100.0 * share, 5) +
                       " % of its rated temperature: let the motors cool down without force");
  }
  if (view.running && view.rate_hz > 0.0 && std::abs(view.rate_hz / config.rate_hz - 1.0) > kRateTolerance) {
    findings.push_back("the scheduler runs at " + hal::number_text(view.rate_hz, 5) + " Hz instead of " +
                       hal::number_text(config.rate_hz, 5) +
                       ": give the service real-time priority, or set a rate that the connection supports");
  }
}

bool find_of_errors(const DeviceErrorSlot& slot, std::vector<std::string>& findings) {
  bool unfit = false;
  const std::int64_t now_ns = hal::monotonic_ns();
  for (std::size_t index = 0; index < kHdErrorCount; ++index) {
    const std::int64_t seen_ns = slot.last_seen_ns[index];
    if (seen_ns == 0 || now_ns - seen_ns > kRecentNs) continue;
    const HdError& error = hd_errors()[index];
    findings.push_back(std::string(error.name) + " (" + std::to_string(slot.counts[index]) +
                       " times since engaged): " + std::string(error.remedy));
    unfit = unfit || (error.status & hal::sample_status::kDeviceFault) != 0;
  }
  return unfit;
}

/// The newest of what took the force from the device, if it is not a finding any more.
std::string last_fault_of(const DeviceView& view) {
  std::int64_t newest_ns = 0;
  std::string name, remedy;
  const auto take = [&](std::int64_t seen_ns, std::string_view what, std::string_view remedy_of) {
    if (seen_ns <= newest_ns) return;
    newest_ns = seen_ns;
    name = what;
    remedy = remedy_of;
  };
  for (std::size_t index = 0; index < kHdErrorCount; ++index) {
    const HdError& error = hd_errors()[index];
    if ((error.status & hal::sample_status::kDeviceFault) != 0)
      take(view.slot->last_seen_ns[index], error.name, error.remedy);
  }
  take(view.servo->last_stall_ns, "the vendor's scheduler did not call in time",
       "see what kept the machine busy; give the service real-time priority");
  take(view.servo->last_rejection_ns, "the device reported a position that it cannot have",
       "check its cables, then calibrate it");
  const std::int64_t age_ns = hal::monotonic_ns() - newest_ns;
  if (newest_ns == 0 || age_ns <= kRecentNs) return {};
  return name + ", " + hal::age_words(age_ns) + ": " + remedy;
}

void figures_of(const DeviceFacts& facts, std::vector<hal::PartFigure>& figures) {
  if (facts.loaded_library.empty()) return;
  figures.push_back({"device_max_force", facts.max_force_n, "N"});
  figures.push_back({"device_max_continuous_force", facts.max_continuous_force_n, "N"});
  figures.push_back({"device_max_stiffness", facts.max_stiffness_n_per_mm, "N/mm"});
  figures.push_back({"force_limit", facts.force_limit_n, "N"});
  figures.push_back({"force_ramping_rate", facts.force_ramping_rate_n_per_s, "N/s"});
  const auto flag = [&](const char* name, const std::optional<bool>& on) {
    if (on) figures.push_back({name, *on ? 1.0 : 0.0, "on/off"});
  };
  flag("force_ramping", facts.force_ramping);
  flag("max_force_clamping", facts.max_force_clamping);
  flag("software_force_limit", facts.software_force_limit);
}

void figures_of(const ServoReport& servo, std::vector<hal::PartFigure>& figures) {
  const auto count = [&](const char* name, std::uint64_t value) {
    figures.push_back({name, static_cast<double>(value), ""});
  };
  count("frames", servo.frames);
  count("scheduler_stalls", servo.stalls);
  count("commands_limited", servo.commands_limited);
  count("commands_not_finite", servo.commands_not_finite);
  count("positions_rejected", servo.positions_rejected);
  count("orientations_rejected", servo.orientations_rejected);
  count("error_stacks_overfull", servo.error_stacks_overfull);
  figures.push_back({"longest_period", 1e-6 * static_cast<double>(servo.longest_gap_ns), "ms"});
  for (int motor = 0; motor < servo.motors; ++motor) {
    const double share = servo.temperatures[static_cast<std::size_t>(motor)];
    if (share < 0.0) continue;
    figures.push_back(
        {"motor_" + std::to_string(motor + 1) + "_temperature", share, "of the rated temperature"});
  }
}

}  // namespace

hal::PartReport report_on(const OpenHapticsConfig& config, const DeviceView& view) {
  hal::PartReport report{"haptic device", "openhaptics", hal::PartState::kIdle, {}, {}, {}};
  bool unfit = false;
  find_of_model(config, view.facts, report.findings);
  if (!view.refusal.empty()) {
    report.findings.push_back(view.refusal);
    const std::string problem = config_folder_problem(std::getenv("GTDD_HOME"), std::getenv("HOME"));
    if (!problem.empty()) report.findings.push_back(problem);
  }
  if (view.engaged) {
    report.connection = connection_of(config, view.facts);
    find_of_facts(config, view.facts, report.findings);
    if (view.stalled) {
      report.findings.push_back(
          "the vendor's scheduler does not call: the device does not render the commanded force; "
          "check its connection");
    }
    if (view.lost) {
      report.findings.push_back("the vendor's scheduler was abandoned: engage the device again");
    }
    find_of_servo(config, view, report.findings);
    unfit = find_of_errors(*view.slot, report.findings);
    report.last_fault = last_fault_of(view);
  }
  if (view.servo != nullptr) {
    figures_of(view.facts, report.figures);
    if (view.running) report.figures.push_back({"scheduler_rate", view.rate_hz, "Hz"});
    figures_of(*view.servo, report.figures);
    for (std::size_t index = 0; index < kHdErrorCount; ++index) {
      if (view.slot->counts[index] == 0) continue;
      report.figures.push_back(
          {std::string(hd_errors()[index].name), static_cast<double>(view.slot->counts[index]), ""});
    }
  }
  if (!view.refusal.empty() || unfit || view.stalled || view.lost) {
    report.state = hal::PartState::kFaulty;
  } else if (view.engaged) {
    report.state = view.servo->calibrated ? hal::PartState::kReady : hal::PartState::kConnecting;
  }
  return report;
}

}  // namespace hapticd::openhaptics
