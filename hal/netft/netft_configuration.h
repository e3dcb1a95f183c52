#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "hal/error.h"

namespace hapticd::netft {

/// Active configuration of a Net F/T box, from /netftapi2.xml. Optional members may be missing in some
/// firmware or in another peer of the protocol.
struct BoxConfiguration {
  std::string product;                          ///< prodname
  std::string firmware;                         ///< mfgdigver
  std::string calibration_serial;               ///< cfgcalsn, e.g. "FT12345"
  std::string force_unit;                       ///< scfgfu, as written
  std::string torque_unit;                      ///< scfgtu, as written
  double newtons_per_count = 0.0;               ///< from cfgcpf and the unit
  double newton_millimetres_per_count = 0.0;    ///< from cfgcpt and the unit
  std::optional<std::array<double, 6>> ranges;  ///< cfgmr: Fx Fy Fz [N], Tx Ty Tz [N·mm]
  std::optional<std::array<double, 6>> bias;    ///< setbias: offsets of the six gages, gage counts
  /// cfgtfx: translation and rotation that the box applies to its readings, in its own units.
  std::optional<std::array<double, 6>> tool_transformation;
  std::optional<double> low_pass_hz;        ///< setuserfilter; 0 = no filter
  std::optional<bool> rdt_enabled;          ///< comrdte
  std::optional<double> rdt_rate_hz;        ///< comrdtrate
  std::optional<int> records_per_datagram;  ///< comrdtbsiz; counts in buffered mode only
  std::optional<std::uint32_t> status;      ///< runstat, bits of rdt_status.h
};

/// Reads the page. Counts and units are required; every other known element, if present, must be valid.
/// Errors name the element, its value and the accepted values. `where` names the page in errors.
hal::Result<BoxConfiguration> parse_netft_configuration(std::string_view xml, std::string_view where);

/// Cut-off frequencies of the box, by their number in the box; 0 Hz = no filter.
inline constexpr std::array<double, 13> kLowPassHz{0.0, 838.0, 326.0,  152.0,  73.0,   35.0,  18.0,
                                                   8.0, 5.0,   1500.0, 2000.0, 2500.0, 3000.0};

inline constexpr std::size_t kMaxPageBytes = std::size_t{64} << 10U;

}  // namespace hapticd::netft
