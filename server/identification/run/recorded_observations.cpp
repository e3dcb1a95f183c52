#include "server/identification/run/recorded_observations.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "hal/replay/table_file.h"
#include "server/telemetry/recording_columns.h"
#include "server/text/suggestion.h"

namespace hapticd::server {

namespace {

using replay::ColumnRole;
using replay::Quantity;

constexpr double kMaxS = 31.0 * 86400.0;
constexpr std::size_t kMinRows = 10;
/// Number of steps whose median is taken: those of the first minutes show it.
constexpr std::size_t kStepsLookedAt = 100'000;

struct Role {
  ColumnRole column;
  bool required = true;
  bool is_read = true;
};

/// Roles in the order of RecordedRow's numbers.
std::vector<Role> roles_of(RecordedMotion motion) {
  std::vector<Role> roles{{role_of(Quantity::kTime)}};
  if (motion == RecordedMotion::kPress) {
    roles.push_back({role_of(Quantity::kForce)});
    roles.push_back({role_of(Quantity::kPosition)});
    return roles;
  }
  if (motion == RecordedMotion::kStroke) {
    roles.push_back({{"force", Quantity::kForce, {"friction_force", "friction", "force"}}});
    roles.push_back({role_of(Quantity::kPosition)});
    roles.push_back({{"normal_force", Quantity::kForce, {"normal_force", "normal"}}, false});
    return roles;
  }
  if (motion == RecordedMotion::kBend || motion == RecordedMotion::kRigid) {
    for (ColumnRole& role : bend_roles(motion == RecordedMotion::kRigid)) {
      roles.push_back({std::move(role), false});  // which are required, choose_bend_columns() says
    }
    return roles;
  }
  for (const char* axis : {"x", "y", "z"}) {
    const std::string a = axis;
    roles.push_back({{"force_" + a, Quantity::kForce, {"force_" + a, "f" + a}}});
  }
  for (const char* axis : {"x", "y", "z"}) {
    const std::string a = axis;
    roles.push_back({{"torque_" + a, Quantity::kTorque, {"torque_" + a, "t" + a}},
                     false,
                     motion == RecordedMotion::kFree});
  }
  for (const char* axis : {"x", "y", "z"}) {
    const std::string a = axis;
    roles.push_back({{"position_" + a, Quantity::kPosition, {"position_" + a, "p" + a}},
                     motion == RecordedMotion::kScan});
  }
  for (const char* part : {"w", "x", "y", "z"}) {
    const std::string p = part;
    roles.push_back({{"orientation_" + p, Quantity::kPure, {"orientation_" + p, "q" + p}}, false});
  }
  return roles;
}

/// Numbers that a row may have, in the order of roles_of().
using RecordedRow = std::array<double, 1 + kBendNumbers>;
constexpr std::size_t kOrientation = 10;
static_assert(std::tuple_size_v<RecordedRow> >= kOrientation + 4);

rt::Observation observation_of(const RecordedRow& row, RecordedMotion motion, const BendAxes& bend) {
  rt::Observation observation;
  hal::RigSample& sample = observation.sample;
  sample.time_ns = std::llround(row[0] * 1e9);
  sample.force_count = 1;
  switch (motion) {
    case RecordedMotion::kPress:
      sample.sensor_force_n.z = row[1];
      sample.tip_position_mm.z = -row[2];
      break;
    case RecordedMotion::kStroke:
      sample.sensor_force_n.x = -row[1];
      sample.tip_position_mm.x = row[2];
      sample.sensor_force_n.z = row[3];
      break;
    case RecordedMotion::kFree:
    case RecordedMotion::kScan: {
      sample.sensor_force_n = {row[1], row[2], row[3]};
      sample.sensor_torque_n_mm = {row[4], row[5], row[6]};
      sample.tip_position_mm = {row[7], row[8], row[9]};
      const double w = row[kOrientation];
      const double x = row[kOrientation + 1];
      const double y = row[kOrientation + 2];
      const double z = row[kOrientation + 3];
      const double length = std::sqrt(w * w + x * x + y * y + z * z);
      if (length > 0.0) sample.tip_orientation = {w / length, x / length, y / length, z / length};
      break;
    }
    case RecordedMotion::kBend:
    case RecordedMotion::kRigid:
      fill_bend(std::span(row).subspan<1>(), bend, observation);
      break;
  }
  return observation;
}

std::optional<hal::Error> unknown_quantity(const RecordingDescription& description,
                                           const std::vector<Role>& roles) {
  std::vector<std::string> names;
  for (const Role& role : roles) {
    if (!role.column.name.empty()) names.push_back(role.column.name);
  }
  for (const auto& [name, mapping] : description.columns) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    return hal::Error{"this identification reads no such quantity", "recording '" + description.name + "'",
                      name, comma_separated(names), did_you_mean(name, names, "leave it out")};
  }
  return std::nullopt;
}

}  // namespace

