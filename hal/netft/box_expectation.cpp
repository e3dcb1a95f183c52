#include "hal/netft/box_expectation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "hal/nano17_calibration.h"
#include "hal/shown_text.h"

namespace hapticd::netft {

namespace {

/// The calibrations of a Nano17 differ by factors of two, imperial ones from metric ones by 12 %.
constexpr double kSameRange = 1.4;
/// A first-order low pass below this delays by more than half a period of a 1 kHz loop.
constexpr double kPromptHz = 320.0;

std::array<double, 6> ranges_of(const hal::Nano17Calibration& c) {
  return {c.range_across_n,    c.range_across_n,    c.range_along_n,
          c.range_torque_n_mm, c.range_torque_n_mm, c.range_torque_n_mm};
}

}  // namespace

std::optional<hal::Error> refuse_box(const BoxConfiguration& box, const NetFtConfig& config) {
  const std::string where = "Net F/T box " + config.address;
  if (!config.serial.empty() && box.calibration_serial != config.serial) {
    return hal::Error{.what = "the active calibration of the box is not the expected one",
                      .where = where + ", cfgcalsn",
                      .value = "'" + box.calibration_serial.substr(0, 40) + "'",
                      .limit = "'" + config.serial + "'",
                      .remedy =
                          "select it on the box's configuration page, or connect that sensor, or correct "
                          "'serial'"};
  }
  const auto calibration = hal::find_nano17_calibration(config.model, "[rig.netft] model");
  if (!calibration) return calibration.error();
  if (box.ranges) {
    constexpr std::array<const char*, 6> kAxes{"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"};
    const std::array<double, 6> expected = ranges_of(*calibration);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const double range = (*box.ranges)[i];
      if (range == 0.0) continue;  // not reported
      if (range < expected[i] * kSameRange && range > expected[i] / kSameRange) continue;
      const char* unit = i < 3 ? " N" : " N·mm";
      return hal::Error{.what = std::string("the calibration of the box is not that of a ") +
                                std::string(calibration->name) + ": the range of " + kAxes[i] + " differs",
                        .where = where + ", cfgmr",
                        .value = hal::number_text(range) + unit,
                        .limit = "about " + hal::number_text(expected[i]) + unit,
                        .remedy = "select the right calibration on the box, or correct 'model'"};
    }
  }
  if (box.rdt_enabled && !*box.rdt_enabled) {
    return hal::Error{.what = "the RDT interface of the box is switched off",
                      .where = where + ", comrdte",
                      .value = "Disabled",
                      .limit = "Enabled",
                      .remedy = "enable it on the box's communication page"};
  }
  if (box.rdt_rate_hz && *box.rdt_rate_hz < config.lowest_rate_hz) {
    return hal::Error{.what = "the box sends too slowly: ticks would go without a sample",
                      .where = where + ", comrdtrate",
                      .value = hal::number_text(*box.rdt_rate_hz) + " Hz",
                      .limit = "at least lowest_rate_hz, " + hal::number_text(config.lowest_rate_hz) + " Hz",
                      .remedy = "set the RDT output rate on the box's communication page to " +
                                hal::number_text(config.rate_hz) + " Hz"};
  }
  return std::nullopt;
}

std::vector<std::string> findings_of(const BoxConfiguration& box, const NetFtConfig& config) {
  std::vector<std::string> findings;
  if (box.rdt_rate_hz && *box.rdt_rate_hz < config.rate_hz) {
    findings.push_back("the box is set to " + hal::number_text(*box.rdt_rate_hz) + " Hz, expected are " +
                       hal::number_text(config.rate_hz) +
                       " Hz: set the RDT output rate on its communication page");
  }
  if (box.low_pass_hz) {
    const double hz = *box.low_pass_hz;
    const std::string is =
        hz == 0.0 ? "no low-pass filter" : "a low-pass filter of " + hal::number_text(hz) + " Hz";
    if (config.low_pass_hz && *config.low_pass_hz != hz) {
      const std::string wanted =
          *config.low_pass_hz == 0.0 ? "none" : "one of " + hal::number_text(*config.low_pass_hz) + " Hz";
      findings.push_back("the box is set to " + is + ", expected is " + wanted +
                         ": set it on its settings page, or correct 'low_pass_hz'");
    } else if (!config.low_pass_hz && hz > 0.0 && hz < kPromptHz) {
      findings.push_back("the box has " + is + ", which delays the force by about " +
                         hal::number_text(std::round(1e5 / (2.0 * std::numbers::pi * hz)) / 100.0) +
                         " ms: choose a higher cut-off on its settings page");
    }
  }
  if (box.tool_transformation && std::any_of(box.tool_transformation->begin(), box.tool_transformation->end(),
                                             [](double value) { return value != 0.0; })) {
    findings.emplace_back(
        "the box applies a tool transformation, so forces and torques are not those in the sensor's frame: "
        "set "
        "it to zero on its configuration page");
  }
  return findings;
}

SixAxes<double> ranges_of(const std::string& model) {
  SixAxes<double> ranges{};
  if (const auto c = hal::find_nano17_calibration(model, "")) {
    ranges = {c->range_across_n,    c->range_across_n,    c->range_along_n,
              c->range_torque_n_mm, c->range_torque_n_mm, c->range_torque_n_mm};
  }
  return ranges;
}

}  // namespace hapticd::netft
