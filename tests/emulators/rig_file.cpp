#include "rig_file.h"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <system_error>

namespace hapticd::emulators {

namespace {

namespace fs = std::filesystem;

std::string quoted(const std::string& text) {
  std::string toml = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') toml += '\\';
    toml += c;
  }
  return toml + "\"";
}

/// A decimal point or an exponent in any case: to TOML a number without is a whole one.
std::string number(double value) {
  const std::string text = fmt::format("{:.10g}", value);
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

std::string numbers(const std::array<double, 3>& values) {
  return "[" + number(values[0]) + ", " + number(values[1]) + ", " + number(values[2]) + "]";
}

std::string device_section(const RigPeers& peers, const hal::DeviceInfo& device) {
  const std::string common =
      fmt::format("structural_stiffness_n_per_mm = {}\nstructural_mode_hz = {}\napparent_mass_g = {}\n",
                  number(device.structural_stiffness_n_per_mm), number(device.structural_mode_hz),
                  number(device.apparent_mass_g));
  if (peers.page != nullptr) {
    return fmt::format("[rig.openhaptics]\nlibrary = {}\nposition_resolution_mm = {}\n{}\n",
                       quoted(STAND_IN_LIBRARY), number(device.position_resolution_mm), common);
  }
  const hal::Vector3& shoulder = peers.shoulder_mm;
  return fmt::format(
      "[rig.phantom]\n{}max_force_n = {}\nmax_continuous_force_n = {}\ncoulomb_friction_n = {}\n"
      "origin_mm = {}\nreset_pose_rad = {}\ngimbal = true\ngimbal_reset_rad = {}\n"
      "home_on_engage = true  # the arm rests until it has been\n\n",
      common, number(device.max_force_n), number(device.max_continuous_force_n),
      number(device.coulomb_friction_n), numbers({shoulder.x, shoulder.y, shoulder.z}),
      numbers(peers.board->home_joints_rad()), numbers(peers.board->home_gimbal_rad()));
}

std::string sensor_section(const RigPeers& peers, const hal::SensorInfo& sensor) {
  if (peers.box != nullptr) {
    return fmt::format(
        "[rig.netft]\naddress = \"127.0.0.1\"\nrdt_port = {}\nhttp_port = {}\nmodel = \"nano17_si_25\"\n"
        "tool_mass_g = {}\nfifo_priority = 0  # its peer runs on this machine too\n",
        peers.box->udp_port(), peers.box->http_port(), number(sensor.tool_mass_g));
  }
  return fmt::format("[rig.daq]\ncalibration_file = {}\ntool_mass_g = {}\n",
                     quoted(fs::absolute(peers.calibration_file).string()), number(sensor.tool_mass_g));
}

std::string board_section(const RigPeers& peers) {
  return fmt::format(
      "\n[rig.board]\ndevice = {}\nscan_rate_hz = 5000.0\n"
      "counters = [[3, 0], [3, 1], [3, 2], [3, 3], [3, 4], [3, 5]]\n",
      quoted(fs::absolute(peers.board->path()).string()));
}

std::string instrument_section(double mm_per_v) {
  return fmt::format("\n[rig.board_instrument]\nchannels = [6, 7, 8]\nmm_per_v = {}\n",
                     numbers({mm_per_v, mm_per_v, mm_per_v}));
}

/// The variables of the environment that hapticd needs, "A='x' B='y' ".
std::string environment_of(const RigPeers& peers) {
  std::string text;
  if (peers.page != nullptr) {
    text += fmt::format("HD_STAND_IN_PAGE='{}' ", fs::absolute(peers.page->path()).string());
  }
  if (peers.board != nullptr) {
    text += fmt::format("COMEDI_STAND_IN_PAGE='{}' LD_PRELOAD='{}' ",
                        fs::absolute(peers.board->path()).string(), COMEDI_STAND_IN);
  }
  return text;
}

}  // namespace

std::string daemon_command(const RigPeers& peers, const std::string& rig_file) {
  std::error_code unknown;
  const fs::path beside = fs::read_symlink("/proc/self/exe", unknown).parent_path() / "hapticd";
  const std::string daemon =
      !unknown && fs::exists(beside, unknown) ? fmt::format("'{}'", beside.string()) : "hapticd";
  return fmt::format("{}{} --config '{}'", environment_of(peers), daemon, rig_file);
}

std::string rig_file(const RigPeers& peers, const hal::RigInfo& simulated) {
  const bool has_instrument = peers.instrument_mm_per_v > 0.0;
  std::string text = fmt::format(
      "# An emulated rig: alive as long as process {} is. The libraries find its world through the "
      "environment:\n#   {}hapticd --config THIS_FILE\n"
      "[rig]\nkind = \"hardware\"\ndevice = \"{}\"\nsensor = \"{}\"\n{}\n",
      getpid(), environment_of(peers), peers.page != nullptr ? "openhaptics" : "phantom",
      peers.box != nullptr ? "netft" : "daq", has_instrument ? "instrument = \"board\"\n" : "");
  text += device_section(peers, simulated.device) + sensor_section(peers, simulated.sensor);
  if (peers.board != nullptr) text += board_section(peers);
  if (has_instrument) text += instrument_section(peers.instrument_mm_per_v);
  return text;
}

}  // namespace hapticd::emulators
