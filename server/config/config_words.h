#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/config/config.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// The words of a configuration, for reading and for writing.
inline constexpr Word<RigChoice> kRigWords[] = {
    {"sim", RigChoice::kSimulated}, {"replay", RigChoice::kReplay}, {"hardware", RigChoice::kHardware}};
inline constexpr Word<DeviceChoice> kDeviceWords[] = {{"of_kind", DeviceChoice::kOfKind},
                                                      {"openhaptics", DeviceChoice::kOpenHaptics},
                                                      {"phantom", DeviceChoice::kPhantom}};
inline constexpr Word<SensorChoice> kSensorWords[] = {
    {"of_kind", SensorChoice::kOfKind}, {"netft", SensorChoice::kNetFt}, {"daq", SensorChoice::kDaq}};
inline constexpr Word<InstrumentChoice> kInstrumentWords[] = {{"none", InstrumentChoice::kNone},
                                                              {"board", InstrumentChoice::kBoard}};
inline constexpr Word<LogLevel> kLogWords[] = {{"debug", LogLevel::kDebug},
                                               {"info", LogLevel::kInfo},
                                               {"warning", LogLevel::kWarning},
                                               {"error", LogLevel::kError},
                                               {"off", LogLevel::kOff}};
inline constexpr Word<Role> kRoleWords[] = {{"none", Role::kNone},
                                            {"observer", Role::kObserver},
                                            {"operator", Role::kOperator},
                                            {"maintainer", Role::kMaintainer}};
inline constexpr Word<LeaseRule> kLeaseWords[] = {{"by_connection", LeaseRule::kByConnection},
                                                  {"when_taken", LeaseRule::kWhenTaken},
                                                  {"required", LeaseRule::kRequired}};
inline constexpr Word<bool> kSpeedWords[] = {{"recorded", false}, {"fast", true}};

/// Limits of values that the command line sets too.
inline constexpr Range kLoopRateHz{500.0, 10000.0, "Hz"};
inline constexpr Range kReplayScale{-1e9, 1e9, ""};
inline constexpr Range kReplayBiasS{0.0, 3600.0, "s"};

template <class E, std::size_t N>
std::vector<std::string> texts(const Word<E> (&words)[N]) {
  std::vector<std::string> list;
  for (const Word<E>& word : words) list.emplace_back(word.text);
  return list;
}

}  // namespace hapticd::server
