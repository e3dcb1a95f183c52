#include "hal/modbus/register_codec.h"

#include <bit>
#include <cmath>
#include <limits>

namespace hapticd::modbus {

namespace {

constexpr std::uint16_t swapped(std::uint16_t word) noexcept {
  return static_cast<std::uint16_t>((word >> 8U) | (word << 8U));
}

constexpr std::uint16_t ordered(std::uint16_t word, Order byte_order) noexcept {
  return byte_order == Order::kBigFirst ? word : swapped(word);
}

template <class T>
std::optional<std::uint32_t> whole(double value) noexcept {
  const double rounded = std::round(value);
  if (!(rounded >= static_cast<double>(std::numeric_limits<T>::min()) &&
        rounded <= static_cast<double>(std::numeric_limits<T>::max()))) {
    return std::nullopt;
  }
  return static_cast<std::uint32_t>(static_cast<T>(rounded));
}

}  // namespace

std::uint32_t decode_bits(const NumberFormat& format, std::span<const std::uint16_t> words) noexcept {
  if (words.size() < words_of(format.type)) return 0;
  const std::uint32_t first = ordered(words[0], format.byte_order);
  if (words_of(format.type) == 1) return first;
  const std::uint32_t second = ordered(words[1], format.byte_order);
  return format.word_order == Order::kBigFirst ? (first << 16U) | second : (second << 16U) | first;
}

double decode(const NumberFormat& format, std::span<const std::uint16_t> words) noexcept {
  if (words.size() < words_of(format.type)) return std::numeric_limits<double>::quiet_NaN();
  const std::uint32_t bits = decode_bits(format, words);
  switch (format.type) {
    case NumberType::kBit:
      return bits != 0 ? 1.0 : 0.0;
    case NumberType::kU16:
    case NumberType::kU32:
      return static_cast<double>(bits);
    case NumberType::kS16:
      return static_cast<double>(static_cast<std::int16_t>(static_cast<std::uint16_t>(bits)));
    case NumberType::kS32:
      return static_cast<double>(static_cast<std::int32_t>(bits));
    case NumberType::kF32:
      return static_cast<double>(std::bit_cast<float>(bits));
  }
  return std::numeric_limits<double>::quiet_NaN();
}

Words encode_bits(const NumberFormat& format, std::uint32_t bits) noexcept {
  const auto low = static_cast<std::uint16_t>(bits & 0xFFFFU);
  const auto high = static_cast<std::uint16_t>(bits >> 16U);
  if (words_of(format.type) == 1) return {ordered(low, format.byte_order), 0};
  const bool big = format.word_order == Order::kBigFirst;
  return {ordered(big ? high : low, format.byte_order), ordered(big ? low : high, format.byte_order)};
}

std::optional<Words> encode(const NumberFormat& format, double value) noexcept {
  if (!std::isfinite(value)) return std::nullopt;
  std::optional<std::uint32_t> bits;
  switch (format.type) {
    case NumberType::kBit:
      if (value == 0.0 || value == 1.0) bits = value == 0.0 ? 0U : 1U;
      break;
    case NumberType::kU16:
      bits = whole<std::uint16_t>(value);
      break;
    case NumberType::kS16:
      bits = whole<std::int16_t>(value);
      if (bits) bits = *bits & 0xFFFFU;
      break;
    case NumberType::kU32:
      bits = whole<std::uint32_t>(value);
      break;
    case NumberType::kS32:
      bits = whole<std::int32_t>(value);
      break;
    case NumberType::kF32:
      if (std::abs(value) <= static_cast<double>(std::numeric_limits<float>::max())) {
        bits = std::bit_cast<std::uint32_t>(static_cast<float>(value));
      }
      break;
  }
  if (!bits) return std::nullopt;
  return encode_bits(format, *bits);
}

}  // namespace hapticd::modbus
