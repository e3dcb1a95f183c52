#include <cmath>
#include <cstdio>

#include "hal/turntable/turntable_state.h"

namespace hapticd::turntable {

std::string number(double value, const char* unit) {
  char text[64];
  std::snprintf(text, sizeof text, "%.6g %s", value, unit);
  return text;
}

std::string range_text(const TurntableSettings& settings) {
  return number(settings.min_deg, "…") + " " + number(settings.max_deg, "deg");
}

std::optional<hal::Error> check(const TurntableSettings& settings) {
  if (!(settings.min_deg < settings.max_deg)) {
    return hal::Error::of(hal::ErrorCode::kContradiction, "the turntable has no range",
                          "[rig.turntable] min_deg, max_deg", range_text(settings), "min_deg < max_deg",
                          "correct them");
  }
  if (!(settings.stale_after_s * settings.poll_hz >= 2.0)) {
    return hal::Error::of(hal::ErrorCode::kContradiction, "the position would be stale between two polls",
                          "[rig.turntable] stale_after_s", number(settings.stale_after_s, "s"),
                          "at least " + number(2.0 / settings.poll_hz, "s") + " at this poll_hz",
                          "poll faster or allow an older position");
  }
  for (std::size_t i = 0; i < settings.stations.size(); ++i) {
    const hal::TurntableStation& station = settings.stations[i];
    const std::string where = "[rig.turntable.stations." + station.name + "] angle_deg";
    if (!(station.angle_deg >= settings.min_deg && station.angle_deg <= settings.max_deg)) {
      return hal::Error::of(hal::ErrorCode::kOutOfRange, "the station lies beyond the table's range", where,
                            number(station.angle_deg, "deg"), range_text(settings),
                            "correct the angle or the range");
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (std::abs(settings.stations[j].angle_deg - station.angle_deg) <=
          2.0 * settings.supervision.tolerance_deg) {
        return hal::Error::of(hal::ErrorCode::kContradiction, "two stations cannot be distinguished", where,
                              number(station.angle_deg, "deg"),
                              "further from '" + settings.stations[j].name + "' than twice tolerance_deg",
                              "move one of them");
      }
    }
  }
  return std::nullopt;
}

}  // namespace hapticd::turntable
