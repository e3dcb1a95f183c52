#include "hal/netft/rdt_status.h"

#include <algorithm>
#include <array>

namespace hapticd::netft {

namespace {

constexpr unsigned kSummary = 31;
constexpr unsigned kSaturation = 17;
constexpr unsigned kConditionLatched = 16;

constexpr std::uint32_t mask(unsigned bit) noexcept {
  return std::uint32_t{1} << bit;
}

constexpr std::string_view kService = "switch the box off and on; if it stays, have it serviced";
constexpr std::string_view kSupply = "check the power supply and the transducer cable";

constexpr std::array<RdtStatusBit, 17> kBits{{
    {30, "CPU or RAM error", kService},
    {28, "analog board error", kService},
    {27, "no or faulty serial link between the boards",
     "check the transducer cable, switch the box off and on"},
    {25, "halted due to its configuration", "check the box's configuration page and apply it again"},
    {24, "settings failed their validation", "apply the box's settings again and save them"},
    {23, "settings do not match the calibration",
     "select on the box's configuration page the calibration of the connected transducer"},
    {22, "network error", "check the box's network cable and its communication settings"},
    {20, "RDT error", "lower the rate of the RDT output on the box's communication page"},
    {kSaturation, "gage saturated or A/D error",
     "unload the sensor; if it stays, the transducer is overloaded or its cable is broken"},
    {kConditionLatched, "a threshold condition has latched",
     "reset the condition latch on the box's page, or switch its threshold conditions off"},
    {14, "watchdog reset", kService},
    {9, "gage excitation too high", kSupply},
    {8, "gage excitation too low", kSupply},
    {6, "supply voltage too high", kSupply},
    {5, "supply voltage too low", kSupply},
    {4, "no data on the link to the transducer", "check the transducer cable"},
    {2, "temperature out of range", "keep box and transducer within their temperature range"},
}};

}  // namespace

RdtFitness judge_rdt_status(std::uint32_t status) noexcept {
  if (status == 0) return {};
  RdtFitness fitness;
  fitness.saturated = (status & mask(kSaturation)) != 0;
  fitness.warning = (status & mask(kConditionLatched)) != 0;
  const std::uint32_t others = status & ~(mask(kSummary) | mask(kSaturation) | mask(kConditionLatched));
  const bool unexplained = !fitness.saturated && !fitness.warning;
  fitness.faulty = others != 0 || unexplained;
  return fitness;
}

std::vector<std::string> describe_rdt_status(std::uint32_t status) {
  std::vector<std::string> described;
  for (unsigned bit = kSummary; bit-- > 0;) {
    if ((status & mask(bit)) == 0) continue;
    const auto* known = std::find_if(kBits.begin(), kBits.end(),
                                     [bit](const RdtStatusBit& entry) { return entry.bit == bit; });
    const std::string place = " (status bit " + std::to_string(bit) + ")";
    if (known != kBits.end()) {
      described.push_back(std::string(known->name) + place + ": " + std::string(known->remedy));
    } else {
      described.push_back("undocumented error" + place + ": " + std::string(kService));
    }
  }
  if (status == mask(kSummary)) {
    described.push_back("error without a cause (status bit 31): " + std::string(kService));
  }
  return described;
}

}  // namespace hapticd::netft
