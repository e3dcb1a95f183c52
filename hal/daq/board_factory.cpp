#include "hal/daq/board_factory.h"

#include <fmt/format.h>

#include <cmath>

namespace hapticd::daq {

namespace {

bool is_index(double value, double most) {
  return value >= 0.0 && value <= most && value == std::floor(value);
}

constexpr double kMaxChannel = 255.0;

hal::Error bad(std::string what, std::string value, std::string limit) {
  return hal::Error::of(hal::ErrorCode::kOutOfRange, std::move(what), "board", std::move(value),
                        std::move(limit), "correct the board's section");
}

}  // namespace

hal::Result<std::shared_ptr<Board>> create_board(const BoardConfig& config) {
  if (!(config.scan_rate_hz >= 100.0 && config.scan_rate_hz <= 100'000.0)) {
    return bad("the scan rate is out of range", fmt::format("{}", config.scan_rate_hz), "100 … 100000 Hz");
  }
  if (config.driver != "comedi") {
    return hal::Error::of(hal::ErrorCode::kUnknownWord,
                          fmt::format("unknown board driver '{}'", config.driver), "board", config.driver,
                          fmt::format("{}", fmt::join(board_drivers(), ", ")), "use one of those");
  }
  const ComediConfig& comedi = config.comedi;
  for (const double channel : comedi.input_channels) {
    if (!is_index(channel, kMaxChannel)) {
      return bad("an input channel is not valid", fmt::format("{}", channel), "0 … 255");
    }
  }
  if (config.spare_channels.size() > kSpareInputs) {
    return bad("too many inputs in addition to the gauges", fmt::format("{}", config.spare_channels.size()),
               fmt::format("at most {}", kSpareInputs));
  }
  for (const double channel : config.spare_channels) {
    if (!is_index(channel, kMaxChannel)) {
      return bad("an input channel is not valid", fmt::format("{}", channel), "0 … 255");
    }
  }
  for (const double channel : comedi.output_channels) {
    if (!is_index(channel, kMaxChannel)) {
      return bad("an output channel is not valid", fmt::format("{}", channel), "0 … 255");
    }
  }
  if (comedi.counters.size() > kMaxCounters) {
    return bad("too many counters", fmt::format("{}", comedi.counters.size()),
               fmt::format("at most {}", kMaxCounters));
  }
  for (const auto& [subdevice, channel] : comedi.counters) {
    if (!is_index(subdevice, kMaxChannel) || !is_index(channel, kMaxChannel)) {
      return bad("a counter is not valid", fmt::format("[{}, {}]", subdevice, channel),
                 "[subdevice, channel], each 0 … 255");
    }
  }
  if (!(comedi.input_low_v < comedi.input_high_v) || !(comedi.output_low_v < comedi.output_high_v)) {
    return bad("a range of voltages is empty",
               fmt::format("{} … {} V in, {} … {} V out", comedi.input_low_v, comedi.input_high_v,
                           comedi.output_low_v, comedi.output_high_v),
               "low less than high");
  }
  return create_comedi_board(config);
}

std::vector<std::string> board_drivers() {
  return {"comedi"};
}

}  // namespace hapticd::daq
