// The words a drive answers with: whatever they are, they are taken for numbers and statements, or refused.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "hal/modbus/register_codec.h"
#include "hal/modbus/register_map.h"
#include "hal/turntable/motion_supervisor.h"
#include "server/rig_file/turntable_map.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hapticd;
  static const std::vector<modbus::RegisterMap> maps = [] {
    std::vector<modbus::RegisterMap> all;
    for (const std::string& name : server::turntable_map_names())
      all.push_back(*server::find_turntable_map(name));
    return all;
  }();
  if (size < 3) return 0;
  modbus::RegisterMap map = maps[data[0] % maps.size()];
  modbus::NumberFormat& format = map.registers[map.position_actual].format;
  if (modbus::words_of(format.type) == 2 && (data[1] & 8U) != 0) format.type = modbus::NumberType::kF32;
  format.word_order = (data[1] & 1U) != 0 ? modbus::Order::kLittleFirst : modbus::Order::kBigFirst;
  format.byte_order = (data[1] & 2U) != 0 ? modbus::Order::kLittleFirst : modbus::Order::kBigFirst;
  const modbus::Gear gear{10000.0, 1.0 + data[2], (data[1] & 4U) != 0, 0.0};
  const auto plan = modbus::read_plan(map);

  turntable::MotionSupervisor supervisor{turntable::SupervisionSettings()};
  supervisor.begin_move(0.0, 0.0, 90.0, {90.0, 180.0});
  std::size_t at = 3;
  for (double now = 0.0; at < size && now < 100.0; now += 0.05) {
    modbus::BlockWords words;
    for (const modbus::ReadBlock& block : plan) {
      std::vector<std::uint16_t> answer;
      for (std::size_t i = 0; i < block.count && at + 1 < size; ++i, at += 2) {
        answer.push_back(static_cast<std::uint16_t>(data[at] * 256U + data[at + 1]));
      }
      words.push_back(std::move(answer));
    }
    ++at;
    const turntable::DriveReading reading = modbus::interpret(map, gear, plan, words);
    (void)modbus::hint_of_order(map, gear, plan, words, -180.0, 180.0);
    if (std::isfinite(reading.position_deg)) supervisor.observe(now, reading);
    // What was read can be written, bit for bit, unless it is not a number.
    for (std::size_t i = 0; i < words.size() && !words[i].empty(); ++i) {
      if (words[i].size() < modbus::words_of(format.type)) continue;
      const double number = modbus::decode(format, words[i]);
      const auto back = modbus::encode(format, number);
      if (!std::isfinite(number)) continue;
      if (!back || modbus::decode(format, *back) != number) std::abort();
    }
  }
  return 0;
}
