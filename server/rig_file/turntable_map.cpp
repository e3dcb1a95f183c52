#include "server/rig_file/turntable_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "server/text/builtin_texts.h"
#include "server/text/suggestion.h"
#include "server/text/toml_writer.h"

namespace hapticd::server {

namespace {

using modbus::Condition;
using modbus::NumberType;
using modbus::Order;
using modbus::Register;
using modbus::RegisterMap;
using modbus::Sequence;
using modbus::Step;
using modbus::Table;
using modbus::Unit;

constexpr Word<Table> kTables[] = {{"coil", Table::kCoil},
                                   {"discrete_input", Table::kDiscreteInput},
                                   {"holding", Table::kHolding},
                                   {"input", Table::kInput}};
constexpr Word<NumberType> kTypes[] = {{"bit", NumberType::kBit}, {"u16", NumberType::kU16},
                                       {"s16", NumberType::kS16}, {"u32", NumberType::kU32},
                                       {"s32", NumberType::kS32}, {"f32", NumberType::kF32}};
constexpr Word<Order> kOrders[] = {{"big", Order::kBigFirst}, {"little", Order::kLittleFirst}};
constexpr Word<Unit> kUnits[] = {{"", Unit::kNone},
                                 {"deg", Unit::kDeg},
                                 {"rad", Unit::kRad},
                                 {"turn", Unit::kTurn},
                                 {"motor_turn", Unit::kMotorTurn},
                                 {"step", Unit::kStep},
                                 {"deg_per_s", Unit::kDegPerS},
                                 {"rad_per_s", Unit::kRadPerS},
                                 {"motor_rpm", Unit::kMotorRpm},
                                 {"step_per_s", Unit::kStepPerS},
                                 {"deg_per_s2", Unit::kDegPerS2},
                                 {"motor_rpm_per_s", Unit::kMotorRpmPerS},
                                 {"step_per_s2", Unit::kStepPerS2},
                                 {"ms_to_1000_rpm", Unit::kMsTo1000Rpm}};
constexpr Word<Step::Kind> kQuantities[] = {{"target", Step::Kind::kTarget},
                                            {"speed", Step::Kind::kSpeed},
                                            {"acceleration", Step::Kind::kAcceleration}};

constexpr Range kAddress{0.0, 65535.0, ""};
constexpr Range kFactor{-1e9, 1e9, ""};
constexpr Range kBit{0.0, 31.0, ""};
constexpr Range kBits{0.0, 4294967295.0, ""};
constexpr Range kNumber{-2147483648.0, 4294967295.0, ""};
constexpr Range kWaitS{0.0, 1.0, "s"};
/// A number takes two registers; the protocol allows 125.
constexpr Range kRegistersPerRead{2.0, 125.0, ""};
constexpr std::size_t kMaxRegisters = 128;
constexpr std::size_t kMaxSteps = 32;
constexpr std::size_t kMaxName = 64;

/// Names of registers are keys of a table: they must not be paths.
bool is_name(const std::string& name) {
  return !name.empty() && name.size() <= kMaxName && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
}

template <class Table>
void register_fields(Table& table, auto& one) {
  table.field("table", one.table, kTables);
  std::uint32_t address = one.address;
  table.field("address", address, kAddress);
  if constexpr (Table::kReads) one.address = static_cast<std::uint16_t>(address);
  table.field("type", one.format.type, kTypes);
  table.field("word_order", one.format.word_order, kOrders);
  table.field("byte_order", one.format.byte_order, kOrders);
  table.field("unit", one.unit, kUnits);
  table.field("scale", one.scale, kFactor);
  table.field("offset", one.offset, kFactor);
}

class MapReader {
 public:
  explicit MapReader(RegisterMap& map) : map_(map) {}

  std::optional<hal::Error> read(TomlTable table) {
    table.read("source", map_.source, 4096);
    table.read("always_homed", map_.always_homed);
    std::uint32_t per_read = map_.max_registers_per_read;
    table.read("max_registers_per_read", per_read, kRegistersPerRead);
    map_.max_registers_per_read = static_cast<std::uint16_t>(per_read);
    read_registers(table.table("registers"));

    std::optional<std::size_t> position;
    read_reference(table, "position_actual", position);
    read_reference(table, "velocity_actual", map_.velocity_actual);
    read_reference(table, "alarm_code", map_.alarm_code);
    TomlTable status = table.table("status");
    read_condition(status, "homed", map_.homed);
    read_condition(status, "moving", map_.moving);
    read_condition(status, "in_position", map_.in_position);
    read_condition(status, "alarm", map_.alarm);
    read_sequence(table, "setup", map_.setup);
    read_sequence(table, "start", map_.start);
    read_sequence(table, "home", map_.home);
    read_sequence(table, "stop", map_.stop);
    read_sequence(table, "reset", map_.reset);
    read_sequence(table, "release", map_.release);
    read_alarms(table.table("alarms"));
    if (!position) {
      if (refused_) return std::nullopt;  // reported by its line already
      return hal::Error::of(hal::ErrorCode::kMissingKey, "position_actual is missing",
                            "register map '" + map_.name + "'", "",
                            "position_actual = the name of a register", "add it");
    }
    map_.position_actual = *position;
    if (refused_) return std::nullopt;
    return modbus::check(map_);
  }

