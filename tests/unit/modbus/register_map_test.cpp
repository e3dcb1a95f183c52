#include "hal/modbus/register_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "server/rig_file/turntable_map.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/texts.h"
#include "tests/support/value_of.h"

namespace hapticd::test {
namespace {

using modbus::BlockWords;
using modbus::ReadBlock;
using modbus::RegisterMap;
using modbus::Table;

constexpr const char* kSmall = R"(
position_actual = "position"
always_homed = true
start = [{ register = "target", write = "target" }, { register = "go", value = 1, then_wait_s = 0.01 }]
stop = [{ register = "go", value = -1 }]
[registers.position]
table = "input"
address = 10
type = "s32"
unit = "step"
[registers.target]
address = 20
type = "s32"
unit = "step"
[registers.go]
address = 22
type = "s16"
)";

hal::Result<RegisterMap> parse(const std::string& text) {
  return server::parse_turntable_map(text, "test", "test");
}

TEST(RegisterMap, AllBuiltInMapsAreInOrderAndReadBackAsTheSame) {
  const auto names = server::turntable_map_names();
  EXPECT_GE(names.size(), 3U);
  for (const std::string& name : names) {
    const auto map = test::value_of(server::find_turntable_map(name));
    EXPECT_NE(map.source, "") << name;
    const auto again = test::value_of(parse(server::write_turntable_map(map, "")));
    RegisterMap same = again;
    same.name = name;
    EXPECT_TRUE(same == map) << name;
  }
}

TEST(RegisterMap, IsReadFromAFileToo) {
  const TemporaryFolder folder;
  const auto map = test::value_of(server::find_turntable_map(folder.write("my_drive.toml", kSmall)));
  EXPECT_EQ(map.name, "my_drive");
  EXPECT_EQ(server::find_turntable_map("plain_drve").error().remedy, "did you mean 'plain_drive'?");
  EXPECT_FALSE(server::find_turntable_map("/nonexistent/map.toml"));
}

TEST(RegisterMap, SmallestOne) {
  const auto map = test::value_of(parse(kSmall));
  EXPECT_TRUE(map.always_homed);
  EXPECT_EQ(map.max_registers_per_read, 125);
  EXPECT_EQ(value_of(parse(std::string("max_registers_per_read = 2") + kSmall)).max_registers_per_read, 2);
  ASSERT_EQ(map.stop.size(), 1U);
  EXPECT_EQ(map.stop[0].value, 0xFFFFFFFFU);  // -1
  EXPECT_EQ(map.start[1].then_wait_s, 0.01);
}

TEST(RegisterMap, RefusesByNameAndLine) {
  using enum hal::ErrorCode;
  expect_refusals(
      {
          {replaced(kSmall, "unit = \"step\"", "unti = \"step\""), "'unti' in [registers.position]",
           kUnknownKey, 10},
          {replaced(kSmall, "write = \"target\"", "wirte = \"target\""), "a step", kMalformed, 4},
          {replaced(kSmall, "value = 1,", "value = 1, vaule = 2,"), "'vaule' in [start[1]]", kUnknownKey, 4},
          {replaced(kSmall, "position_actual = \"position\"", "position_actual = \"postion\""),
           "no such register", kUnknownWord, 2},
          {replaced(kSmall, "address = 10", "address = 65536"), "'registers.position.address'", kOutOfRange,
           8, "0 … 65535"},
          {std::string("max_registers_per_read = 1") + kSmall, "'max_registers_per_read'", kOutOfRange, 1,
           "2 … 125"},
          {replaced(kSmall, "address = 10\n", ""), "no address", kMissingKey, 6},
          {replaced(kSmall, "\"s32\"", "\"s64\""), "'registers.position.type'", kUnknownWord, 9,
           "bit, u16, s16, u32, s32, f32"},
          {replaced(kSmall, "value = 1,", "value = 1, set = 2,"), "a step", kMalformed, 4},
          {replaced(kSmall, "value = 1,", "value = 1.5,"), "a step", kMalformed, 4},
          {replaced(kSmall, "[registers.go]", "[registers.\"a.b\"]\naddress = 1\n[registers.go]"), "register",
           kMalformed, 15},
          {std::string(kSmall) + "[alarms]\nhot = \"x\"", "alarm", kMalformed, 19},
          {"stop = 3", "'stop'", kWrongType, 1},
          {"a = [", "test, line 1", kSyntax},
      },
      parse);
}

TEST(RegisterMap, RefusesWhatNoTableShouldBeTurnedWith) {
  using enum hal::ErrorCode;
  expect_refusals(
      {
          {replaced(kSmall, "always_homed = true", ""), "homed", kMissingKey},
          {replaced(kSmall, "stop = [{ register = \"go\", value = -1 }]", ""), "stop", kMissingKey},
          {replaced(kSmall, "{ register = \"target\", write = \"target\" },", ""), "'start'", kMissingKey},
          {replaced(kSmall, "position_actual = \"position\"", ""), "position_actual", kMissingKey},
          {replaced(kSmall, "unit = \"step\"", "unit = \"motor_rpm\""), "the position", kContradiction},
          {replaced(kSmall, "[registers.target]", "[registers.target]\ntable = \"input\""), "'start'",
           kContradiction},
          {replaced(kSmall, "address = 10", "address = 65535"), "the last address", kOutOfRange},
          {replaced(kSmall, "address = 10", "address = 10\nscale = 0"), "scale", kOutOfRange},
      },
      parse);
}

TEST(RegisterMap, ReadsTogetherWhatLiesTogetherAndNothingElse) {
  const auto plain = value_of(server::find_turntable_map("plain_drive"));
  EXPECT_EQ(modbus::read_plan(plain), (std::vector<ReadBlock>{{Table::kInput, 0, 6}}));
  RegisterMap limited = plain;
  limited.max_registers_per_read = 3;
  EXPECT_EQ(modbus::read_plan(limited),
            (std::vector<ReadBlock>{{Table::kInput, 0, 2}, {Table::kInput, 2, 3}, {Table::kInput, 5, 1}}));
  const auto az = value_of(server::find_turntable_map("oriental_az"));
  EXPECT_EQ(modbus::read_plan(az),
            (std::vector<ReadBlock>{{Table::kHolding, 0x7F, 3}, {Table::kHolding, 0xCC, 2}}));
}

TEST(RegisterMap, MakesSenseOfAnswers) {
  const auto map = value_of(server::find_turntable_map("plain_drive"));
  const auto plan = modbus::read_plan(map);
  const modbus::Gear gear;
  // -90.5 deg, 2.5 deg/s, homed and moving, alarm code 7.
  const BlockWords words{{0xFFFE, 0x9E7C, 0x4020, 0x0000, 0x0006, 0x0007}};
  const auto reading = modbus::interpret(map, gear, plan, words);
  EXPECT_NEAR(reading.position_deg, -90.5, 1e-9);
  EXPECT_NEAR(*reading.velocity_deg_per_s, 2.5, 1e-9);
  EXPECT_TRUE(*reading.homed);
  EXPECT_TRUE(*reading.moving);
  EXPECT_FALSE(*reading.in_position);
  EXPECT_FALSE(*reading.alarm);
  EXPECT_EQ(reading.alarm_code, 7U);
}

TEST(RegisterMap, MakesNothingOfAnswersThatAreNotThere) {
  const auto map = value_of(server::find_turntable_map("plain_drive"));
  const auto plan = modbus::read_plan(map);
  for (const BlockWords& words : {BlockWords{}, BlockWords{{}}, BlockWords{{1}}}) {
    const auto reading = modbus::interpret(map, {}, plan, words);
    EXPECT_TRUE(std::isnan(reading.position_deg));
    EXPECT_FALSE(reading.homed);
  }
}

TEST(RegisterMap, ASwappedFloatThatLooksLikeNothingIsNoPosition) {
  auto map = value_of(server::find_turntable_map("plain_drive"));
  modbus::Register& position = map.registers[map.position_actual];
  position.format = {modbus::NumberType::kF32, modbus::Order::kLittleFirst, modbus::Order::kBigFirst};
  position.scale = 1.0;
  const auto plan = modbus::read_plan(map);
  const BlockWords words{{0x42B4, 0x0000, 0, 0, 0, 0}};  // 90.0, high word first
  EXPECT_TRUE(std::isnan(modbus::interpret(map, {}, plan, words).position_deg));
  const std::string hint = modbus::hint_of_order(map, {}, plan, words, -180.0, 180.0);
  EXPECT_NE(hint.find("word_order = \"big\""), std::string::npos) << hint;
  EXPECT_NE(hint.find("90 deg"), std::string::npos) << hint;
}

TEST(RegisterMap, ConditionsMayBeMasksAndNegated) {
  auto map = test::value_of(parse(replaced(kSmall, "[registers.go]", R"([status]
moving = { register = "go", mask = 0xF0, equals = 0x20 }
alarm = { register = "go", bit = 0, negated = true }
[registers.go])")));
  const auto plan = modbus::read_plan(map);
  const auto reported = [&](std::uint16_t go) { return modbus::interpret(map, {}, plan, {{go}, {0, 0}}); };
  ASSERT_EQ(plan.size(), 2U);
  EXPECT_TRUE(*reported(0x2F).moving);
  EXPECT_FALSE(*reported(0x30).moving);
  EXPECT_FALSE(*reported(0x2F).alarm);
  EXPECT_TRUE(*reported(0x2E).alarm);
}

}  // namespace
}  // namespace hapticd::test
