#include "hal/modbus/register_codec.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "hal/modbus/units.h"

namespace hapticd::modbus {
namespace {

/// A number, and the bytes it is on the wire in the four orders, as a manual would print them.
struct Known {
  NumberType type;
  double value;
  std::vector<std::uint16_t> big_big;        // high word first, high byte first
  std::vector<std::uint16_t> little_big;     // low word first
  std::vector<std::uint16_t> big_little;     // bytes swapped
  std::vector<std::uint16_t> little_little;  // both
};

const std::vector<Known>& known() {
  static const std::vector<Known> all{
      {NumberType::kU16, 0xABCD, {0xABCD}, {0xABCD}, {0xCDAB}, {0xCDAB}},
      {NumberType::kU16, 65535, {0xFFFF}, {0xFFFF}, {0xFFFF}, {0xFFFF}},
      {NumberType::kS16, -2, {0xFFFE}, {0xFFFE}, {0xFEFF}, {0xFEFF}},
      {NumberType::kS16, -32768, {0x8000}, {0x8000}, {0x0080}, {0x0080}},
      {NumberType::kU32, 305419896, {0x1234, 0x5678}, {0x5678, 0x1234}, {0x3412, 0x7856}, {0x7856, 0x3412}},
      {NumberType::kU32,
       4294967295.0,
       {0xFFFF, 0xFFFF},
       {0xFFFF, 0xFFFF},
       {0xFFFF, 0xFFFF},
       {0xFFFF, 0xFFFF}},
      {NumberType::kS32, -1000, {0xFFFF, 0xFC18}, {0xFC18, 0xFFFF}, {0xFFFF, 0x18FC}, {0x18FC, 0xFFFF}},
      {NumberType::kS32,
       -2147483648.0,
       {0x8000, 0x0000},
       {0x0000, 0x8000},
       {0x0080, 0x0000},
       {0x0000, 0x0080}},
      {NumberType::kF32, 1.0, {0x3F80, 0x0000}, {0x0000, 0x3F80}, {0x803F, 0x0000}, {0x0000, 0x803F}},
      {NumberType::kF32,
       -123.456001281738,
       {0xC2F6, 0xE979},
       {0xE979, 0xC2F6},
       {0xF6C2, 0x79E9},
       {0x79E9, 0xF6C2}},
      {NumberType::kBit, 1, {1}, {1}, {1}, {1}},
      {NumberType::kBit, 0, {0}, {0}, {0}, {0}},
  };
  return all;
}

TEST(RegisterCodec, ReadsAndWritesWhatManualsPrint) {
  for (const Known& one : known()) {
    const std::vector<std::pair<NumberFormat, const std::vector<std::uint16_t>*>> orders{
        {{one.type, Order::kBigFirst, Order::kBigFirst}, &one.big_big},
        {{one.type, Order::kLittleFirst, Order::kBigFirst}, &one.little_big},
        {{one.type, Order::kBigFirst, Order::kLittleFirst}, &one.big_little},
        {{one.type, Order::kLittleFirst, Order::kLittleFirst}, &one.little_little}};
    for (const auto& [format, words] : orders) {
      if (one.type == NumberType::kBit && format.byte_order == Order::kLittleFirst)
        continue;  // bits have no bytes
      EXPECT_NEAR(decode(format, *words), one.value, 1e-9) << one.value;
      const auto encoded = encode(format, one.value);
      ASSERT_TRUE(encoded) << one.value;
      for (std::size_t i = 0; i < words->size(); ++i)
        EXPECT_EQ((*encoded)[i], (*words)[i]) << one.value << " " << i;
    }
  }
}

TEST(RegisterCodec, RefusesWhatATypeCannotHold) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(encode({NumberType::kU16}, 65536));
  EXPECT_FALSE(encode({NumberType::kU16}, -1));
  EXPECT_FALSE(encode({NumberType::kS16}, 32768));
  EXPECT_FALSE(encode({NumberType::kS16}, -32769));
  EXPECT_FALSE(encode({NumberType::kU32}, 4294967296.0));
  EXPECT_FALSE(encode({NumberType::kS32}, 2147483648.0));
  EXPECT_FALSE(encode({NumberType::kF32}, 1e39));
  EXPECT_FALSE(encode({NumberType::kF32}, nan));
  EXPECT_FALSE(encode({NumberType::kS32}, nan));
  EXPECT_FALSE(encode({NumberType::kS32}, std::numeric_limits<double>::infinity()));
  EXPECT_FALSE(encode({NumberType::kBit}, 2));
}

TEST(RegisterCodec, RoundsToTheNearestWhole) {
  EXPECT_EQ((*encode({NumberType::kS16}, -1.6))[0], 0xFFFE);
  EXPECT_EQ((*encode({NumberType::kU16}, 2.4))[0], 2);
  EXPECT_EQ((*encode({NumberType::kS16}, -32768.4))[0], 0x8000);
}

TEST(RegisterCodec, TellsNanAsNan) {
  const std::vector<std::uint16_t> nan{0x7FC0, 0x0000};
  EXPECT_TRUE(std::isnan(decode({NumberType::kF32}, nan)));
  const std::vector<std::uint16_t> infinite{0xFF80, 0x0000};
  EXPECT_TRUE(std::isinf(decode({NumberType::kF32}, infinite)));
  const std::vector<std::uint16_t> half{0x7FC0};
  EXPECT_TRUE(std::isnan(decode({NumberType::kF32}, half)));  // too few words
}

TEST(Units, AreWhatTheGearMakesOfThem) {
  const Gear gear{1000.0, 30.0, false, 0.0};  // 30 000 steps a turn of the table
  EXPECT_NEAR(to_table(7500.0, Unit::kStep, gear), 90.0, 1e-12);
  EXPECT_NEAR(to_table(7.5, Unit::kMotorTurn, gear), 90.0, 1e-12);
  EXPECT_NEAR(to_table(0.25, Unit::kTurn, gear), 90.0, 1e-12);
  EXPECT_NEAR(to_table(1.5707963267948966, Unit::kRad, gear), 90.0, 1e-12);
  EXPECT_NEAR(to_table(600.0, Unit::kMotorRpm, gear), 120.0, 1e-12);  // 10 turns of the motor a second
  EXPECT_NEAR(to_table(10000.0, Unit::kStepPerS, gear), 120.0, 1e-12);
  EXPECT_NEAR(to_table(600.0, Unit::kMotorRpmPerS, gear), 120.0, 1e-12);
  // 1000 rpm in 100 ms are 10 000 rpm a second.
  EXPECT_NEAR(to_table(100.0, Unit::kMsTo1000Rpm, gear), 2000.0, 1e-9);
  EXPECT_NEAR(to_drive(2000.0, Unit::kMsTo1000Rpm, gear), 100.0, 1e-9);
}

TEST(Units, GoBackAndForth) {
  for (const bool reversed : {false, true}) {
    const Gear gear{10000.0, 7.5, reversed, 12.5};
    for (const Unit unit : {Unit::kDeg, Unit::kRad, Unit::kTurn, Unit::kMotorTurn, Unit::kStep}) {
      EXPECT_NEAR(to_table(to_drive(-37.0, unit, gear), unit, gear), -37.0, 1e-9);
    }
    for (const Unit unit : {Unit::kDegPerS2, Unit::kMotorRpmPerS, Unit::kStepPerS2, Unit::kMsTo1000Rpm}) {
      EXPECT_NEAR(to_table(to_drive(180.0, unit, gear), unit, gear), 180.0, 1e-9);
    }
  }
}

TEST(Units, AReversedDriveCountsTheOtherWayRoundFromItsZero) {
  const Gear gear{10000.0, 1.0, true, 30.0};
  EXPECT_NEAR(to_table(0.0, Unit::kDeg, gear), 30.0, 1e-12);
  EXPECT_NEAR(to_table(10.0, Unit::kDeg, gear), 20.0, 1e-12);
  EXPECT_NEAR(to_table(10.0, Unit::kDegPerS, gear), -10.0, 1e-12);
  EXPECT_NEAR(to_drive(10.0, Unit::kDegPerS, gear), 10.0, 1e-12);  // a limit has no sense
}

}  // namespace
}  // namespace hapticd::modbus
