#include "server/model/model_json.h"

#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "server/text/suggestion.h"
#include "server/text/text_library.h"

namespace hapticd::server {

namespace {

using Json = nlohmann::json;  // objects sorted by key

constexpr std::string_view kContentSchema = "hapticd.model/1";
constexpr std::string_view kExportSchema = "hapticd.stored_model/1";
constexpr std::size_t kMaxImport = 1 << 20;
constexpr int kDeepest = 16;
constexpr std::size_t kMaxText = 4096;
constexpr std::size_t kMaxParameters = 1024;
constexpr const char* kInfinity = "Infinity";

hal::Error not_a_model(const std::string& what, const std::string& where, const std::string& value = {},
                       const std::string& limit = {}) {
  return {what, where, value, limit, "export the model again where it came from"};
}

// -- canonical text

std::string number_text(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value == 0.0 ? 0.0 : value).ptr;
  return {text.data(), end};
}

/// Json::dump() is not used: its numbers depend on its version and are not always the shortest.
void write_canonical(const Json& json, std::string& text) {
  if (json.is_object()) {
    char mark = '{';
    for (const auto& [key, value] : json.items()) {
      text += std::exchange(mark, ',');
      text += Json(key).dump() + ":";
      write_canonical(value, text);
    }
    text += json.empty() ? "{}" : "}";
  } else if (json.is_array()) {
    char mark = '[';
    for (const Json& value : json) {
      text += std::exchange(mark, ',');
      write_canonical(value, text);
    }
    text += json.empty() ? "[]" : "]";
  } else if (json.is_number()) {
    text += number_text(json.get<double>());
  } else {
    text += json.dump();
  }
}

std::string canonical_text(const Json& json) {
  std::string text;
  write_canonical(json, text);
  return text;
}

/// No model is nested deeply, and what follows is recursive.
hal::Result<Json> parse(std::string_view text, const std::string& where) {
  try {
    return Json::parse(text, [](int depth, Json::parse_event_t, Json&) {
      if (depth > kDeepest) throw std::length_error("nested too deeply");
      return true;
    });
  } catch (const std::exception& error) {
    return not_a_model("not JSON", where, std::string(error.what()).substr(0, 200));
  }
}

// -- one description of every part, read and written by the two archives below. A field that is added to a
// part does not compile until it is stored, too: the bindings in describe() name all fields.

/// Fills a JSON object.
class Writer {
 public:
  static constexpr bool kReads = false;

  void operator()(const char* key, const double& value) {
    // JSON has no infinity; rt::check() lets only a standard error be infinite.
    if (std::isinf(value)) {
      json[key] = kInfinity;
    } else {
      json[key] = value;
    }
  }
  void operator()(const char* key, const bool& value) { json[key] = value; }
  void operator()(const char* key, const std::string& value) { json[key] = value; }
  template <std::size_t N>
  void operator()(const char* key, const std::array<double, N>& values) {
    json[key] = values;
  }
  template <class T>
  requires std::is_class_v<T>
  void operator()(const char* key, const T& value) {
    Writer part;
    describe(part, const_cast<T&>(value));  // a writer changes nothing
    json[key] = std::move(part.json);
  }
  template <class T>
  void operator()(const char* key, const std::optional<T>& value) {
    if (value) (*this)(key, *value);
  }
  template <class T>
  void operator()(const char* key, const std::vector<T>& values) {
    json[key] = Json::array();
    for (const T& value : values) {
      Writer part;
      describe(part, const_cast<T&>(value));
      json[key].push_back(std::move(part.json));
    }
  }

  Json json = Json::object();
};

/// Reads an object; the first key that is missing, of another type or unknown is its error.
class Reader {
 public:
  static constexpr bool kReads = true;

  Reader(const Json& json, std::string path, std::string& complaint)
      : json_(json), path_(std::move(path)), complaint_(complaint) {
    if (!json_.is_object()) complain("'" + path_ + "' is not an object");
  }