hal::Result<RecordedObservations> RecordedObservations::open(const std::string& path, RecordedMotion motion,
                                                             const RecordingDescription& description,
                                                             const hal::Vector3& press_direction,
                                                             const std::atomic<bool>* given_up) {
  const auto go_on = [given_up] { return given_up == nullptr || !given_up->load(); };
  std::vector<Role> roles = roles_of(motion);
  if (auto error = unknown_quantity(description, roles)) return *error;
  const replay::CsvFormat format{.decimal_comma = description.decimal_comma};
  auto opened = replay::TableFile::open(path, format);
  const auto named = [&](hal::Error error) {
    // Its owner knows it by its name, not by where it is kept.
    if (const std::size_t at = error.where.find(path); at != std::string::npos) {
      error.where.replace(at, path.size(), description.name);
    }
    return error;
  };
  if (!opened) return named(opened.error());
  const auto& file = *opened;

  RecordedObservations recording;
  recording.path_ = path;
  recording.format_ = format;
  recording.motion_ = motion;
  recording.written_here_ = is_own_recording(file->columns());
  recording.name_ = description.name;
  if (motion == RecordedMotion::kBend || motion == RecordedMotion::kRigid) {
    const auto chosen = choose_bend_columns(motion == RecordedMotion::kRigid, description.columns,
                                            file->columns(), press_direction);
    if (!chosen) {
      hal::Error error = chosen.error();
      error.where = "recording '" + description.name + "'";
      return error;
    }
    recording.bend_ = chosen->axes;
    // Time stays first and is always required.
    for (std::size_t i = roles.size() - 1; i > 0; --i) {
      roles[i].required = chosen->uses[i - 1];
      roles[i].is_read = chosen->uses[i - 1];
    }
  }
  for (std::size_t i = 0; i < roles.size(); ++i) {
    if (!roles[i].is_read) continue;
    const auto mapped = description.columns.find(roles[i].column.name);
    const bool is_mapped = mapped != description.columns.end();
    replay::ColumnMapping mapping = is_mapped ? mapped->second : replay::ColumnMapping{};
    const bool is_own = fill_own_column(mapping, roles[i].column, file->columns());
    if (!is_mapped && !is_own && !roles[i].required &&
        !replay::is_recognised(roles[i].column, file->columns()))
      continue;
    const auto selection = replay::select_column(mapping, roles[i].column, file->columns(), file->place());
    if (!selection) return named(selection.error());
    if (is_own) {
      recording.own_columns_.push_back(fmt::format("{} is read from {}{}", roles[i].column.name,
                                                   mapping.column, mapping.scale < 0.0 ? ", turned" : ""));
    }
    recording.columns_.push_back({*selection, i});
  }
  if (motion == RecordedMotion::kFree || motion == RecordedMotion::kScan) {
    const auto parts = std::count_if(recording.columns_.begin(), recording.columns_.end(),
                                     [](const Column& c) { return c.target >= kOrientation; });
    if (parts != 0 && parts != 4) {
      return hal::Error{"an orientation has four parts", "recording '" + description.name + "'",
                        fmt::format("{} of them", parts), "orientation_w, _x, _y and _z, or none",
                        "map those that are missing"};
    }
  }

  RecordingSummary& summary = recording.summary_;
  std::vector<double> steps;
  double last_s = 0.0;
  if (auto error = recording.read([&](const rt::Observation& observation) {
        const double now_s = 1e-9 * static_cast<double>(observation.sample.time_ns);
        if (summary.rows > 0) {
          summary.longest_step_s = std::max(summary.longest_step_s, now_s - last_s);
          if (steps.size() < kStepsLookedAt) steps.push_back(now_s - last_s);
        }
        last_s = now_s;
        summary.duration_s = now_s;
        ++summary.rows;
        return go_on();
      })) {
    return *error;
  }
  if (!go_on()) {
    return hal::Error{"reading was given up", "recording '" + description.name + "'",
                      fmt::format("after {} rows", summary.rows), "", "start it again"};
  }
  if (summary.rows < kMinRows) {
    return hal::Error{"the recording is too short", "recording '" + description.name + "'",
                      fmt::format("{} rows", summary.rows), fmt::format("at least {} rows", kMinRows),
                      "record for longer"};
  }
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  summary.median_step_s = *middle;
  return recording;
}

hal::RigInfo RecordedObservations::rig_info() const {
  hal::RigInfo info;
  info.kind = hal::RigKind::kReplay;
  info.name = "recording:" + name_;
  info.rate_hz = 1.0 / summary_.median_step_s;
  info.renders_force = false;
  info.has_external_position =
      motion_ == RecordedMotion::kBend || (motion_ == RecordedMotion::kStroke && !written_here_);
  return info;
}

std::optional<hal::Error> RecordedObservations::read(
    const std::function<bool(const rt::Observation&)>& visit) const {
  auto opened = replay::TableFile::open(path_, format_);
  if (!opened) return opened.error();
  const auto& file = *opened;
  std::vector<std::size_t> indices;
  for (const Column& column : columns_) indices.push_back(column.selection.index);

  bool first = true;
  double start_s = 0.0;
  double last_s = 0.0;
  std::uint64_t count = 0;
  bool stopped = false;
  const auto place = [&](std::size_t line) { return fmt::format("recording '{}', line {}", name_, line); };
  const auto take = [&](std::size_t line, std::span<const double> cells) -> std::optional<hal::Error> {
    RecordedRow row{};
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      row[columns_[i].target] = cells[i] * columns_[i].selection.factor;
      if (!std::isfinite(row[columns_[i].target])) {
        return hal::Error{"a scaled value is not finite", place(line), "", "",
                          "check the units and scales of the columns"};
      }
    }
    if (first) start_s = row[0];
    row[0] -= start_s;
    if (!first && !(row[0] > last_s)) {
      return replay::time_does_not_increase(row[0] + start_s, last_s + start_s, place(line));
    }
    if (row[0] > kMaxS) {
      return hal::Error{"the recording is too long", place(line), fmt::format("{:g} s", row[0]),
                        "up to 31 days", "check the unit of the time"};
    }
    first = false;
    last_s = row[0];
    rt::Observation observation = observation_of(row, motion_, bend_);
    observation.sample.tick = count++;
    if (visit(observation)) return std::nullopt;
    stopped = true;
    return hal::Error{};
  };
  auto error = file->read_rows(indices, take);
  if (!error || stopped) return std::nullopt;
  if (const std::size_t at = error->where.find(path_); at != std::string::npos) {
    error->where.replace(at, path_.size(), name_);
  }
  return error;
}

}  // namespace hapticd::server
