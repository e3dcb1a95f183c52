#include "hal/daq/comedi_channels.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>

namespace hapticd::daq {

namespace {

struct CalibrationCleaner {
  void operator()(comedi_calibration_t* calibration) const noexcept {
    comedi_cleanup_calibration(calibration);
  }
};

hal::Result<comedi_polynomial_t> find_converter(comedi_t* device, const ComediConfig& config,
                                                const AnalogChannel& channel, bool output) {
  const auto direction = output ? COMEDI_FROM_PHYSICAL : COMEDI_TO_PHYSICAL;
  comedi_polynomial_t converter{};
  const int flags = comedi_get_subdevice_flags(device, channel.subdevice);
  const bool soft = flags >= 0 && (static_cast<unsigned>(flags) & SDF_SOFT_CALIBRATED) != 0;
  if (!soft || !config.calibrated) {
    if (comedi_get_hardcal_converter(device, channel.subdevice, channel.channel, channel.range, direction,
                                     &converter) < 0) {
      return comedi_error(config.device, "the board does not report the meaning of its counts",
                          "calibrate it with comedi_calibrate");
    }
    return converter;
  }
  std::string path = config.calibration_file;
  if (path.empty()) {
    char* const found = comedi_get_default_calibration_path(device);
    if (found != nullptr) path = found;
    std::free(found);  // NOLINT(cppcoreguidelines-no-malloc): comedi's own
  }
  const std::string remedy = "run comedi_soft_calibrate -f " + config.device +
                             ", or accept the nominal ranges with calibrated = false";
  // Checked first: the library leaks memory when the file does not exist.
  const bool readable = access(path.c_str(), R_OK) == 0;
  const std::unique_ptr<comedi_calibration_t, CalibrationCleaner> calibration(
      readable ? comedi_parse_calibration_file(path.c_str()) : nullptr);
  if (!calibration) {
    return hal::Error{"the board is calibrated by software and has no calibration file", config.device, path,
                      "", remedy};
  }
  if (comedi_get_softcal_converter(channel.subdevice, channel.channel, channel.range, direction,
                                   calibration.get(), &converter) < 0) {
    return hal::Error{"the board's calibration file has no entry for a channel", config.device,
                      fmt::format("{}: subdevice {}, channel {}, range {}", path, channel.subdevice,
                                  channel.channel, channel.range),
                      "", remedy};
  }
  return converter;
}

}  // namespace

hal::Error comedi_error(const std::string& path, std::string what, std::string remedy) {
  return {std::move(what), path, comedi_strerror(comedi_errno()), "", std::move(remedy)};
}

hal::Result<ComediHandle> open_comedi(const std::string& path) {
  std::error_code failure;
  if (!std::filesystem::exists(path, failure)) {
    return hal::Error{"there is no such board", path, failure ? failure.message() : "no such device node",
                      "a comedi device node",
                      "check that the board is plugged in and its comedi driver loaded (ls /dev/comedi*)"};
  }
  ComediHandle handle(comedi_open(path.c_str()));
  if (!handle) {
    const bool forbidden = errno == EACCES || comedi_errno() == EACCES;
    return comedi_error(path, "cannot open the board",
                        forbidden ? "add the user of the service to the group of the device node (iocard)"
                                  : "check that the node belongs to a comedi board (comedi_board_info)");
  }
  return handle;
}

hal::Result<AnalogChannel> find_analog(comedi_t* device, const ComediConfig& config,
                                       const AnalogRequest& request) {
  const std::string_view kind = request.output ? "analog output" : "analog input";
  const int type = request.output ? COMEDI_SUBD_AO : COMEDI_SUBD_AI;
  const int subdevice =
      request.subdevice >= 0 ? request.subdevice : comedi_find_subdevice_by_type(device, type, 0);
  if (subdevice < 0 || comedi_get_subdevice_type(device, static_cast<unsigned>(subdevice)) != type) {
    return hal::Error{fmt::format("this subdevice is no {}", kind), config.device,
                      fmt::format("subdevice {}", subdevice), "",
                      "see comedi_board_info for the board's subdevices"};
  }
  AnalogChannel channel;
  channel.subdevice = static_cast<unsigned>(subdevice);
  channel.channel = static_cast<unsigned>(request.channel);
  channel.reference = request.reference;
  const int channels = comedi_get_n_channels(device, channel.subdevice);
  if (static_cast<int>(channel.channel) >= channels) {
    return hal::Error{fmt::format("the board has no such {} channel", kind), config.device,
                      fmt::format("{}", channel.channel), fmt::format("0 … {}", channels - 1),
                      "correct the channels"};
  }
  const int range =
      comedi_find_range(device, channel.subdevice, channel.channel, UNIT_volt, request.low_v, request.high_v);
  const comedi_range* const ends =
      range < 0 ? nullptr
                : comedi_get_range(device, channel.subdevice, channel.channel, static_cast<unsigned>(range));
  if (ends == nullptr) {
    return hal::Error{fmt::format("the board has no {} range that wide", kind), config.device,
                      fmt::format("{} … {} V", request.low_v, request.high_v), "",
                      "see comedi_board_info -v for the board's ranges"};
  }
  channel.range = static_cast<unsigned>(range);
  channel.low_v = ends->min;
  channel.high_v = ends->max;
  channel.most = comedi_get_maxdata(device, channel.subdevice, channel.channel);
  if (channel.most == 0) {
    return comedi_error(config.device,
                        fmt::format("the board does not report the resolution of its {}", kind),
                        "check the comedi driver");
  }
  auto converter = find_converter(device, config, channel, request.output);
  if (!converter) return converter.error();
  channel.converter = *converter;
  return channel;
}

lsampl_t to_count(const AnalogChannel& channel, double volts) noexcept {
  const comedi_polynomial_t& p = channel.converter;
  const double x = volts - p.expansion_origin;
  double count = 0.0;
  const unsigned order = std::min(p.order, unsigned{COMEDI_MAX_NUM_POLYNOMIAL_COEFFICIENTS - 1});
  for (unsigned k = order + 1; k-- > 0;) count = count * x + p.coefficients[k];
  return static_cast<lsampl_t>(std::clamp(std::round(count), 0.0, static_cast<double>(channel.most)));
}

}  // namespace hapticd::daq