 private:
  void refuse(TomlTable& table, std::string_view key, hal::Error error) {
    refused_ = true;
    table.refuse(key, std::move(error));
  }

  void read_registers(TomlTable table) {
    const auto names = table.keys();
    for (const std::string& name : names) {
      if (!is_name(name) || map_.registers.size() >= kMaxRegisters) {
        table.wants(name);
        refuse(table, name,
               hal::Error::of(hal::ErrorCode::kMalformed, "no name for a register, or one too many", "", name,
                              fmt::format("up to {} registers, names of up to {} of a-z A-Z 0-9 _ -",
                                          kMaxRegisters, kMaxName),
                              "rename or remove it"));
        continue;
      }
      Register one;
      one.name = name;
      TomlTable inner = table.table(name);
      register_fields(inner, one);
      if (!inner.has("address")) {
        refuse(table, name,
               hal::Error::of(hal::ErrorCode::kMissingKey, "the register has no address", "", name,
                              "address = 0 … 65535", "add it"));
      }
      map_.registers.push_back(std::move(one));
    }
  }

  std::vector<std::string> register_names() const {
    std::vector<std::string> names;
    for (const Register& one : map_.registers) names.push_back(one.name);
    return names;
  }

  /// Reads the register named under `key`; nothing if the key is absent. An unknown name is refused.
  void read_reference(TomlTable& table, std::string_view key, std::optional<std::size_t>& index) {
    std::string name;
    table.read(key, name, kMaxName);
    if (!table.has(key) || name.empty()) return;
    const auto names = register_names();
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
      refuse(table, key,
             hal::Error::of(hal::ErrorCode::kUnknownWord, "no such register", "", name,
                            comma_separated(names), did_you_mean(name, names, "name one of those")));
      return;
    }
    index = static_cast<std::size_t>(found - names.begin());
  }

  void read_condition(TomlTable& status, std::string_view key, std::optional<Condition>& condition) {
    TomlTable table = status.table(key);
    if (!status.has(key)) return;
    Condition read;
    std::optional<std::size_t> index;
    read_reference(table, "register", index);
    std::uint32_t bit = 0;
    table.read("bit", bit, kBit);
    table.read("mask", read.mask, kBits);
    table.read("equals", read.equals, kBits);
    table.read("negated", read.negated);
    if (table.has("bit") && (table.has("mask") || table.has("equals"))) {
      refuse(table, "bit",
             hal::Error::of(hal::ErrorCode::kContradiction, "a condition names a bit and a mask", "", "",
                            "bit, or mask and equals", "leave one out"));
    }
    if (table.has("bit")) read.mask = read.equals = 1U << bit;
    if (!index) {
      if (!table.has("register")) {
        refuse(status, key,
               hal::Error::of(hal::ErrorCode::kMissingKey, "a condition names no register", "", "",
                              "register = \"…\"", "add it"));
      }
      return;
    }
    read.register_index = *index;
    condition = read;
  }

  void read_sequence(TomlTable& owner, std::string_view key, Sequence& sequence) {
    for (TomlTable& table : owner.tables(key, kMaxSteps)) {
      Step step;
      std::optional<std::size_t> index;
      read_reference(table, "register", index);
      table.read("write", step.kind, kQuantities);
      double value = 0.0;
      table.read("value", value, kNumber);
      std::uint32_t bits = 0;
      table.read("set", bits, kBits);
      table.read("clear", bits, kBits);
      table.read("then_wait_s", step.then_wait_s, kWaitS);
      const int kinds =
          int{table.has("write")} + int{table.has("value")} + int{table.has("set")} + int{table.has("clear")};
      if (kinds != 1 || !table.has("register") || value != std::floor(value)) {
        refuse(owner, key,
               hal::Error::of(hal::ErrorCode::kMalformed, "a step is not one write of one register", "",
                              std::string(key),
                              "register = \"…\" and one of write, value (whole), set, clear", "correct it"));
        return;
      }
      if (table.has("set")) step.kind = Step::Kind::kSet;
      if (table.has("clear")) step.kind = Step::Kind::kClear;
      step.value = table.has("value") ? static_cast<std::uint32_t>(static_cast<std::int64_t>(value)) : bits;
      if (!index) return;
      step.register_index = *index;
      sequence.push_back(step);
    }
  }

  void read_alarms(TomlTable table) {
    for (const std::string& key : table.keys()) {
      const bool hex = key.starts_with("0x") || key.starts_with("0X");
      const char* begin = key.data() + (hex ? 2 : 0);
      const char* end = key.data() + key.size();
      std::uint32_t code = 0;
      const auto [stop, failure] = std::from_chars(begin, end, code, hex ? 16 : 10);
      std::string text;
      if (failure != std::errc{} || stop != end || begin == end) {
        table.wants(key);
        refuse(table, key,
               hal::Error::of(hal::ErrorCode::kMalformed, "no code of an alarm", "", key,
                              "a whole number, or 0x…", "correct it"));
        continue;
      }
      table.read(key, text, 200);
      map_.alarm_texts[code] = text;
    }
  }

