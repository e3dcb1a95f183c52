#include "client/cli/text/uncertain_number.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace hapticd::cli {
namespace {

// As fixed-point numbers from 0.00000010 to below 10 000 000.
constexpr int kMaxDecimals = 7;
constexpr double kTooLarge = 1e7;
/// An error so much smaller than its number is that of arithmetic.
constexpr double kArithmetic = 1e-9;

/// Power of ten of the last of two significant digits: 0.00118 → -4. Rounding may add a digit: 0.0996 is
/// 0.10.
int last_digit(double error) {
  int power = static_cast<int>(std::floor(std::log10(error))) - 1;
  if (std::round(error * std::pow(10.0, -power)) >= 100.0) ++power;
  return power;
}

std::string fixed(double value, int power) {
  const double unit = std::pow(10.0, power);
  const double rounded = power > 0 ? std::round(value / unit) * unit : value;
  const std::string text = fmt::format("{:.{}f}", rounded, std::max(-power, 0));
  // Nothing is less than nothing.
  const bool is_zero = text.find_first_of("123456789") == std::string::npos;
  return is_zero && text.starts_with('-') ? text.substr(1) : text;
}

std::string joined(const UncertainText& text, bool unicode) {
  return text.error.empty() ? text.value : text.value + (unicode ? " ± " : " +- ") + text.error;
}

}  // namespace

UncertainText uncertain_parts(double value, double standard_error, bool unicode) {
  if (!std::isfinite(value)) return {"-", ""};
  if (standard_error == 0.0) return {fmt::format("{:.6g}", value), ""};
  if (std::isinf(standard_error) && standard_error > 0.0) {
    return {fmt::format("{:.3g}", value), unicode ? "∞" : "inf"};
  }
  // Not a standard error at all.
  if (!(standard_error > 0.0)) return {fmt::format("{:.4g}", value), "?"};

  const double largest = std::max(std::abs(value), standard_error);
  if (standard_error < kArithmetic * largest) {
    return {fmt::format("{:.9g}", value), fmt::format("{:.2g}", standard_error)};
  }
  const int power = last_digit(standard_error);
  if (power >= -kMaxDecimals && largest < kTooLarge) {
    return {fixed(value, power), fixed(standard_error, power)};
  }
  const int exponent = static_cast<int>(std::floor(std::log10(largest)));
  const double unit = std::pow(10.0, exponent);
  // Below the smallest normal number there is no such unit to divide by.
  if (!std::isnormal(unit)) return {fmt::format("{:.2g}", value), fmt::format("{:.2g}", standard_error)};
  const auto scaled = [&](double number) {
    return fmt::format("{}e{:+03d}", fixed(number / unit, power - exponent), exponent);
  };
  return {scaled(value), scaled(standard_error)};
}

UncertainText parameter_parts(std::string_view name, double value, double standard_error, bool unicode) {
  UncertainText text = uncertain_parts(value, standard_error, unicode);
  if (!std::isinf(standard_error)) return text;
  if (name == "ultimate_period_ms") return {"-", ""};
  const bool is_least = name == "ultimate_gain" || name == "highest_holding_gain";
  if (!is_least && name != "lowest_holding_gain") return text;
  const std::string sign = is_least ? (unicode ? "≥ " : ">= ") : (unicode ? "≤ " : "<= ");
  return {sign + text.value, ""};
}

std::string parameter_text(std::string_view name, double value, double standard_error, bool unicode) {
  return joined(parameter_parts(name, value, standard_error, unicode), unicode);
}

}  // namespace hapticd::cli
