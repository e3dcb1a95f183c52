#include "client/cli/plot/recording.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "client/cli/session/session.h"
#include "client/cli/terminal/terminal.h"
#include "client/cli/text/names.h"

namespace hapticd::cli {
std::vector<std::string> origin_lines(const v1::RigInfo& rig, const v1::RigState& state,
                                      std::uint32_t decimation) {
  std::vector<std::string> lines{"hapticd telemetry recording"};
  lines.push_back(fmt::format("rig: {} ({}), loop {:g} Hz, hapticd {}", rig.name(), word(rig.kind()),
                              rig.loop_rate_hz(), rig.server_version()));
  if (!rig.device().model().empty()) {
    const auto& device = rig.device();
    lines.push_back(
        fmt::format("device: {}, {:g} N, {:g} N continuous, resolution {:g} mm, structure {:g} N/mm",
                    device.model(), device.max_force_n(), device.max_continuous_force_n(),
                    device.position_resolution_mm(), device.structural_stiffness_n_per_mm()));
  }
  if (!rig.sensor().model().empty()) {
    const auto& sensor = rig.sensor();
    lines.push_back(fmt::format("sensor: {}, {:g} N, resolution {:g} N, {:g} Hz, tool {:g} g", sensor.model(),
                                sensor.range_n(), sensor.resolution_n(), sensor.sample_rate_hz(),
                                sensor.tool_mass_g()));
  }
  for (const auto& parameter : rig.uncertain_parameters()) {
    lines.push_back(fmt::format("uncertain: {} = {:g} {} ({})", parameter.name(), parameter.value(),
                                parameter.unit(), parameter.source()));
  }
  lines.push_back(state.scene().empty() ? "scene at the start: none"
                                        : fmt::format("scene at the start: {}, target {:g} N/mm",
                                                      state.scene(), state.target_stiffness_n_per_mm()));
  lines.push_back(fmt::format(
      "every {} tick(s); a column's unit is the end of its name; x y z in the rig's frame, "
      "z up; one-dimensional quantities along the press axis or the deformation direction, into the "
      "object",
      std::max(decimation, 1U)));
  // Texts come from the daemon; none of them may begin a new line.
  for (auto& line : lines) line = printable(line);
  return lines;
}

Recording::Recording(const std::string& path, const std::vector<std::string>& origin,
                     const std::vector<v1::FieldGroup>& groups)
    : path_(path), columns_(groups) {
  errno = 0;
  file_.open(path, std::ios::trunc);
  if (!file_) {
    const std::string why = std::strerror(errno);
    throw LocalError("cannot write the recording", path, why, "a file in a folder that is there",
                     "make the folder, or see its rights");
  }
  for (const auto& line : origin) file_ << "# " << line << '\n';
  file_ << fmt::format("{}\n", fmt::join(columns_.names(), ","));
}

void Recording::add(const v1::TelemetrySample& sample) {
  file_ << columns_.row(sample) << '\n';
  ++samples_;
}

void Recording::finish(const client::StreamAccount& account) {
  file_ << "# " << account_text(account) << '\n';
  file_.close();
  if (!file_)
    throw LocalError("the recording could not be written in full", path_, "", "", "is the disk full?");
}

std::string account_text(const client::StreamAccount& account) {
  if (account.complete()) return fmt::format("{} samples, complete", account.samples());
  return fmt::format(
      "{} samples, NOT complete: {} missing in {} gap(s), {} out of order; dropped {} by this reader, {} by "
      "the daemon",
      account.samples(), account.missing(), account.gaps(), account.disordered(),
      account.dropped_by_subscriber(), account.dropped_by_server());
}

std::vector<v1::FieldGroup> groups_of(const v1::RigInfo& rig) {
  std::vector<v1::FieldGroup> groups = parse_groups(
      "sample,motion,contact,deformation,target,control,guard,timing,direction,fusion,passivity");
  if (rig.has_truth()) groups.push_back(v1::FIELD_GROUP_TRUTH);
  return groups;
}

}  // namespace hapticd::cli
