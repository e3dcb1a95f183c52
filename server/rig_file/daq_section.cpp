#include "server/rig_file/daq_section.h"

#include <fmt/format.h>

#include <array>

#include "server/rig_file/whole_numbers.h"

namespace hapticd::server {

namespace {

constexpr Range kScanRateHz{100.0, 100'000.0, "Hz"};
constexpr Range kSubdevice{-1.0, 255.0, ""};
constexpr Range kChannel{0.0, 255.0, ""};
constexpr Range kVolts{-100.0, 100.0, "V"};
constexpr Range kFifoPriority{0.0, 99.0, ""};
constexpr Range kSaturationShare{0.51, 1.0, ""};
constexpr Range kEngageTimeoutS{0.3, 60.0, "s"};
constexpr Range kToolMassG{0.0, 500.0, "g"};

constexpr Word<daq::InputReference> kReferenceWords[] = {{"differential", daq::InputReference::kDifferential},
                                                         {"ground", daq::InputReference::kGround},
                                                         {"common", daq::InputReference::kCommon}};
constexpr Word<daq::CounterSetup> kSetupWords[] = {{"as_is", daq::CounterSetup::kAsIs},
                                                   {"ni_quadrature", daq::CounterSetup::kNiQuadrature}};

/// Checks two values together: the reader checks only one at a time.
void check_range(TomlTable& table, const char* low_key, const char* high_key, double low_v, double high_v) {
  if (low_v < high_v) return;
  table.refuse(table.has(high_key) ? high_key : low_key,
               hal::Error::of(
                   hal::ErrorCode::kContradiction, fmt::format("'{}' is not below '{}'", low_key, high_key),
                   "", fmt::format("{} … {} V", low_v, high_v), "low less than high", "correct one of them"));
}

void board_fields(auto& table, auto& config) {
  table.field("driver", config.driver, 64);
  table.field("scan_rate_hz", config.scan_rate_hz, kScanRateHz);
  auto& comedi = config.comedi;
  table.field("device", comedi.device, 4096);
  table.field("input_subdevice", comedi.input_subdevice, kSubdevice);
  whole_numbers(table, "input_channels", comedi.input_channels, kChannel);
  table.field("input_low_v", comedi.input_low_v, kVolts);
  table.field("input_high_v", comedi.input_high_v, kVolts);
  table.field("input_reference", comedi.input_reference, kReferenceWords);
  table.field("output_subdevice", comedi.output_subdevice, kSubdevice);
  whole_numbers(table, "output_channels", comedi.output_channels, kChannel);
  table.field("output_low_v", comedi.output_low_v, kVolts);
  table.field("output_high_v", comedi.output_high_v, kVolts);
  whole_numbers(table, "counters", comedi.counters, std::array{kChannel, kChannel}, daq::kMaxCounters);
  table.field("counter_setup", comedi.counter_setup, kSetupWords);
  table.field("calibrated", comedi.calibrated);
  table.field("calibration_file", comedi.calibration_file, 4096);
  table.field("fifo_priority", comedi.fifo_priority, kFifoPriority);
}

void daq_fields(auto& table, auto& config) {
  table.field("calibration_file", config.calibration_file, 4096);
  table.field("part_number", config.part_number, 64);
  table.field("axes", config.axes, 32);
  table.field("saturation_share", config.saturation_share, kSaturationShare);
  table.field("bias_on_engage", config.bias_on_engage);
  table.field("engage_timeout_s", config.engage_timeout_s, kEngageTimeoutS);
  table.field("tool_mass_g", config.tool_mass_g, kToolMassG);
}

}  // namespace

void read_board(TomlTable table, daq::BoardConfig& config) {
  board_fields(table, config);
  const daq::ComediConfig& comedi = config.comedi;
  check_range(table, "input_low_v", "input_high_v", comedi.input_low_v, comedi.input_high_v);
  check_range(table, "output_low_v", "output_high_v", comedi.output_low_v, comedi.output_high_v);
}

std::string write_board(const daq::BoardConfig& config) {
  return toml_fields([&](auto& table) { board_fields(table, config); });
}

void read_daq(TomlTable table, daq::DaqSensorConfig& config) {
  daq_fields(table, config);
}

std::string write_daq(const daq::DaqSensorConfig& config) {
  return toml_fields([&](auto& table) { daq_fields(table, config); });
}

}  // namespace hapticd::server
