#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace hapticd::modbus {

/// How a drive stores a number in one or two registers.
enum class NumberType : std::uint8_t { kBit, kU16, kS16, kU32, kS32, kF32 };
/// Half that comes first, of a pair of registers or of the two bytes within one.
enum class Order : std::uint8_t { kBigFirst, kLittleFirst };

struct NumberFormat {
  NumberType type = NumberType::kU16;
  Order word_order = Order::kBigFirst;  ///< of the two registers of a 32-bit number
  Order byte_order = Order::kBigFirst;  ///< within each register; the protocol's order is big
  friend bool operator==(const NumberFormat&, const NumberFormat&) = default;
};

/// Registers (or, for a bit, coils) a number takes: 1 or 2.
constexpr std::size_t words_of(NumberType type) noexcept {
  return type == NumberType::kU32 || type == NumberType::kS32 || type == NumberType::kF32 ? 2 : 1;
}

/// Number in `words`, of which there are words_of(type). A float may be NaN or infinite.
double decode(const NumberFormat& format, std::span<const std::uint16_t> words) noexcept;
/// Reads the bits as an unsigned number, for status words.
std::uint32_t decode_bits(const NumberFormat& format, std::span<const std::uint16_t> words) noexcept;

/// Words as sent on the wire; only the first words_of(type) count.
using Words = std::array<std::uint16_t, 2>;
/// Encodes a value, rounded to the nearest whole number for integer types. Nothing when the type cannot hold
/// the value.
std::optional<Words> encode(const NumberFormat& format, double value) noexcept;
Words encode_bits(const NumberFormat& format, std::uint32_t bits) noexcept;

}  // namespace hapticd::modbus
