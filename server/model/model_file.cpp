#include "server/model/model_file.h"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "server/model/law_description.h"
#include "server/text/text_library.h"
#include "server/text/toml_writer.h"

namespace hapticd::server {

namespace {

using model_archive::describe;

constexpr Range kLengthMm{0.0, 1e3, "mm"};
constexpr Range kForceN{0.0, 1e3, "N"};
constexpr Range kRelativeError{1e-3, 1.0, ""};
constexpr Range kDahlExponent{0.0, 3.0, ""};
constexpr Range kPreslidingError{0.0, 10.0, ""};

/// Reads one section and collects the keys that are missing.
class Section {
 public:
  /// `name`: dotted; names the section in errors.
  Section(TomlTable table, std::string name) : table_(std::move(table)), name_(std::move(name)) {}

  template <class Value>
  void field(const char* key, Value& value, const Range& range) {
    table_.read(key, value, range);
    if (!table_.has(key) && missing_.empty()) missing_ = key;
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

template <class Law>
void read_law(TomlTable& root, const char* name, std::optional<Law>& law, std::vector<Section>& sections) {
  if (!root.wants(name)) return;
  Section& section = sections.emplace_back(root.table(name), name);
  describe(section, law.emplace().parameters);
  section.field("relative_error", law->relative_error, kRelativeError);
}

/// Keys that may be left out, and then keep their defaults: Dahl's law, well known.
template <class Table>
void optional_friction_fields(Table& table, auto& friction) {
  if (Table::kReads || friction.exponent != 1.0) table.field("exponent", friction.exponent, kDahlExponent);
  if (Table::kReads || friction.presliding_relative_error > 0.0) {
    table.field("presliding_relative_error", friction.presliding_relative_error, kPreslidingError);
  }
}

void read_friction(TomlTable& root, const char* name, std::optional<rt::FrictionParameters>& read,
                   std::vector<Section>& sections) {
  if (!root.wants(name)) return;
  TomlTable table = root.table(name);
  auto& friction = read.emplace();
  describe(sections.emplace_back(table, name), friction);
  optional_friction_fields(table, friction);
  if (!table.wants("maxwell_slip")) return;
  describe(sections.emplace_back(table.table("maxwell_slip"), name + std::string(".maxwell_slip")),
           friction.maxwell_slip.emplace());
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
  read_law(root, "hunt_crossley", model.hunt_crossley, sections);
  read_law(root, "creep", model.creep, sections);
  read_friction(root, "rod_friction", model.rod_friction, sections);
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

std::string write_model(const rt::ObjectModel& written) {
  rt::ObjectModel model = written;  // a description is made for reading, too
  return toml_fields([&](TomlWriter& root) {
    root.field("name", model.name);
    root.field("identified_on", model.identified_on);
    root.field("max_displacement_mm", model.max_displacement_mm);
    root.field("max_force_n", model.max_force_n);
    const auto law_fields = [](TomlWriter& table, auto& law) {
      describe(table, law.parameters);
      table.field("relative_error", law.relative_error);
    };
    root.table("hunt_crossley", model.hunt_crossley, law_fields);
    root.table("creep", model.creep, law_fields);
    const auto friction_fields = [](TomlWriter& table, auto& friction) {
      describe(table, friction);
      optional_friction_fields(table, friction);
      table.inline_table("maxwell_slip", friction.maxwell_slip,
                         [](TomlWriter& inner, auto& elements) { describe(inner, elements); });
    };
    root.table("rod_friction", model.rod_friction, friction_fields);
    root.table("bearing_friction", model.bearing_friction, friction_fields);
  });
}

}  // namespace hapticd::server
