#include "server/identification/run/bend_columns.h"

#include <cmath>

#include "rt/signal/vector.h"
#include "server/telemetry/recording_columns.h"
#include "server/text/suggestion.h"

namespace hapticd::server {

namespace {

using replay::ColumnRole;
using replay::Quantity;

constexpr std::size_t kPosition = 0;
constexpr std::size_t kForce = 3;
constexpr std::size_t kExternal = 6;
constexpr std::size_t kAlongPress = 9;  ///< position, force, external
constexpr std::size_t kSensor = 12;

using Columns = std::vector<std::string>;
using Mappings = std::map<std::string, replay::ColumnMapping>;

/// True if a column is there by its name, or by one of hapticd's own.
bool is_found(const ColumnRole& role, const Columns& columns) {
  replay::ColumnMapping mapping;
  return replay::is_recognised(role, columns) || fill_own_column(mapping, role, columns);
}

}  // namespace

std::vector<ColumnRole> bend_roles(bool rigid) {
  std::vector<ColumnRole> roles;
  const auto along_axes = [&roles](const std::string& name, Quantity quantity, const Columns& stems) {
    for (const char* axis : {"x", "y", "z"}) {
      const std::string suffix = std::string("_") + axis;
      ColumnRole role{name + suffix, quantity, {}};
      for (const std::string& stem : stems) role.stems.push_back(stem + suffix);
      roles.push_back(role);
    }
  };
  along_axes("position", Quantity::kPosition, {"position", "encoder"});
  along_axes("device_force", Quantity::kForce, {"device_force", "command"});
  along_axes("external", Quantity::kPosition, {"external"});
  roles.push_back({"position", Quantity::kPosition, {"position", "encoder", "displacement", "indentation"}});
  roles.push_back({"device_force", Quantity::kForce, {"device_force", "command", "force", "load"}});
  roles.push_back({"external", Quantity::kPosition, {"external"}});
  if (rigid) {
    along_axes("force", Quantity::kForce, {"force"});
    // An instrument has no say: its reading is not a quantity of this recording.
    for (const std::size_t i : {kExternal, kExternal + 1, kExternal + 2, kAlongPress + 2}) {
      roles[i] = {"", Quantity::kPosition, {}};
    }
  }
  return roles;
}

hal::Result<BendColumns> choose_bend_columns(bool rigid, const Mappings& mapped, const Columns& columns,
                                             const hal::Vector3& press_direction) {
  BendColumns chosen;
  const double length = rt::norm(press_direction);
  if (!(length > 0.0) || !std::isfinite(length)) {
    return hal::Error{"the press has no direction", "", "", "a vector of a length", "give press_direction"};
  }
  chosen.axes.press_direction = press_direction * (1.0 / length);
  chosen.axes.rigid = rigid;

  const std::vector<ColumnRole> roles = bend_roles(rigid);
  struct Wanted {
    std::size_t along_axes, along_press;
    bool* is_along_press;
    const char* what;
    const char* remedy;
  };
  const char* instrument =
      "name them external_x_mm, external_y_mm and external_z_mm (rig frame), or external_mm along "
      "press_direction, or map one: external=NAME:mm; without an instrument press a rigid object and say so "
      "(rigid_contact)";
  std::vector<Wanted> all{
      {kPosition, kAlongPress, &chosen.axes.position_along_press, "no position by the encoders",
       "name them position_x_mm, position_y_mm and position_z_mm (rig frame), or position_mm along "
       "press_direction, or map one: position=NAME:mm"},
      {kForce, kAlongPress + 1, &chosen.axes.force_along_press, "no force of the device",
       "name them device_force_x_N, device_force_y_N and device_force_z_N (on the tip, rig frame), or "
       "device_force_N along press_direction (positive while pressed), or map one: device_force=NAME:N"}};
  if (!rigid) {
    all.push_back({kExternal, kAlongPress + 2, &chosen.axes.external_along_press,
                   "no position by an instrument from outside", instrument});
  }
  for (const Wanted& wanted : all) {
    const auto is_mapped = [&](std::size_t i) { return mapped.contains(roles[i].name); };
    const auto any_axis = [&](const auto& condition) {
      return condition(wanted.along_axes) || condition(wanted.along_axes + 1) ||
             condition(wanted.along_axes + 2);
    };
    const bool axes_mapped = any_axis(is_mapped);
    const bool press_mapped = is_mapped(wanted.along_press);
    if (axes_mapped && press_mapped) {
      return hal::Error{"a quantity is mapped along three axes and along the press", "",
                        roles[wanted.along_press].name, "one or the other", "map one of them only"};
    }
    const bool axes_found = any_axis([&](std::size_t i) { return is_found(roles[i], columns); });
    const bool press_found = is_found(roles[wanted.along_press], columns);
    const bool along_axes = axes_mapped || (!press_mapped && axes_found);
    if (!along_axes && !press_mapped && !press_found) {
      return hal::Error{std::string("the recording has ") + wanted.what, "", "",
                        "the file's columns are " + comma_separated(columns), wanted.remedy};
    }
    *wanted.is_along_press = !along_axes;
    if (along_axes) {
      for (std::size_t i = 0; i < 3; ++i) chosen.uses[wanted.along_axes + i] = true;
    } else {
      chosen.uses[wanted.along_press] = true;
    }
  }
  if (rigid) {
    bool all_there = true;
    for (std::size_t i = kSensor; i < kSensor + 3; ++i) {
      all_there = all_there && (mapped.contains(roles[i].name) || is_found(roles[i], columns));
    }
    for (std::size_t i = kSensor; i < kSensor + 3; ++i) {
      chosen.uses[i] = all_there || mapped.contains(roles[i].name);
    }
  }
  return chosen;
}

void fill_bend(std::span<const double, kBendNumbers> numbers, const BendAxes& axes,
               rt::Observation& observation) noexcept {
  const auto vector = [&](std::size_t at) {
    return hal::Vector3{numbers[at], numbers[at + 1], numbers[at + 2]};
  };
  const hal::Vector3& press = axes.press_direction;
  const auto along = [&](const hal::Vector3& v) { return press * dot(v, press); };

  hal::Vector3 position = axes.position_along_press ? press * numbers[kAlongPress] : vector(kPosition);
  hal::Vector3 force =
      axes.force_along_press ? press * (axes.rigid ? 1.0 : -1.0) * numbers[kAlongPress + 1] : vector(kForce);
  observation.sample.tip_position_mm = position;
  if (axes.rigid) {
    observation.sample.sensor_force_n = vector(kSensor);
    if (axes.position_along_press) force = along(force);
  } else {
    hal::Vector3 external = axes.external_along_press ? press * numbers[kAlongPress + 2] : vector(kExternal);
    if (axes.position_along_press || axes.external_along_press) {
      // One axis is all that can be compared.
      external = position - along(position) + along(external);
      force = along(force);
    }
    observation.external_position_mm = external;
    observation.has_external_position = true;
  }
  observation.device_command_n = force;
}

}  // namespace hapticd::server
