#include "server/rig_file/netft_section.h"

#include <fmt/format.h>

#include "server/text/range.h"
#include "server/text/toml_text.h"

namespace hapticd::server {

namespace {

constexpr Word<netft::BiasBy> kBiasWords[] = {
    {"none", netft::BiasBy::kNone}, {"software", netft::BiasBy::kSoftware}, {"box", netft::BiasBy::kBox}};

constexpr Range kPort{1.0, 65535.0, ""};
constexpr Range kRateHz{1.0, 100'000.0, "Hz"};
constexpr Range kTimeoutS{0.1, 60.0, "s"};
constexpr Range kStaleMs{2.0, 10'000.0, "ms"};
constexpr Range kRetryMs{5.0, 60'000.0, "ms"};
constexpr Range kMassG{0.0, 10'000.0, "g"};
constexpr Range kLowPassHz{0.0, 3000.0, "Hz"};
constexpr Range kCounts{1e-6, 1e12, "counts per unit"};
constexpr Range kPriority{0.0, 99.0, ""};

}  // namespace

void read_netft(TomlTable table, netft::NetFtConfig& config) {
  table.read("address", config.address, 253);
  table.read("rdt_port", config.rdt_port, kPort);
  table.read("http_port", config.http_port, kPort);
  table.read("http_path", config.http_path, 1024);
  table.read("rate_hz", config.rate_hz, kRateHz);
  table.read("lowest_rate_hz", config.lowest_rate_hz, kRateHz);
  table.read("connect_timeout_s", config.connect_timeout_s, kTimeoutS);
  table.read("stale_after_ms", config.stale_after_ms, kStaleMs);
  table.read("retry_first_ms", config.retry_first_ms, kRetryMs);
  table.read("retry_longest_ms", config.retry_longest_ms, kRetryMs);
  table.read("bias", config.bias, kBiasWords);
  table.read("model", config.model, 64);
  table.read("serial", config.serial, 64);
  table.read("low_pass_hz", config.low_pass_hz, kLowPassHz);
  table.read("tool_mass_g", config.tool_mass_g, kMassG);
  table.read("axes", config.axes, 32);
  table.read("read_configuration", config.read_configuration);
  table.read("counts_per_force", config.counts_per_force, kCounts);
  table.read("counts_per_torque", config.counts_per_torque, kCounts);
  table.read("force_unit", config.force_unit, 16);
  table.read("torque_unit", config.torque_unit, 16);
  table.read("fifo_priority", config.fifo_priority, kPriority);
}

std::string write_netft(const netft::NetFtConfig& config) {
  std::string text = fmt::format(
      "address = {}\nrdt_port = {}\nhttp_port = {}\nhttp_path = {}\nrate_hz = {}\nlowest_rate_hz = {}\n"
      "connect_timeout_s = {}\nstale_after_ms = {}\nretry_first_ms = {}\nretry_longest_ms = {}\nbias = {}\n",
      toml_quoted(config.address), config.rdt_port, config.http_port, toml_quoted(config.http_path),
      toml_number(config.rate_hz), toml_number(config.lowest_rate_hz), toml_number(config.connect_timeout_s),
      toml_number(config.stale_after_ms), toml_number(config.retry_first_ms),
      toml_number(config.retry_longest_ms), toml_quoted(text_of(config.bias, kBiasWords)));
  text += fmt::format("model = {}\nserial = {}\n", toml_quoted(config.model), toml_quoted(config.serial));
  if (config.low_pass_hz) text += fmt::format("low_pass_hz = {}\n", toml_number(*config.low_pass_hz));
  text += fmt::format(
      "tool_mass_g = {}\naxes = {}\nread_configuration = {}\ncounts_per_force = {}\ncounts_per_torque = {}\n"
      "force_unit = {}\ntorque_unit = {}\nfifo_priority = {}\n",
      toml_number(config.tool_mass_g), toml_quoted(config.axes), config.read_configuration,
      toml_number(config.counts_per_force), toml_number(config.counts_per_torque),
      toml_quoted(config.force_unit), toml_quoted(config.torque_unit), config.fifo_priority);
  return text;
}

}  // namespace hapticd::server
