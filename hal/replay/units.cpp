#include "hal/replay/units.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <span>

#include "hal/shown_text.h"

namespace hapticd::replay {
namespace {

struct Unit {
  std::string_view name;
  double factor;  ///< to s, N, mm or N·mm
  bool is_listed = true;
};

constexpr bool kUnlisted = false;
constexpr double kNewtonPerKgf = 9.80665;
constexpr double kNewtonPerLbf = 4.4482216152605;
constexpr double kMmPerInch = 25.4;

constexpr Unit kTimeUnits[] = {
    {"s", 1.0},
    {"ms", 1e-3},
    {"us", 1e-6},
    {"ns", 1e-9},
    {"min", 60.0},
    {"h", 3600.0},
    {"sec", 1.0, kUnlisted},
    {"secs", 1.0, kUnlisted},
    {"second", 1.0, kUnlisted},
    {"seconds", 1.0, kUnlisted},
    {"sek", 1.0, kUnlisted},
    {"msec", 1e-3, kUnlisted},
    {"millisecond", 1e-3, kUnlisted},
    {"milliseconds", 1e-3, kUnlisted},
    {"usec", 1e-6, kUnlisted},
    {"nsec", 1e-9, kUnlisted},
    {"minute", 60.0, kUnlisted},
    {"minutes", 60.0, kUnlisted},
};
// "n" is newton in this project's own field names. A load cell that shows kg or g means their weight.
constexpr Unit kForceUnits[] = {
    {"N", 1.0},
    {"mN", 1e-3},
    {"uN", 1e-6},
    {"nN", 1e-9},
    {"cN", 1e-2},
    {"daN", 10.0},
    {"kN", 1e3},
    {"MN", 1e6},
    {"kgf", kNewtonPerKgf},
    {"gf", 1e-3 * kNewtonPerKgf},
    {"lbf", kNewtonPerLbf},
    {"ozf", kNewtonPerLbf / 16.0},
    {"n", 1.0, kUnlisted},
    {"newton", 1.0, kUnlisted},
    {"newtons", 1.0, kUnlisted},
    {"kg", kNewtonPerKgf, kUnlisted},
    {"kp", kNewtonPerKgf, kUnlisted},
    {"g", 1e-3 * kNewtonPerKgf, kUnlisted},
    {"grams", 1e-3 * kNewtonPerKgf, kUnlisted},
    {"lb", kNewtonPerLbf, kUnlisted},
    {"lbs", kNewtonPerLbf, kUnlisted},
    {"oz", kNewtonPerLbf / 16.0, kUnlisted},
};
constexpr Unit kPositionUnits[] = {
    {"mm", 1.0},
    {"um", 1e-3},
    {"nm", 1e-6},
    {"cm", 10.0},
    {"m", 1e3},
    {"in", kMmPerInch},
    {"mil", 1e-3 * kMmPerInch},
    {"ft", 12.0 * kMmPerInch},
    {"inch", kMmPerInch, kUnlisted},
    {"inches", kMmPerInch, kUnlisted},
    {"thou", 1e-3 * kMmPerInch, kUnlisted},
    {"millimeter", 1.0, kUnlisted},
    {"millimeters", 1.0, kUnlisted},
    {"millimetre", 1.0, kUnlisted},
    {"millimetres", 1.0, kUnlisted},
    {"micron", 1e-3, kUnlisted},
    {"microns", 1e-3, kUnlisted},
};
constexpr Unit kTorqueUnits[] = {
    {"Nmm", 1.0},
    {"Nm", 1e3},
    {"Ncm", 10.0},
    {"mNm", 1.0},
    {"kNm", 1e6},
    {"lbfin", kNewtonPerLbf* kMmPerInch},
    {"lbin", kNewtonPerLbf* kMmPerInch, kUnlisted},
    {"inlbf", kNewtonPerLbf* kMmPerInch, kUnlisted},
    {"inlb", kNewtonPerLbf* kMmPerInch, kUnlisted},
};
constexpr Unit kPureUnits[] = {{"", 1.0, kUnlisted}, {"1", 1.0}};

std::span<const Unit> units_of(Quantity quantity) {
  switch (quantity) {
    case Quantity::kTime:
      return kTimeUnits;
    case Quantity::kForce:
      return kForceUnits;
    case Quantity::kTorque:
      return kTorqueUnits;
    case Quantity::kPure:
      return kPureUnits;
    case Quantity::kPosition:
      break;
  }
  return kPositionUnits;
}

std::string lower(std::string_view text) {
  std::string small(text);
  for (char& c : small) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return small;
}

void replace_all(std::string& text, std::string_view old, std::string_view with) {
  for (std::size_t at = text.find(old); at != std::string::npos; at = text.find(old, at + with.size()))
    text.replace(at, old.size(), with);
}

/// Unit with u for each micro sign, and a torque's factors next to each other.
std::string plain_unit(std::string_view unit, Quantity quantity) {
  std::string text(hal::trimmed(unit));
  replace_all(text, "\u00b5", "u");
  replace_all(text, "\u03bc", "u");
  replace_all(text, "\xB5", "u");                            // of Latin-1
  if (!text.empty() && text.back() == '.') text.pop_back();  // "sec."
  if (text == "\"" || text == "''" || text == "\u2033") text = "in";
  if (quantity != Quantity::kTorque) return text;
  for (const std::string_view times : {"\u00b7", "\u22c5", "*", "-", " ", "_", "."})
    replace_all(text, times, "");
  return text;
}

/// Returns the position of the bracket that begins a unit at the end of a name.
std::size_t opening_bracket(std::string_view name) {
  constexpr std::string_view kClosing = ")]}>";
  constexpr std::string_view kOpening = "([{<";
  const std::size_t kind = name.empty() ? std::string_view::npos : kClosing.find(name.back());
  return kind == std::string_view::npos ? kind : name.rfind(kOpening[kind]);
}

std::string_view without_link(std::string_view stem) {
  stem = hal::trimmed(stem);
  while (!stem.empty() && std::string_view("_/,:-").find(stem.back()) != std::string_view::npos)
    stem = hal::trimmed(stem.substr(0, stem.size() - 1));
  return stem.ends_with(" in") ? hal::trimmed(stem.substr(0, stem.size() - 3)) : stem;
}

}  // namespace

const char* name_of(Quantity quantity) noexcept {
  switch (quantity) {
    case Quantity::kTime:
      return "time";
    case Quantity::kForce:
      return "force";
    case Quantity::kTorque:
      return "torque";
    case Quantity::kPure:
      return "number";
    case Quantity::kPosition:
      break;
  }
  return "position";
}

std::string accepted_units(Quantity quantity) {
  std::string text;
  for (const Unit& unit : units_of(quantity)) {
    if (unit.is_listed) text.append(text.empty() ? "" : ", ").append(unit.name);
  }
  return text;
}

std::optional<double> unit_factor(Quantity quantity, std::string_view unit) {
  const std::string text = plain_unit(unit, quantity);
  const auto units = units_of(quantity);
  for (const Unit& known : units) {
    if (known.name == text) return known.factor;
  }
  const std::string small = lower(text);
  std::optional<double> factor;
  for (const Unit& known : units) {
    if (lower(known.name) != small) continue;
    if (factor && *factor != known.factor) return std::nullopt;
    factor = known.factor;
  }
  return factor;
}

bool is_unit(std::string_view word) {
  if (hal::trimmed(word).empty()) return false;
  return std::ranges::any_of(
      std::array{Quantity::kTime, Quantity::kForce, Quantity::kPosition, Quantity::kTorque},
      [word](Quantity quantity) { return unit_factor(quantity, word).has_value(); });
}

ColumnName take_apart(std::string_view name) {
  name = hal::trimmed(name);
  if (const std::size_t open = opening_bracket(name); open != std::string_view::npos) {
    return {std::string(without_link(name.substr(0, open))),
            std::string(hal::trimmed(name.substr(open + 1, name.size() - open - 2)))};
  }
  for (const char link : {'/', ',', ':', '_', ' '}) {
    const std::size_t at = name.rfind(link);
    if (at == std::string_view::npos || !is_unit(name.substr(at + 1))) continue;
    return {std::string(without_link(name.substr(0, at))), std::string(hal::trimmed(name.substr(at + 1)))};
  }
  const std::size_t underscore = name.rfind('_');
  if (underscore == std::string_view::npos) return {std::string(name), {}};
  return {std::string(name.substr(0, underscore)), std::string(name.substr(underscore + 1))};
}

std::string plain_name(std::string_view name) {
  std::string plain;
  for (const char c : hal::trimmed(name)) {
    const bool is_blank = c == '_' || c == '-' || c == ' ' || c == '\t';
    if (is_blank && (plain.empty() || plain.back() == ' ')) continue;
    plain += is_blank ? ' ' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return plain;
}

}  // namespace hapticd::replay
