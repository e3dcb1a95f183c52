#include "tests/measure/study/identify/recordings/handover_recording.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <sstream>

namespace hapticd::study {

const std::vector<QuaternionReading>& quaternion_readings() {
  static const std::vector<QuaternionReading> all{{"x y z w, tool to room", false, false},
                                                  {"x y z w, room to tool", false, true},
                                                  {"w x y z, tool to room", true, false},
                                                  {"w x y z, room to tool", true, true}};
  return all;
}

hal::Result<std::vector<hal::RigSample>> load_handover(const std::string& path,
                                                       const QuaternionReading& reading) {
  constexpr std::array<const char*, 14> kColumns{"time_s", "fx_N", "fy_N", "fz_N", "tx_Nm", "ty_Nm", "tz_Nm",
                                                 "px_m",   "py_m", "pz_m", "q0",   "q1",    "q2",    "q3"};
  std::ifstream file(path);
  if (!file) return hal::Error{"cannot be read", path, "", "", ""};
  std::string line;
  std::getline(file, line);
  std::vector<std::string> names;
  for (std::stringstream cells(line); std::getline(cells, line, ',');) names.push_back(line);
  std::array<std::size_t, kColumns.size()> at{};
  for (std::size_t i = 0; i < kColumns.size(); ++i) {
    const auto found = std::find(names.begin(), names.end(), kColumns[i]);
    if (found == names.end()) return hal::Error{"column missing", path, kColumns[i], "", ""};
    at[i] = static_cast<std::size_t>(found - names.begin());
  }
  std::vector<hal::RigSample> samples;
  while (std::getline(file, line)) {
    std::vector<double> row;
    for (std::stringstream cells(line); std::getline(cells, line, ',');) row.push_back(std::stod(line));
    if (row.size() != names.size())
      return hal::Error{"a row has too few cells", path, std::to_string(samples.size() + 2), "", ""};
    const auto value = [&](std::size_t i) { return row[at[i]]; };
    hal::RigSample sample;
    sample.tick = samples.size();
    sample.time_ns = std::llround(1e9 * value(0));
    sample.sensor_force_n = {value(1), value(2), value(3)};
    sample.sensor_torque_n_mm = {1e3 * value(4), 1e3 * value(5), 1e3 * value(6)};
    sample.tip_position_mm = {1e3 * value(7), 1e3 * value(8), 1e3 * value(9)};
    hal::Quaternion q = reading.scalar_first ? hal::Quaternion{value(10), value(11), value(12), value(13)}
                                             : hal::Quaternion{value(13), value(10), value(11), value(12)};
    if (reading.turns_world_into_tool) q = {q.w, -q.x, -q.y, -q.z};
    sample.tip_orientation = q;
    sample.force_count = 1;
    samples.push_back(sample);
  }
  return samples;
}

}  // namespace hapticd::study
