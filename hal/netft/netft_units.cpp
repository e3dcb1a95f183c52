#include "hal/netft/netft_units.h"

#include <array>
#include <cctype>
#include <span>
#include <string>

namespace hapticd::netft {

namespace {

constexpr double kNewtonsPerPound = 4.4482216152605;  // exact by definition
constexpr double kNewtonsPerKilogram = 9.80665;       // exact by definition

struct Unit {
  std::string_view name;   ///< lower case, without separators
  std::string_view shown;  ///< as the box writes it
  double factor;
};

constexpr std::array<Unit, 6> kForceUnits{{
    {"n", "N", 1.0},
    {"kn", "kN", 1e3},
    {"lbf", "lbf", kNewtonsPerPound},
    {"klbf", "klbf", 1e3 * kNewtonsPerPound},
    {"kgf", "kgf", kNewtonsPerKilogram},
    {"gf", "gf", 1e-3 * kNewtonsPerKilogram},
}};

constexpr std::array<Unit, 8> kTorqueUnits{{
    {"nm", "Nm", 1e3},
    {"nmm", "Nmm", 1.0},
    {"knm", "kNm", 1e6},
    {"lbfin", "lbf-in", 25.4 * kNewtonsPerPound},
    {"lbfft", "lbf-ft", 12.0 * 25.4 * kNewtonsPerPound},
    {"kgfcm", "kgf-cm", 10.0 * kNewtonsPerKilogram},
    {"kgcm", "kg-cm", 10.0 * kNewtonsPerKilogram},
    {"inlbf", "in-lbf", 25.4 * kNewtonsPerPound},
}};

std::string plain(std::string_view unit) {
  std::string text;
  for (std::size_t i = 0; i < unit.size(); ++i) {
    const auto c = static_cast<unsigned char>(unit[i]);
    const bool middle_dot =
        c == 0xC2 && i + 1 < unit.size() && static_cast<unsigned char>(unit[i + 1]) == 0xB7;
    if (middle_dot) {
      ++i;
    } else if (c != '-' && c != '.' && c != ' ' && c != '*') {
      text += static_cast<char>(std::tolower(c));
    }
  }
  return text;
}

hal::Result<double> find(std::span<const Unit> units, std::string_view unit, std::string_view where,
                         const char* what) {
  const std::string name = plain(unit);
  std::string known;
  for (const Unit& candidate : units) {
    if (candidate.name == name) return candidate.factor;
    known += (known.empty() ? "" : ", ") + std::string(candidate.shown);
  }
  return hal::Error{.what = what,
                    .where = std::string(where),
                    .value = "'" + std::string(unit.substr(0, 40)) + "'",
                    .limit = known,
                    .remedy = "choose one of these on the box's configuration page",
                    .code = hal::ErrorCode::kUnknownWord};
}

}  // namespace

hal::Result<double> newtons_per(std::string_view unit, std::string_view where) {
  return find(kForceUnits, unit, where, "unknown unit of force");
}

hal::Result<double> newton_millimetres_per(std::string_view unit, std::string_view where) {
  return find(kTorqueUnits, unit, where, "unknown unit of torque");
}

}  // namespace hapticd::netft
