#include "server/model/model_file.h"

#include <fmt/format.h>

#include <initializer_list>
#include <optional>
#include <utility>

#include "server/text/text_library.h"
#include "server/text/toml_reader.h"
#include "server/text/toml_text.h"

namespace hapticd::server {

namespace {

constexpr Range kLengthMm{0.0, 1e3, "mm"};
constexpr Range kForceN{0.0, 1e3, "N"};
constexpr Range kStiffness{1e-4, 1e3, "N/mm^m"};
constexpr Range kDamping{0.0, 1e2, "N·s/mm^(m+1)"};
constexpr Range kExponent{1.0, 3.0, ""};
constexpr Range kRelativeError{1e-3, 1.0, ""};
constexpr Range kTimeS{1e-4, 1e3, "s"};
constexpr Range kWeight{0.0, 1e3, ""};
constexpr Range kCurveForceN{1e-3, 1e3, "N"};
constexpr Range kKinetic{0.0, 5.0, ""};
constexpr Range kPreslidingMm{1e-3, 20.0, "mm"};
constexpr Range kViscous{0.0, 1.0, "N·s/mm"};
constexpr Range kDahlExponent{0.0, 3.0, ""};
constexpr Range kPreslidingError{0.0, 10.0, ""};
constexpr Range kReachMm{0.0, 1e3, "mm"};
constexpr Range kSlipStiffness{0.0, 1e4, "1/mm"};

/// Reads one section and collects the keys that are missing.
class Section {
 public:
  /// `name`: dotted; names the section in errors.
  Section(TomlTable table, std::string name) : table_(std::move(table)), name_(std::move(name)) {}

  template <class Value>
  Section& read(const char* key, Value& value, const Range& range) {
    table_.read(key, value, range);
    if (!table_.has(key) && missing_.empty()) missing_ = key;
    return *this;
  }
  /// A key that may be left out; the value keeps its default then.
  template <class Value>
  Section& read_optional(const char* key, Value& value, const Range& range) {
    table_.read(key, value, range);
    return *this;
  }
  std::optional<hal::Error> error(const std::string& source) const {
    if (missing_.empty()) return std::nullopt;
    return hal::Error::of(hal::ErrorCode::kMissingKey, fmt::format("'{}.{}' is missing", name_, missing_),
                          source, "", "", fmt::format("say it, or leave out all of [{}]", name_));
  }

