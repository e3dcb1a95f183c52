#pragma once

#include <comedilib.h>

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "hal/daq/board_config.h"
#include "hal/error.h"

// Private to the comedi board: comedi's subdevices, ranges and converters.
namespace hapticd::daq {

struct ComediCloser {
  void operator()(comedi_t* device) const noexcept { comedi_close(device); }
};
using ComediHandle = std::unique_ptr<comedi_t, ComediCloser>;

/// Opens the board's node. Errors say whether it is missing, forbidden, or has no board behind it.
hal::Result<ComediHandle> open_comedi(const std::string& path);

/// Error with comedi's own text for the last failure.
hal::Error comedi_error(const std::string& path, std::string what, std::string remedy);

/// One analog channel: its place and the meaning of its counts.
struct AnalogChannel {
  unsigned subdevice = 0;
  unsigned channel = 0;
  unsigned range = 0;
  unsigned reference = AREF_GROUND;
  lsampl_t most = 0;  ///< the largest count
  double low_v = 0.0;
  double high_v = 0.0;
  comedi_polynomial_t converter{};
};

struct AnalogRequest {
  int subdevice = -1;
  double channel = 0.0;
  double low_v = -10.0;
  double high_v = 10.0;
  unsigned reference = AREF_GROUND;
  bool output = false;
};

/// Finds subdevice, range and converter (hard or soft calibration, whichever the board has).
hal::Result<AnalogChannel> find_analog(comedi_t* device, const ComediConfig& config,
                                       const AnalogRequest& request);

/// Number of bits of a largest count.
constexpr int bits_of(lsampl_t most) noexcept {
  int bits = 0;
  for (; most != 0; most >>= 1U) ++bits;
  return bits;
}

/// Volts to the nearest count of the channel, clamped to its counts: comedi's own conversion does not
/// clamp, and the end of a calibrated channel lies slightly outside.
lsampl_t to_count(const AnalogChannel& channel, double volts) noexcept;

}  // namespace hapticd::daq