  void operator()(const char* key, double& value) {
    const Json* found = find(key);
    if (found == nullptr) return;
    if (found->is_string() && *found == kInfinity) {
      value = std::numeric_limits<double>::infinity();
    } else if (found->is_number()) {
      value = found->get<double>();
    } else {
      complain("'" + path_of(key) + "' is not a number");
    }
  }
  void operator()(const char* key, bool& value) {
    if (const Json* found = find(key)) {
      if (!found->is_boolean()) return complain("'" + path_of(key) + "' is neither true nor false");
      value = found->get<bool>();
    }
  }
  void operator()(const char* key, std::string& value) {
    if (const Json* found = find(key)) {
      if (!found->is_string()) return complain("'" + path_of(key) + "' is not a text");
      value = found->get<std::string>();
    }
  }
  template <std::size_t N>
  void operator()(const char* key, std::array<double, N>& values) {
    const Json* found = find(key);
    if (found == nullptr) return;
    const bool fits = found->is_array() && found->size() == N &&
                      std::all_of(found->begin(), found->end(), [](const Json& v) { return v.is_number(); });
    if (!fits) return complain("'" + path_of(key) + "' is not a list of " + std::to_string(N) + " numbers");
    values = found->get<std::array<double, N>>();
  }
  template <class T>
  requires std::is_class_v<T>
  void operator()(const char* key, T& value) {
    if (const Json* found = find(key)) read(*found, path_of(key), value);
  }
  template <class T>
  void operator()(const char* key, std::optional<T>& value) {
    if (json_.is_object() && json_.contains(key)) (*this)(key, value.emplace());
  }
  template <class T>
  void operator()(const char* key, std::vector<T>& values) {
    const Json* found = find(key);
    if (found == nullptr) return;
    if (!found->is_array()) return complain("'" + path_of(key) + "' is not a list");
    values.clear();
    for (const Json& item : *found) {
      read(item, path_of(key) + "[" + std::to_string(values.size()) + "]", values.emplace_back());
    }
  }

  void complain(const std::string& what) {
    if (complaint_.empty()) complaint_ = what;
  }
  /// Keys that no one asked for.
  void finish() {
    if (!json_.is_object() || json_.size() == known_.size()) return;
    for (const auto& [key, value] : json_.items()) {
      if (std::find(known_.begin(), known_.end(), key) == known_.end()) {
        return complain("unknown key '" + path_of(key) + "'");
      }
    }
  }

 private:
  template <class T>
  void read(const Json& json, const std::string& path, T& value) {
    Reader part(json, path, complaint_);
    describe(part, value);
    part.finish();
  }
  const Json* find(const char* key) {
    if (!json_.is_object()) return nullptr;
    const auto found = json_.find(key);
    if (found == json_.end()) {
      complain("'" + path_of(key) + "' is missing");
      return nullptr;
    }
    known_.emplace_back(key);
    return &*found;
  }
  std::string path_of(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }

