#include "server/telemetry/recording_columns.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace hapticd::server {

namespace {

struct OwnColumn {
  std::string_view quantity;
  std::string_view column;
  double scale = 1.0;
};

// Telemetry first, then the data of identifications. "force_x_N" of the latter is found by its name anyway.
constexpr std::array kOwnColumns{
    OwnColumn{"force", "sample_sensor_force_z_n"},
    OwnColumn{"position", "sample_tip_position_z_mm", -1.0},
    OwnColumn{"force_x", "sample_sensor_force_x_n"},
    OwnColumn{"force_y", "sample_sensor_force_y_n"},
    OwnColumn{"force_z", "sample_sensor_force_z_n"},
    OwnColumn{"position_x", "sample_tip_position_x_mm"},
    OwnColumn{"position_y", "sample_tip_position_y_mm"},
    OwnColumn{"position_z", "sample_tip_position_z_mm"},
    OwnColumn{"device_force_x", "guard_device_command_x_n"},
    OwnColumn{"device_force_y", "guard_device_command_y_n"},
    OwnColumn{"device_force_z", "guard_device_command_z_n"},
    OwnColumn{"force", "force_z_N"},
    OwnColumn{"position", "position_z_mm", -1.0},
};

}  // namespace

bool fill_own_column(replay::ColumnMapping& mapping, const replay::ColumnRole& role,
                     const std::vector<std::string>& columns) {
  const bool is_said = !mapping.column.empty() || !mapping.unit.empty();
  if (is_said || replay::is_recognised(role, columns)) return false;
  for (const OwnColumn& own : kOwnColumns) {
    if (own.quantity != role.name) continue;
    if (std::find(columns.begin(), columns.end(), own.column) == columns.end()) continue;
    mapping.column = own.column;
    mapping.scale *= own.scale;
    return true;
  }
  return false;
}

bool is_own_recording(const std::vector<std::string>& columns) {
  return std::ranges::any_of(kOwnColumns, [&](const OwnColumn& own) {
    return std::ranges::find(columns, own.column) != columns.end();
  });
}

}  // namespace hapticd::server
