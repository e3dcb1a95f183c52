#include "client/cli/demo/demo_press.h"

#include <fmt/core.h>

#include <nlohmann/json.hpp>

namespace hapticd::cli {

std::optional<double> DemoPress::error() const {
  if (!target_n_per_mm || !hold) return std::nullopt;
  return (hold->stiffness_n_per_mm() - *target_n_per_mm) / *target_n_per_mm;
}

std::string DemoPress::name() const {
  return target_n_per_mm ? fmt::format("target {:g} N/mm", *target_n_per_mm) : "object as it is";
}

TextTable result_table(const std::vector<DemoPress>& presses) {
  using enum TextTable::Align;
  TextTable table({"", "target", "rendered", "error", "hand force", "displacement"},
                  {kLeft, kRight, kRight, kRight, kRight, kRight});
  std::optional<double> as_it_is;
  for (const auto& press : presses) {
    if (!press.hold) continue;
    const double rendered = press.hold->stiffness_n_per_mm();
    if (!press.target_n_per_mm) as_it_is = rendered;
    std::string kind = "object as it is";
    if (press.target_n_per_mm)
      kind = !as_it_is ? "" : (*press.target_n_per_mm < *as_it_is ? "softer" : "harder");
    table.add({kind, press.target_n_per_mm ? fmt::format("{:.3f} N/mm", *press.target_n_per_mm) : "-",
               fmt::format("{:.4f} N/mm", rendered),
               press.error() ? fmt::format("{:+.2f} %", 100.0 * *press.error()) : "-",
               fmt::format("{:.3f} N", press.hold->hand_force_n),
               fmt::format("{:.3f} mm", press.hold->displacement_mm)});
  }
  return table;
}

Json result_json(const std::vector<DemoPress>& presses) {
  Json list = Json::array();
  for (const auto& press : presses) {
    if (!press.hold) continue;
    Json entry = Json::object();
    entry["target_n_per_mm"] = press.target_n_per_mm ? Json(*press.target_n_per_mm) : Json(nullptr);
    entry["granted_n_per_mm"] = press.target_n_per_mm ? Json(press.granted_n_per_mm) : Json(nullptr);
    entry["rendered_n_per_mm"] = press.hold->stiffness_n_per_mm();
    entry["error"] = press.error() ? Json(*press.error()) : Json(nullptr);
    entry["hand_force_n"] = press.hold->hand_force_n;
    entry["displacement_mm"] = press.hold->displacement_mm;
    entry["averaged_s"] = press.hold->duration_s;
    const auto release = release_point(press.trace.points());
    entry["came_free_at_mm"] = release ? Json(release->displacement_mm) : Json(nullptr);
    entry["hand_force_then_n"] = release ? Json(release->hand_force_n) : Json(nullptr);
    list.push_back(std::move(entry));
  }
  return list;
}

}  // namespace hapticd::cli