  const Json& json_;
  std::string path_;
  std::string& complaint_;
  std::vector<std::string> known_;
};

template <class A>
void describe(A& archive, hal::Vector3& v) {
  archive("x", v.x);
  archive("y", v.y);
  archive("z", v.z);
}

template <class A>
void describe(A& archive, hal::Quaternion& q) {
  archive("w", q.w);
  archive("x", q.x);
  archive("y", q.y);
  archive("z", q.z);
}

template <class A>
void describe(A& archive, rt::HuntCrossleyParameters& law) {
  auto& [stiffness, damping, exponent] = law;
  archive("stiffness_n_per_mm_m", stiffness);
  archive("damping_n_s_per_mm_m1", damping);
  archive("exponent", exponent);
}

template <class A>
void describe(A& archive, rt::CreepParameters& law) {
  auto& [time_s, weight, displacement_mm, max_force_n] = law;
  archive("time_s", time_s);
  archive("weight", weight);
  archive("max_force_n", max_force_n);
  archive("displacement_mm", displacement_mm);
}

template <class A, class Parameters>
void describe(A& archive, rt::IdentifiedLaw<Parameters>& law) {
  archive("law", law.parameters);
  archive("relative_error", law.relative_error);
}

template <class A>
void describe(A& archive, rt::ContactModel& contact) {
  auto& [hunt_crossley, creep] = contact;
  archive("hunt_crossley", hunt_crossley);
  archive("creep", creep);
}

template <class A>
void describe(A& archive, rt::MaxwellSlipParameters& elements) {
  auto& [reach_mm, stiffness_per_mm] = elements;
  archive("reach_mm", reach_mm);
  archive("stiffness_per_mm", stiffness_per_mm);
}

template <class A>
void describe(A& archive, rt::FrictionModel& model) {
  std::string tip = model.tip == rt::Tip::kRod ? "rod" : "ball_bearing";
  archive("tip", tip);
  if constexpr (A::kReads) {
    if (tip != "rod" && tip != "ball_bearing") archive.complain("unknown tip '" + tip + "'");
    model.tip = tip == "rod" ? rt::Tip::kRod : rt::Tip::kBallBearing;
  }
  auto& [kinetic, presliding_mm, viscous, exponent, maxwell_slip] = model.friction;
  archive("kinetic", kinetic);
  archive("presliding_mm", presliding_mm);
  archive("viscous_n_s_per_mm", viscous);
  archive("exponent", exponent);
  archive("maxwell_slip", maxwell_slip);
}

template <class A>
void describe(A& archive, rt::StructuralModel& structure) {
  auto& [stiffness, centre_mm, gradient_per_mm, curvature_per_mm2, from_mm, to_mm] = structure;
  archive("stiffness_n_per_mm", stiffness);
  archive("centre_mm", centre_mm);
  archive("gradient_per_mm", gradient_per_mm);
  archive("curvature_per_mm2", curvature_per_mm2);
  archive("covered_from_mm", from_mm);
  archive("covered_to_mm", to_mm);
}

template <class A>
void describe(A& archive, rt::ToolModel& tool) {
  auto& [mass_g, centre_mm, force_bias_n, torque_bias_n_mm, sensor_to_tool, found_under_bias,
         tip_to_centre_mm] = tool;
  archive("mass_g", mass_g);
  archive("centre_mm", centre_mm);
  archive("force_bias_n", force_bias_n);
  archive("torque_bias_n_mm", torque_bias_n_mm);
  archive("sensor_to_tool", sensor_to_tool);
  archive("found_under_bias", found_under_bias);
  archive("tip_to_centre_mm", tip_to_centre_mm);
}

template <class A>
void describe(A& archive, rt::ThresholdModel& threshold) {
  auto& [threshold_n, largest_residual_n, observed_s] = threshold;
  archive("threshold_n", threshold_n);
  archive("largest_residual_n", largest_residual_n);
  archive("observed_s", observed_s);
}

template <class A>
void describe(A& archive, rt::GainsModel& gains) {
  auto& [proportional_gain, derivative_ms, ultimate_gain, ultimate_period_ms] = gains;
  archive("proportional_gain", proportional_gain);
  archive("derivative_ms", derivative_ms);
  archive("ultimate_gain", ultimate_gain);
  archive("ultimate_period_ms", ultimate_period_ms);
}

template <class A>
void describe(A& archive, rt::EstimatedParameter& parameter) {
  archive("name", parameter.name);
  archive("unit", parameter.unit);
  archive("value", parameter.value);
  archive("standard_error", parameter.standard_error);
}

template <class A>
void describe(A& archive, rt::ValidityRange& validity) {
  auto& [displacement_mm, speed_mm_per_s, force_n] = validity;
  archive("max_displacement_mm", displacement_mm);
  archive("max_speed_mm_per_s", speed_mm_per_s);
  archive("max_force_n", force_n);
}

/// Content of the kind `name`; none when there is no such kind.
template <std::size_t I = 0>
std::optional<rt::ModelContent> content_of(const std::string& name) {
  if constexpr (I < std::variant_size_v<rt::ModelContent>) {
    rt::ModelContent content{std::in_place_index<I>};
    if (name == rt::kind_name(content)) return content;
    return content_of<I + 1>(name);
  } else {
    return std::nullopt;
  }
}

template <class A>
void describe(A& archive, rt::IdentifiedModel& model) {
  std::string schema(kContentSchema);
  std::string kind = rt::kind_name(model.content);
  archive("schema", schema);
  archive("kind", kind);
  if constexpr (A::kReads) {
    if (schema != kContentSchema) {
      archive.complain("content of the schema '" + schema + "', which is not known here");
    }
    if (auto content = content_of(kind)) {
      model.content = std::move(*content);
    } else {
      archive.complain("unknown kind of model '" + kind + "'");
    }
  }
  std::visit([&archive](auto& content) { archive("content", content); }, model.content);
  archive("object", model.object);
  archive("device", model.device);
  archive("sensor", model.sensor);
  archive("procedure", model.procedure);
  archive("data_reference", model.data_reference);
  archive("parameters", model.parameters);
  archive("validity", model.validity);
  archive("residual", model.residual);
  archive("converged", model.converged);
}

bool touches_an_object(const rt::IdentifiedModel& model) {
  return std::holds_alternative<rt::ContactModel>(model.content) ||
         std::holds_alternative<rt::FrictionModel>(model.content);
}

/// Checks what rt::check() does not: texts and names.
std::optional<hal::Error> check_texts(const rt::IdentifiedModel& model, const std::string& where) {
  if (touches_an_object(model)) {
    if (auto error = check_name("model", model.object, where + ", object")) return error;
  } else if (!model.object.empty()) {
    return hal::Error{"a model of the rig has no object", where, model.object, "", "leave the object out"};
  }
  if (model.parameters.size() > kMaxParameters) {
    return hal::Error{"too many parameters", where, std::to_string(model.parameters.size()),
                      "at most " + std::to_string(kMaxParameters), ""};
  }
  std::vector<const std::string*> texts{&model.device, &model.sensor, &model.procedure,
                                        &model.data_reference};
  for (const rt::EstimatedParameter& parameter : model.parameters) {
    texts.push_back(&parameter.name);
    texts.push_back(&parameter.unit);
  }
  for (const std::string* text : texts) {
    if (text->size() > kMaxText) {
      return hal::Error{"a text is too long", where, text->substr(0, 60) + "…",
                        "at most " + std::to_string(kMaxText) + " bytes", "shorten it"};
    }
  }
  return std::nullopt;
}

std::optional<hal::Error> check_all(const rt::IdentifiedModel& model, const std::string& where) {
  if (auto error = rt::check(model)) {
    if (!where.empty()) error->where = where + ", " + error->where;
    return error;
  }
  return check_texts(model, where.empty() ? std::string("identified model") : where);
}

hal::Result<rt::IdentifiedModel> read_model(const Json& json, const std::string& where) {
  rt::IdentifiedModel model;
  std::string complaint;
  Reader reader(json, "", complaint);
  describe(reader, model);
  reader.finish();
  if (!complaint.empty()) return not_a_model(complaint, where);
  if (auto error = check_all(model, where)) return *error;
  return model;
}

}  // namespace

