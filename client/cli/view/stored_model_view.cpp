#include "client/cli/view/stored_model_view.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <ctime>

#include "client/cli/text/text_table.h"
#include "client/cli/text/uncertain_number.h"

namespace hapticd::cli {
namespace {

using Align = TextTable::Align;

constexpr double kNoticeableDeviations = 3.0;

std::string time_text(std::int64_t unix_s) {
  const std::time_t time = unix_s;
  std::tm local{};
  if (localtime_r(&time, &local) == nullptr) return "?";
  return fmt::format("{:04}-{:02}-{:02} {:02}:{:02}", local.tm_year + 1900, local.tm_mon + 1, local.tm_mday,
                     local.tm_hour, local.tm_min);
}

std::string tags_text(const v1::StoredModel& model) {
  return model.tags().empty() ? "-" : fmt::format("{}", fmt::join(model.tags(), ", "));
}

std::string rig_text(const v1::StoredModel& model) {
  const std::string kind = model.rig_kind().empty() ? std::string() : fmt::format(" ({})", model.rig_kind());
  return fmt::format("{} / {}{}", model.device().empty() ? "?" : model.device(),
                     model.sensor().empty() ? "?" : model.sensor(), kind);
}

/// "down to 6.1 mm, up to 5.8 N, 80 mm/s"; what does not apply is left out.
std::string validity_text(const v1::StoredModel& model) {
  std::vector<std::string> parts;
  const auto add = [&parts](double value, const char* text, const char* unit) {
    if (value > 0.0) parts.push_back(fmt::format("{} {:.6g} {}", text, value, unit));
  };
  add(model.max_displacement_mm(), "down to", "mm");
  add(model.max_force_n(), "up to", "N");
  add(model.max_speed_mm_per_s(), "up to", "mm/s");
  return parts.empty() ? "-" : fmt::format("{}", fmt::join(parts, ", "));
}

std::string state_text(const v1::StoredModel& model, const Terminal& terminal) {
  return model.converged() ? terminal.paint(Color::kGreen, "yes") : terminal.paint(Color::kYellow, "no");
}

std::string unit_text(const std::string& unit) {
  return unit == "1" ? "" : unit;
}

std::string value_text(bool there, double value) {
  return there ? fmt::format("{:.6g}", value) : "-";
}

}  // namespace

std::string short_hash(const std::string& hash) {
  constexpr std::size_t kShown = 12;
  return hash.substr(0, kShown);
}

bool looks_like_hash(std::string_view word) {
  constexpr std::string_view kDigits = "0123456789abcdefABCDEF";
  return word.size() >= 6 && word.size() <= 64 && word.find_first_not_of(kDigits) == std::string_view::npos;
}

std::vector<std::string> stored_model_list(const v1::ListStoredModelsResponse& models,
                                           const Terminal& terminal) {
  if (models.models().empty()) return {"no model is stored"};
  TextTable table(
      {"", "hash", "kind", "object", "tags", "residual", "converged", "stored", "device / sensor"},
      {Align::kLeft, Align::kLeft, Align::kLeft, Align::kLeft, Align::kLeft, Align::kRight});
  for (const v1::StoredModel& model : models.models()) {
    table.add({model.in_use() ? terminal.paint(Color::kGreen, "*") : " ", short_hash(model.hash()),
               model.kind(), model.object().empty() ? "-" : model.object(), tags_text(model),
               fmt::format("{:.2g} %", 100.0 * model.residual()), state_text(model, terminal),
               time_text(model.stored_at_unix_s()), rig_text(model)});
  }
  return table.lines(terminal);
}

std::vector<std::string> stored_model_text(const v1::StoredModel& model, const Terminal& terminal) {
  TextTable facts;
  facts.add({"hash", model.hash()});
  facts.add({"kind", model.kind()});
  if (!model.object().empty()) facts.add({"object", model.object()});
  facts.add({"device / sensor", rig_text(model)});
  facts.add({"procedure", model.procedure()});
  facts.add({"data", model.data_reference()});
  facts.add({"valid", validity_text(model)});
  facts.add({"residual", fmt::format("{:.6g} % of rms", 100.0 * model.residual())});
  facts.add({"converged", state_text(model, terminal)});
  facts.add({"stored", time_text(model.stored_at_unix_s())});
  facts.add({"tags", tags_text(model)});
  facts.add({"in use", model.in_use() ? terminal.paint(Color::kGreen, "by the loaded scene") : "no"});
  std::vector<std::string> lines = facts.lines(terminal);
  if (model.parameters().empty()) return lines;
  lines.emplace_back();
  TextTable parameters({"parameter", "value", terminal.unicode ? "±" : "+-", "unit"},
                       {Align::kLeft, Align::kRight, Align::kRight});
  for (const v1::EstimatedParameter& parameter : model.parameters()) {
    const UncertainText text =
        parameter_parts(parameter.name(), parameter.value(), parameter.standard_error(), terminal.unicode);
    // With an error, as many digits as it takes to compare the value with that of a file.
    parameters.add({parameter.name(), text.error.empty() ? text.value : value_text(true, parameter.value()),
                    text.error, unit_text(parameter.unit())});
  }
  for (std::string& line : parameters.lines(terminal)) lines.push_back(std::move(line));
  return lines;
}

std::vector<std::string> model_difference_text(const v1::DiffStoredModelsResponse& difference,
                                               const Terminal& terminal) {
  TextTable table({"parameter", short_hash(difference.a().hash()), short_hash(difference.b().hash()), "unit",
                   "change", "deviations"},
                  {Align::kLeft, Align::kRight, Align::kRight, Align::kLeft, Align::kRight, Align::kRight});
  for (const v1::ParameterDifference& parameter : difference.parameters()) {
    const std::string deviations =
        parameter.has_deviations() ? fmt::format("{:.1f}", parameter.deviations()) : "-";
    const bool noticeable = parameter.has_deviations() && parameter.deviations() > kNoticeableDeviations;
    table.add({parameter.name(), value_text(parameter.has_value_a(), parameter.value_a()),
               value_text(parameter.has_value_b(), parameter.value_b()), unit_text(parameter.unit()),
               parameter.has_relative() ? fmt::format("{:+.2f} %", 100.0 * parameter.relative()) : "-",
               noticeable ? terminal.paint(Color::kYellow, deviations) : deviations});
  }
  std::vector<std::string> lines = table.lines(terminal);
  for (const std::string& remark : difference.remarks()) lines.push_back(remark);
  return lines;
}

}  // namespace hapticd::cli