 private:
  TomlTable table_;
  std::string name_;
  std::string missing_;
};

void read_hunt_crossley(Section section, rt::ObjectModel& model, std::vector<Section>& sections) {
  auto& law = model.hunt_crossley.emplace();
  section.read("stiffness_n_per_mm_m", law.parameters.stiffness_n_per_mm_m, kStiffness)
      .read("damping_n_s_per_mm_m1", law.parameters.damping_n_s_per_mm_m1, kDamping)
      .read("exponent", law.parameters.exponent, kExponent)
      .read("relative_error", law.relative_error, kRelativeError);
  sections.push_back(std::move(section));
}

void read_creep(Section section, rt::ObjectModel& model, std::vector<Section>& sections) {
  auto& law = model.creep.emplace();
  section.read("time_s", law.parameters.time_s, kTimeS)
      .read("weight", law.parameters.weight, kWeight)
      .read("max_force_n", law.parameters.max_force_n, kCurveForceN)
      .read("displacement_mm", law.parameters.displacement_mm, kLengthMm)
      .read("relative_error", law.relative_error, kRelativeError);
  sections.push_back(std::move(section));
}

void read_friction(TomlTable& root, const std::string& name, std::optional<rt::FrictionParameters>& read,
                   std::vector<Section>& sections) {
  TomlTable table = root.table(name);
  Section section(table, name);
  auto& friction = read.emplace();
  section.read("kinetic", friction.kinetic, kKinetic)
      .read("presliding_mm", friction.presliding_mm, kPreslidingMm)
      .read("viscous_n_s_per_mm", friction.viscous_n_s_per_mm, kViscous)
      .read_optional("exponent", friction.exponent, kDahlExponent)
      .read_optional("presliding_relative_error", friction.presliding_relative_error, kPreslidingError);
  sections.push_back(std::move(section));
  if (!table.wants("maxwell_slip")) return;
  auto& elements = friction.maxwell_slip.emplace();
  sections.push_back(Section(table.table("maxwell_slip"), name + ".maxwell_slip")
                         .read("reach_mm", elements.reach_mm, kReachMm)
                         .read("stiffness_per_mm", elements.stiffness_per_mm, kSlipStiffness));
}

template <std::size_t N>
std::string numbers(const std::array<double, N>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + toml_number(value);
  return "[" + text + "]";
}

}  // namespace

hal::Result<rt::ObjectModel> parse_model(std::string_view text, const std::string& source,
                                         const std::string& name) {
  auto document = TomlDocument::parse(text, source);
  if (!document) return document.error();

  rt::ObjectModel model;
  TomlTable root = document->root();
  root.read("name", model.name);
  root.read("identified_on", model.identified_on);
  root.read("max_displacement_mm", model.max_displacement_mm, kLengthMm);
  root.read("max_force_n", model.max_force_n, kForceN);
  std::vector<Section> sections;
  if (root.wants("hunt_crossley"))
    read_hunt_crossley({root.table("hunt_crossley"), "hunt_crossley"}, model, sections);
  if (root.wants("creep")) read_creep({root.table("creep"), "creep"}, model, sections);
  if (root.wants("rod_friction")) read_friction(root, "rod_friction", model.rod_friction, sections);
  if (root.wants("bearing_friction"))
    read_friction(root, "bearing_friction", model.bearing_friction, sections);
  if (auto error = document->error()) return *error;
  for (const Section& section : sections) {
    if (auto error = section.error(source)) return *error;
  }

  const std::string where =
      root.has("name") ? fmt::format("{}, line {}", source, root.line_of("name")) : source;
  if (model.name.empty() && !root.has("name")) {
    if (name.empty())
      return hal::Error::of(hal::ErrorCode::kMissingKey, "the model has no name", where, "", "",
                            "add name = \"…\" at its top");
    model.name = name;
  }
  if (auto error = check_name("model", model.name, where)) return *error;
  if (!name.empty() && model.name != name) {
    return hal::Error::of(hal::ErrorCode::kContradiction, "the model's name is not that of its file", where,
                          model.name, name, "rename the one or the other");
  }
  if (auto error = rt::check(model)) {
    error->where = source;
    return *error;
  }
  return model;
}

std::string write_model(const rt::ObjectModel& model) {
  std::string text =
      fmt::format("name = {}\nidentified_on = {}\nmax_displacement_mm = {}\nmax_force_n = {}\n",
                  toml_quoted(model.name), toml_quoted(model.identified_on),
                  toml_number(model.max_displacement_mm), toml_number(model.max_force_n));
  if (const auto& law = model.hunt_crossley) {
    text += fmt::format(
        "\n[hunt_crossley]\nstiffness_n_per_mm_m = {}\ndamping_n_s_per_mm_m1 = {}\nexponent = {}\n"
        "relative_error = {}\n",
        toml_number(law->parameters.stiffness_n_per_mm_m), toml_number(law->parameters.damping_n_s_per_mm_m1),
        toml_number(law->parameters.exponent), toml_number(law->relative_error));
  }
  if (const auto& law = model.creep) {
    text += fmt::format(
        "\n[creep]\ntime_s = {}\nweight = {}\nmax_force_n = {}\ndisplacement_mm = {}\nrelative_error = {}\n",
        numbers(law->parameters.time_s), numbers(law->parameters.weight),
        toml_number(law->parameters.max_force_n), numbers(law->parameters.displacement_mm),
        toml_number(law->relative_error));
  }
  for (const auto& [section, friction] :
       {std::pair{"rod_friction", model.rod_friction}, {"bearing_friction", model.bearing_friction}}) {
    if (!friction) continue;
    text += fmt::format("\n[{}]\nkinetic = {}\npresliding_mm = {}\nviscous_n_s_per_mm = {}\n", section,
                        toml_number(friction->kinetic), toml_number(friction->presliding_mm),
                        toml_number(friction->viscous_n_s_per_mm));
    if (friction->exponent != 1.0) text += fmt::format("exponent = {}\n", toml_number(friction->exponent));
    if (friction->presliding_relative_error > 0.0) {
      text +=
          fmt::format("presliding_relative_error = {}\n", toml_number(friction->presliding_relative_error));
    }
    if (const auto& elements = friction->maxwell_slip) {
      text += fmt::format("maxwell_slip = {{ reach_mm = {}, stiffness_per_mm = {} }}\n",
                          numbers(elements->reach_mm), numbers(elements->stiffness_per_mm));
    }
  }
  return text;
}

}  // namespace hapticd::server