hal::Result<std::string> canonical_json(const rt::IdentifiedModel& model) {
  if (auto error = check_all(model, {})) return *error;
  Writer writer;
  describe(writer, const_cast<rt::IdentifiedModel&>(model));
  try {
    return canonical_text(writer.json);
  } catch (const Json::exception&) {
    return hal::Error{"a text of the model is not UTF-8",
                      std::string(rt::kind_name(model.content)) + " model", "", "UTF-8",
                      "give object, procedure and data reference as UTF-8"};
  }
}

hal::Result<rt::IdentifiedModel> parse_canonical_json(std::string_view json, const std::string& where) {
  const auto parsed = parse(json, where);
  if (!parsed) return parsed.error();
  return read_model(*parsed, where);
}

hal::Result<rt::IdentifiedModel> parse_canonical_json(std::string_view json, const std::string& hash,
                                                      const std::string& where) {
  if (const std::string found = sha256_hex(json); found != hash) {
    return hal::Error{"the content of a model does not fit its hash", where, found, hash,
                      "it was altered or damaged: import it again from an export"};
  }
  return parse_canonical_json(json, where);
}

std::string sha256_hex(std::string_view bytes) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int length = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest.data(), &length, EVP_sha256(), nullptr) != 1) {
    throw std::runtime_error("SHA-256 is not available");
  }
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (unsigned int i = 0; i < length; ++i) {
    text += kDigits[digest[i] >> 4U];
    text += kDigits[digest[i] & 0xFU];
  }
  return text;
}

std::string export_json(std::string_view canonical, const std::string& hash) {
  // The content is there as it was hashed, one long line: no one is tempted to fix it by hand.
  return "{\n  \"schema\": \"" + std::string(kExportSchema) + "\",\n  \"hash\": \"" + hash +
         "\",\n  \"model\": " + std::string(canonical) + "\n}\n";
}

hal::Result<ImportedModel> import_json(std::string_view json) {
  const std::string where = "imported model";
  if (json.size() > kMaxImport) {
    return not_a_model("too large to be a model", where, std::to_string(json.size()) + " bytes",
                       "at most " + std::to_string(kMaxImport) + " bytes");
  }
  const auto parsed = parse(json, where);
  if (!parsed) return parsed.error();
  const Json& document = *parsed;
  const auto text = [&document](const char* key) {
    const auto found = document.is_object() ? document.find(key) : document.end();
    return found != document.end() && found->is_string() ? found->get<std::string>() : std::string();
  };
  if (text("schema") != kExportSchema) {
    return not_a_model("not an exported model, or of another version", where,
                       "schema \"" + text("schema") + "\"", "schema \"" + std::string(kExportSchema) + "\"");
  }
  const auto content = document.find("model");
  if (content == document.end() || !content->is_object() || text("hash").empty()) {
    return not_a_model("'hash' or 'model' is missing", where);
  }
  ImportedModel imported;
  imported.canonical = canonical_text(*content);
  imported.hash = sha256_hex(imported.canonical);
  if (imported.hash != text("hash")) {
    return not_a_model("the content does not fit its hash: it was altered or damaged on the way", where,
                       imported.hash, text("hash"));
  }
  auto model = read_model(*content, where);
  if (!model) return model.error();
  // A text that is read as a model but written differently would be stored under another hash.
  const auto again = canonical_json(*model);
  if (!again) return again.error();
  if (*again != imported.canonical) return not_a_model("not in canonical form", where);
  imported.model = std::move(*model);
  return imported;
}

}  // namespace hapticd::server
