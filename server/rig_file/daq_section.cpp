#include "server/rig_file/daq_section.h"

#include <fmt/format.h>

#include <string_view>

#include "server/text/toml_text.h"

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
void read_range(TomlTable& table, const char* low_key, const char* high_key, double& low_v, double& high_v) {
  table.read(low_key, low_v, kVolts);
  table.read(high_key, high_v, kVolts);
  if (low_v < high_v) return;
  table.refuse(table.has(high_key) ? high_key : low_key,
               hal::Error::of(
                   hal::ErrorCode::kContradiction, fmt::format("'{}' is not below '{}'", low_key, high_key),
                   "", fmt::format("{} … {} V", low_v, high_v), "low less than high", "correct one of them"));
}

}  // namespace

void read_board(TomlTable table, daq::BoardConfig& config) {
  table.read("driver", config.driver, 64);
  table.read("scan_rate_hz", config.scan_rate_hz, kScanRateHz);
  daq::ComediConfig& comedi = config.comedi;
  table.read("device", comedi.device, 4096);
  table.read("input_subdevice", comedi.input_subdevice, kSubdevice);
  table.read("input_channels", comedi.input_channels, kChannel);
  read_range(table, "input_low_v", "input_high_v", comedi.input_low_v, comedi.input_high_v);
  table.read("input_reference", comedi.input_reference, kReferenceWords);
  table.read("output_subdevice", comedi.output_subdevice, kSubdevice);
  table.read("output_channels", comedi.output_channels, kChannel);
  read_range(table, "output_low_v", "output_high_v", comedi.output_low_v, comedi.output_high_v);
  table.read("counters", comedi.counters, {kChannel, kChannel}, daq::kMaxCounters);
  table.read("counter_setup", comedi.counter_setup, kSetupWords);
  table.read("calibrated", comedi.calibrated);
  table.read("calibration_file", comedi.calibration_file, 4096);
  table.read("fifo_priority", comedi.fifo_priority, kFifoPriority);
}

std::string write_board(const daq::BoardConfig& config) {
  const daq::ComediConfig& comedi = config.comedi;
  std::string text = fmt::format("driver = {}\nscan_rate_hz = {}\n", toml_quoted(config.driver),
                                 toml_number(config.scan_rate_hz));
  text +=
      fmt::format("device = {}\ninput_subdevice = {}\ninput_channels = [{}]\n", toml_quoted(comedi.device),
                  comedi.input_subdevice, fmt::join(comedi.input_channels, ", "));
  text += fmt::format("input_low_v = {}\ninput_high_v = {}\ninput_reference = {}\n",
                      toml_number(comedi.input_low_v), toml_number(comedi.input_high_v),
                      toml_quoted(text_of(comedi.input_reference, kReferenceWords)));
  text += fmt::format("output_subdevice = {}\noutput_channels = [{}]\n", comedi.output_subdevice,
                      fmt::join(comedi.output_channels, ", "));
  text += fmt::format("output_low_v = {}\noutput_high_v = {}\n", toml_number(comedi.output_low_v),
                      toml_number(comedi.output_high_v));
  std::string counters;
  for (const auto& [subdevice, channel] : comedi.counters) {
    counters += fmt::format("{}[{}, {}]", counters.empty() ? "" : ", ", subdevice, channel);
  }
  if (!counters.empty()) text += fmt::format("counters = [{}]\n", counters);
  text += fmt::format("counter_setup = {}\ncalibrated = {}\ncalibration_file = {}\nfifo_priority = {}\n",
                      toml_quoted(text_of(comedi.counter_setup, kSetupWords)), comedi.calibrated,
                      toml_quoted(comedi.calibration_file), comedi.fifo_priority);
  return text;
}

void read_daq(TomlTable table, daq::DaqSensorConfig& config) {
  table.read("calibration_file", config.calibration_file, 4096);
  table.read("part_number", config.part_number, 64);
  table.read("axes", config.axes, 32);
  table.read("saturation_share", config.saturation_share, kSaturationShare);
  table.read("bias_on_engage", config.bias_on_engage);
  table.read("engage_timeout_s", config.engage_timeout_s, kEngageTimeoutS);
  table.read("tool_mass_g", config.tool_mass_g, kToolMassG);
}

std::string write_daq(const daq::DaqSensorConfig& config) {
  return fmt::format(
      "calibration_file = {}\npart_number = {}\naxes = {}\nsaturation_share = {}\nbias_on_engage = {}\n"
      "engage_timeout_s = {}\ntool_mass_g = {}\n",
      toml_quoted(config.calibration_file), toml_quoted(config.part_number), toml_quoted(config.axes),
      toml_number(config.saturation_share), config.bias_on_engage, toml_number(config.engage_timeout_s),
      toml_number(config.tool_mass_g));
}

}  // namespace hapticd::server
