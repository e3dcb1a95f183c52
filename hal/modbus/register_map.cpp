#include "hal/modbus/register_map.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace hapticd::modbus {

namespace {

/// The protocol's maximum.
constexpr unsigned kMaxBits = 2000;

bool is_bit(Table table) {
  return table == Table::kCoil || table == Table::kDiscreteInput;
}
bool is_writable(Table table) {
  return table == Table::kCoil || table == Table::kHolding;
}

hal::Error complaint(const RegisterMap& map, hal::ErrorCode code, std::string what, std::string value,
                     std::string limit, std::string remedy) {
  return hal::Error::of(code, std::move(what), "register map '" + map.name + "'", std::move(value),
                        std::move(limit), std::move(remedy));
}

std::optional<hal::Error> check_register(const RegisterMap& map, const Register& one) {
  if ((one.format.type == NumberType::kBit) != is_bit(one.table)) {
    return complaint(map, hal::ErrorCode::kContradiction,
                     "coils and discrete inputs hold bits; registers hold numbers", one.name,
                     "type \"bit\" for both, another for registers",
                     "give the register a number type; name its bits where they are used");
  }
  if (one.address + words_of(one.format.type) > 0x10000U) {
    return complaint(map, hal::ErrorCode::kOutOfRange, "the register lies beyond the last address", one.name,
                     "0 … 65535", "correct the address");
  }
  if (!std::isfinite(one.scale) || !std::isfinite(one.offset) || one.scale == 0.0) {
    return complaint(map, hal::ErrorCode::kOutOfRange, "the scale of a register is not valid", one.name,
                     "finite and not 0", "correct it");
  }
  return std::nullopt;
}

std::optional<hal::Error> check_quantity(const RegisterMap& map, std::size_t index, Dimension wanted,
                                         const char* what, const char* units) {
  const Register& one = map.registers[index];
  if (dimension_of(one.unit) == wanted) return std::nullopt;
  return complaint(map, hal::ErrorCode::kContradiction, std::string(what) + " has the wrong unit", one.name,
                   units, "use one of those");
}

std::optional<hal::Error> check_sequence(const RegisterMap& map, const Sequence& sequence, const char* name) {
  for (const Step& step : sequence) {
    if (step.register_index >= map.registers.size()) {
      return complaint(map, hal::ErrorCode::kUnknownWord,
                       std::string("'") + name + "' writes an unknown register", "", "", "name it");
    }
    const Register& one = map.registers[step.register_index];
    if (!is_writable(one.table)) {
      return complaint(map, hal::ErrorCode::kContradiction,
                       std::string("'") + name + "' writes a register that can only be read", one.name,
                       "coil or holding", "correct its table");
    }
    std::optional<hal::Error> error;
    if (step.kind == Step::Kind::kTarget) {
      error = check_quantity(map, step.register_index, Dimension::kAngle, "the target", "a unit of angle");
    } else if (step.kind == Step::Kind::kSpeed) {
      error =
          check_quantity(map, step.register_index, Dimension::kSpeed, "the speed limit", "a unit of speed");
    } else if (step.kind == Step::Kind::kAcceleration) {
      error = check_quantity(map, step.register_index, Dimension::kAcceleration, "the acceleration limit",
                             "a unit of acceleration");
    } else if (step.kind != Step::Kind::kValue && one.format.type == NumberType::kF32) {
      error = complaint(map, hal::ErrorCode::kContradiction,
                        std::string("'") + name + "' sets or clears bits of a float", one.name,
                        "a whole number", "correct its type");
    }
    if (error) return error;
  }
  return std::nullopt;
}

void add_to_plan(std::vector<ReadBlock>& wanted, const RegisterMap& map, std::size_t index) {
  const Register& one = map.registers[index];
  wanted.push_back({one.table, one.address, static_cast<std::uint16_t>(words_of(one.format.type))});
}

std::optional<bool> holds(const RegisterMap& map, const std::optional<Condition>& condition,
                          std::span<const ReadBlock> plan, const BlockWords& words) {
  if (!condition) return std::nullopt;
  const Register& one = map.registers[condition->register_index];
  const auto found = words_in(one, plan, words);
  if (found.empty()) return std::nullopt;
  const bool equal = (decode_bits(one.format, found) & condition->mask) == condition->equals;
  return equal != condition->negated;
}

/// A two-register float in the wrong order is more often tiny than large.
constexpr double kTiniest = 1e-20;

double quantity(const Register& one, const Gear& gear, std::span<const std::uint16_t> words) {
  const double number = decode(one.format, words);
  if (one.format.type == NumberType::kF32 && number != 0.0 && std::abs(number) < kTiniest) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return to_table(number * one.scale + one.offset, one.unit, gear);
}

}  // namespace