  RegisterMap& map_;
  bool refused_ = false;
};

std::string write_sequence(const RegisterMap& map, std::string_view key, const Sequence& sequence) {
  std::string text = fmt::format("{} = [", key);
  for (const Step& step : sequence) {
    text += fmt::format("\n  {{ register = {}, ", toml_quoted(map.registers[step.register_index].name));
    switch (step.kind) {
      case Step::Kind::kValue:
        text += fmt::format("value = {}", step.value);
        break;
      case Step::Kind::kSet:
        text += fmt::format("set = {}", step.value);
        break;
      case Step::Kind::kClear:
        text += fmt::format("clear = {}", step.value);
        break;
      default:
        text += fmt::format("write = {}", toml_quoted(text_of(step.kind, kQuantities)));
    }
    text += fmt::format(", then_wait_s = {} }},", toml_number(step.then_wait_s));
  }
  return text + (sequence.empty() ? "]\n" : "\n]\n");
}

std::string write_condition(const RegisterMap& map, std::string_view key,
                            const std::optional<Condition>& condition) {
  if (!condition) return {};
  return fmt::format("{} = {{ register = {}, mask = {}, equals = {}, negated = {} }}\n", key,
                     toml_quoted(map.registers[condition->register_index].name), condition->mask,
                     condition->equals, condition->negated);
}

}  // namespace

std::optional<hal::Error> read_turntable_map(TomlTable table, RegisterMap& map) {
  return MapReader(map).read(std::move(table));
}

hal::Result<RegisterMap> parse_turntable_map(std::string_view text, std::string name, std::string source) {
  auto document = TomlDocument::parse(text, std::move(source));
  if (!document) return document.error();
  RegisterMap map;
  map.name = std::move(name);
  const auto problem = read_turntable_map(document->root(), map);
  if (auto error = document->error()) return *error;
  if (problem) return *problem;
  return map;
}

std::vector<std::string> turntable_map_names() {
  std::vector<std::string> names;
  for (const BuiltinText& text : builtin_turntable_maps()) names.emplace_back(text.name);
  std::sort(names.begin(), names.end());
  return names;
}

hal::Result<RegisterMap> find_turntable_map(const std::string& name_or_path) {
  if (name_or_path.find('/') != std::string::npos || name_or_path.ends_with(".toml")) {
    auto text = read_text_file(name_or_path);
    if (!text) return text.error();
    std::string name = name_or_path.substr(name_or_path.rfind('/') + 1);
    if (name.ends_with(".toml")) name.resize(name.size() - 5);
    return parse_turntable_map(*text, std::move(name), name_or_path);
  }
  for (const BuiltinText& text : builtin_turntable_maps()) {
    if (text.name == name_or_path) {
      return parse_turntable_map(text.toml, name_or_path, "built-in register map '" + name_or_path + "'");
    }
  }
  const auto names = turntable_map_names();
  return hal::Error::of(hal::ErrorCode::kNotFound, "no such register map", "", name_or_path,
                        comma_separated(names) + ", or a path",
                        did_you_mean(name_or_path, names, "use one of those, or write one of your own"));
}

std::string write_turntable_map(const RegisterMap& map, std::string_view prefix) {
  const auto name_of = [&map](std::size_t index) { return toml_quoted(map.registers[index].name); };
  std::string text = prefix.empty() ? std::string() : fmt::format("\n[{}]\n", prefix);
  TomlWriter root(text, std::string(prefix));
  root.field("source", map.source);
  root.field("always_homed", map.always_homed);
  root.field("max_registers_per_read", map.max_registers_per_read);
  text += fmt::format("position_actual = {}\n", name_of(map.position_actual));
  if (map.velocity_actual) text += fmt::format("velocity_actual = {}\n", name_of(*map.velocity_actual));
  if (map.alarm_code) text += fmt::format("alarm_code = {}\n", name_of(*map.alarm_code));
  text += write_sequence(map, "setup", map.setup) + write_sequence(map, "start", map.start) +
          write_sequence(map, "home", map.home) + write_sequence(map, "stop", map.stop) +
          write_sequence(map, "reset", map.reset) + write_sequence(map, "release", map.release);
  for (const Register& one : map.registers) {
    TomlWriter table = root.table("registers." + one.name);
    register_fields(table, one);
  }
  root.table("status");
  text += write_condition(map, "homed", map.homed) + write_condition(map, "moving", map.moving) +
          write_condition(map, "in_position", map.in_position) + write_condition(map, "alarm", map.alarm);
  root.table("alarms");
  for (const auto& [code, meaning] : map.alarm_texts)
    text += fmt::format("\"{}\" = {}\n", code, toml_quoted(meaning));
  return text;
}

}  // namespace hapticd::server
