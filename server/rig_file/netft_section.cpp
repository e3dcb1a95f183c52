#include "server/rig_file/netft_section.h"

#include "server/text/toml_writer.h"

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

void netft_fields(auto& table, auto& config) {
  table.field("address", config.address, 253);
  table.field("rdt_port", config.rdt_port, kPort);
  table.field("http_port", config.http_port, kPort);
  table.field("http_path", config.http_path, 1024);
  table.field("rate_hz", config.rate_hz, kRateHz);
  table.field("lowest_rate_hz", config.lowest_rate_hz, kRateHz);
  table.field("connect_timeout_s", config.connect_timeout_s, kTimeoutS);
  table.field("stale_after_ms", config.stale_after_ms, kStaleMs);
  table.field("retry_first_ms", config.retry_first_ms, kRetryMs);
  table.field("retry_longest_ms", config.retry_longest_ms, kRetryMs);
  table.field("bias", config.bias, kBiasWords);
  table.field("model", config.model, 64);
  table.field("serial", config.serial, 64);
  table.field("low_pass_hz", config.low_pass_hz, kLowPassHz);
  table.field("tool_mass_g", config.tool_mass_g, kMassG);
  table.field("axes", config.axes, 32);
  table.field("read_configuration", config.read_configuration);
  table.field("counts_per_force", config.counts_per_force, kCounts);
  table.field("counts_per_torque", config.counts_per_torque, kCounts);
  table.field("force_unit", config.force_unit, 16);
  table.field("torque_unit", config.torque_unit, 16);
  table.field("fifo_priority", config.fifo_priority, kPriority);
}

}  // namespace

void read_netft(TomlTable table, netft::NetFtConfig& config) {
  netft_fields(table, config);
}

std::string write_netft(const netft::NetFtConfig& config) {
  return toml_fields([&](auto& table) { netft_fields(table, config); });
}

}  // namespace hapticd::server