std::optional<hal::Error> check(const RegisterMap& map) {
  for (const Register& one : map.registers) {
    if (auto error = check_register(map, one)) return error;
  }
  const auto known = [&map](std::size_t index) { return index < map.registers.size(); };
  bool all_known = known(map.position_actual) && known(map.velocity_actual.value_or(map.position_actual)) &&
                   known(map.alarm_code.value_or(map.position_actual));
  for (const auto* condition : {&map.homed, &map.moving, &map.in_position, &map.alarm}) {
    if (!*condition) continue;
    all_known = all_known && known((*condition)->register_index);
    if (((*condition)->equals & ~(*condition)->mask) != 0) {
      return complaint(map, hal::ErrorCode::kContradiction, "a condition tests bits outside its mask", "",
                       "equals within mask", "correct it");
    }
  }
  if (!all_known)
    return complaint(map, hal::ErrorCode::kUnknownWord, "an unknown register is used", "", "", "name it");
  if (auto error =
          check_quantity(map, map.position_actual, Dimension::kAngle, "the position", "a unit of angle")) {
    return error;
  }
  if (map.velocity_actual) {
    if (auto error =
            check_quantity(map, *map.velocity_actual, Dimension::kSpeed, "the velocity", "a unit of speed")) {
      return error;
    }
  }
  if (!map.homed && !map.always_homed) {
    return complaint(map, hal::ErrorCode::kMissingKey, "nothing says whether the drive is homed", "",
                     "'homed' or always_homed = true",
                     "name the bit; use always_homed only for an absolute encoder");
  }
  const auto starts_with = [&map](Step::Kind kind) {
    return std::any_of(map.start.begin(), map.start.end(),
                       [kind](const Step& step) { return step.kind == kind; });
  };
  if (!starts_with(Step::Kind::kTarget)) {
    return complaint(map, hal::ErrorCode::kMissingKey, "'start' writes no target", "",
                     "a step with write = \"target\"", "add it");
  }
  if (map.stop.empty()) {
    return complaint(map, hal::ErrorCode::kMissingKey, "there is no command to stop the table", "",
                     "at least one step of 'stop'", "a table that cannot be stopped is not to be turned");
  }
  struct Named {
    const Sequence& sequence;
    const char* name;
  };
  for (const Named& one :
       {Named{map.setup, "setup"}, Named{map.start, "start"}, Named{map.home, "home"},
        Named{map.stop, "stop"}, Named{map.reset, "reset"}, Named{map.release, "release"}}) {
    if (auto error = check_sequence(map, one.sequence, one.name)) return error;
  }
  return std::nullopt;
}

