#include "tests/measure/report/figure_writer.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace hapticd::report {
namespace {

using Json = nlohmann::ordered_json;

/// Whole numbers are written without a fraction: 400, not 400.0.
Json number(double value) {
  constexpr double kExactlyWhole = 9007199254740992.0;  // 2^53
  if (std::abs(value) < kExactlyWhole && value == std::trunc(value)) return static_cast<std::int64_t>(value);
  return value;
}

Json number_or_null(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? number(*value) : Json(nullptr);
}

Json case_of(const Figure& figure) {
  Json conditions = Json::object();
  for (const auto& [name, value] : figure.conditions) {
    if (const auto* text = std::get_if<std::string>(&value.content())) {
      conditions[name] = *text;
    } else {
      conditions[name] = number(std::get<double>(value.content()));
    }
  }
  return conditions;
}

}  // namespace

std::string to_json_line(const Figure& figure) {
  const bool has_value = figure.failed.empty() && figure.value && std::isfinite(*figure.value);
  Json record;
  record["figure"] = figure.figure;
  record["case"] = case_of(figure);
  record["value"] = has_value ? number(*figure.value) : Json(nullptr);
  record["unit"] = figure.unit;
  record["goal"] = number_or_null(figure.goal);
  record["reference"] = number_or_null(figure.reference);
  record["source"] = figure.source.empty() ? Json(nullptr) : Json(figure.source);
  if (figure.run_time_ns) record["run_time_ns"] = number_or_null(figure.run_time_ns);
  if (!has_value) {
    const bool not_finite = figure.failed.empty() && figure.value;
    record["failed"] = not_finite              ? "the value is not finite"
                       : figure.failed.empty() ? "no value was measured"
                                               : figure.failed;
  }
  // Texts may hold bytes of a child process or a file name; a broken one must not cost the record.
  return record.dump(-1, ' ', false, Json::error_handler_t::replace);
}

FigureWriter::FigureWriter(const std::filesystem::path& folder) : path_(folder / "figures.jsonl") {
  std::error_code code;
  std::filesystem::create_directories(folder, code);
  if (code) throw std::runtime_error("cannot make the folder '" + folder.string() + "': " + code.message());

  std::ifstream before(path_);
  for (std::string line; std::getline(before, line);) {
    const Json record = Json::parse(line, nullptr, false);
    // A line cut short by a crash is not a record.
    if (record.is_object() && record.contains("figure") && record["figure"].is_string()) {
      earlier_.emplace_back(record["figure"].get<std::string>(), line);
    }
  }
  rewrite_earlier();
}

void FigureWriter::rewrite_earlier() {
  stream_ = std::ofstream(path_, std::ios::trunc);
  for (const auto& [name, line] : earlier_) stream_ << line << '\n';
  stream_.flush();
  if (!stream_) throw std::runtime_error("cannot write '" + path_.string() + "'");
}

void FigureWriter::set_common(Case conditions) {
  common_ = std::move(conditions);
}

/// Whether an earlier record was made under the common conditions, or knows nothing of them.
bool FigureWriter::has_common(const std::string& line) const {
  const Json record = Json::parse(line, nullptr, false);
  const Json common = case_of({.figure = "", .conditions = common_});
  return std::all_of(common.items().begin(), common.items().end(), [&record](const auto& condition) {
    const auto& conditions = record.value("case", Json::object());
    return !conditions.contains(condition.key()) || conditions.at(condition.key()) == condition.value();
  });
}

void FigureWriter::forget_earlier(const std::string& figure) {
  if (!figures_.insert(figure + case_of({.figure = "", .conditions = common_}).dump()).second) return;
  const auto removed = std::erase_if(
      earlier_, [&](const auto& entry) { return entry.first == figure && has_common(entry.second); });
  if (removed == 0) return;
  // Earlier records come before all of this run's.
  rewrite_earlier();
  for (const std::string& line : ours_) stream_ << line << '\n';
}

void FigureWriter::add(const Figure& with_its_own) {
  Figure figure = with_its_own;
  figure.conditions.insert(figure.conditions.end(), common_.begin(), common_.end());
  add_line(figure.figure, case_of(figure).dump(-1, ' ', false, Json::error_handler_t::replace),
           to_json_line(figure));
}

void FigureWriter::add_from(const std::filesystem::path& file) {
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    const Json record = Json::parse(line, nullptr, false);
    if (record.is_object() && record.contains("figure") && record.contains("case"))
      add_line(record["figure"].get<std::string>(), record["case"].dump(), line);
  }
}

void FigureWriter::add_line(const std::string& figure, const std::string& conditions,
                            const std::string& line) {
  const std::string identity = figure + ' ' + conditions;
  if (!cases_.insert(identity).second) throw std::logic_error("this record was already written: " + identity);
  forget_earlier(figure);
  ours_.push_back(line);
  stream_ << line << '\n' << std::flush;
  if (!stream_) throw std::runtime_error("cannot write '" + path_.string() + "'");
}

}  // namespace hapticd::report