std::vector<ReadBlock> read_plan(const RegisterMap& map) {
  std::vector<ReadBlock> wanted;
  add_to_plan(wanted, map, map.position_actual);
  if (map.velocity_actual) add_to_plan(wanted, map, *map.velocity_actual);
  if (map.alarm_code) add_to_plan(wanted, map, *map.alarm_code);
  for (const auto* condition : {&map.homed, &map.moving, &map.in_position, &map.alarm}) {
    if (*condition) add_to_plan(wanted, map, (*condition)->register_index);
  }
  std::sort(wanted.begin(), wanted.end(), [](const ReadBlock& a, const ReadBlock& b) {
    return a.table != b.table ? a.table < b.table : a.address < b.address;
  });
  std::vector<ReadBlock> plan;
  for (const ReadBlock& block : wanted) {
    const unsigned end = block.address + unsigned{block.count};
    if (!plan.empty()) {
      ReadBlock& last = plan.back();
      const unsigned last_end = last.address + unsigned{last.count};
      const unsigned joined = std::max(end, last_end) - last.address;
      if (last.table == block.table && block.address <= last_end &&
          joined <= (is_bit(block.table) ? kMaxBits : unsigned{map.max_registers_per_read})) {
        last.count = static_cast<std::uint16_t>(joined);
        continue;
      }
    }
    plan.push_back(block);
  }
  return plan;
}

std::span<const std::uint16_t> words_in(const Register& wanted, std::span<const ReadBlock> plan,
                                        const BlockWords& words) {
  const std::size_t count = words_of(wanted.format.type);
  for (std::size_t i = 0; i < plan.size() && i < words.size(); ++i) {
    if (plan[i].table != wanted.table || wanted.address < plan[i].address) continue;
    const std::size_t offset = static_cast<std::size_t>(wanted.address) - plan[i].address;
    if (offset + count > plan[i].count || offset + count > words[i].size()) continue;
    return std::span(words[i]).subspan(offset, count);
  }
  return {};
}

turntable::DriveReading interpret(const RegisterMap& map, const Gear& gear, std::span<const ReadBlock> plan,
                                  const BlockWords& words) {
  turntable::DriveReading reading;
  const Register& position = map.registers[map.position_actual];
  reading.position_deg = quantity(position, gear, words_in(position, plan, words));
  if (map.velocity_actual) {
    const Register& velocity = map.registers[*map.velocity_actual];
    reading.velocity_deg_per_s = quantity(velocity, gear, words_in(velocity, plan, words));
  }
  reading.homed = map.always_homed ? std::optional(true) : holds(map, map.homed, plan, words);
  reading.moving = holds(map, map.moving, plan, words);
  reading.in_position = holds(map, map.in_position, plan, words);
  reading.alarm = holds(map, map.alarm, plan, words);
  if (map.alarm_code) {
    const Register& code = map.registers[*map.alarm_code];
    reading.alarm_code = decode_bits(code.format, words_in(code, plan, words));
    if (!map.alarm) reading.alarm = reading.alarm_code != 0;
  }
  return reading;
}

std::string hint_of_order(const RegisterMap& map, const Gear& gear, std::span<const ReadBlock> plan,
                          const BlockWords& words, double min_deg, double max_deg) {
  Register position = map.registers[map.position_actual];
  const auto found = words_in(position, plan, words);
  if (found.empty()) return {};
  const NumberFormat reported = position.format;
  for (const Order word_order : {Order::kBigFirst, Order::kLittleFirst}) {
    for (const Order byte_order : {Order::kBigFirst, Order::kLittleFirst}) {
      position.format.word_order = word_order;
      position.format.byte_order = byte_order;
      if (position.format == reported) continue;
      if (words_of(reported.type) == 1 && word_order != reported.word_order) continue;
      const double other = quantity(position, gear, found);
      if (!(other >= min_deg && other <= max_deg)) continue;
      char text[200];
      std::snprintf(
          text, sizeof text,
          "with word_order = \"%s\" and byte_order = \"%s\" it would be %.4g deg: check the order of "
          "'%s' in the register map",
          word_order == Order::kBigFirst ? "big" : "little",
          byte_order == Order::kBigFirst ? "big" : "little", other, position.name.c_str());
      return text;
    }
  }
  return {};
}

}  // namespace hapticd::modbus
