#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "rt/model/identified_model.h"
#include "server/model/canonical_text.h"
#include "server/model/law_description.h"

// One description of every part, read and written by the two archives. A field that is added to a part does
// not compile until it is stored, too: the bindings in describe() name all fields.
//
// The fields and their names are those of the content's schema: the hash of every stored model is of this
// text. A change of the contract's messages must not change it, so it is not made from them.
namespace hapticd::server::model_archive {

inline constexpr std::string_view kContentSchema = "hapticd.model/1";
inline constexpr const char* kInfinity = "Infinity";
/// Fills a JSON object.
class Writer {
 public:
  static constexpr bool kReads = false;

  void field(const char* key, const double& value, const Range& = {}) {
    // JSON has no infinity; rt::check() lets only a standard error be infinite.
    if (std::isinf(value)) {
      json[key] = kInfinity;
    } else {
      json[key] = value;
    }
  }
  void field(const char* key, const bool& value) { json[key] = value; }
  void field(const char* key, const std::string& value) { json[key] = value; }
  template <std::size_t N>
  void field(const char* key, const std::array<double, N>& values, const Range& = {}) {
    json[key] = values;
  }
  template <class T>
  requires std::is_class_v<T>
  void field(const char* key, const T& value) {
    Writer part;
    describe(part, const_cast<T&>(value));  // a writer changes nothing
    json[key] = std::move(part.json);
  }
  template <class T>
  void field(const char* key, const std::optional<T>& value) {
    if (value) field(key, *value);
  }
  template <class T>
  void field(const char* key, const std::vector<T>& values) {
    json[key] = Json::array();
    for (const T& value : values) {
      Writer part;
      describe(part, const_cast<T&>(value));
      json[key].push_back(std::move(part.json));
    }
  }

  Json json = Json::object();
};

/// The error of an object that was read.
struct Complaint {
  std::string what;  ///< empty if nothing is
  hal::ErrorCode code = hal::ErrorCode::kOther;
};

/// Reads an object; the first key that is missing, of another type or unknown is its error.
class Reader {
 public:
  static constexpr bool kReads = true;

  Reader(const Json& json, std::string path, Complaint& complaint)
      : json_(json), path_(std::move(path)), complaint_(complaint) {
    if (!json_.is_object()) complain("'" + path_ + "' is not an object");
  }

  void field(const char* key, double& value, const Range& = {}) {
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
  void field(const char* key, bool& value) {
    if (const Json* found = find(key)) {
      if (!found->is_boolean()) return complain("'" + path_of(key) + "' is neither true nor false");
      value = found->get<bool>();
    }
  }
  void field(const char* key, std::string& value) {
    if (const Json* found = find(key)) {
      if (!found->is_string()) return complain("'" + path_of(key) + "' is not a text");
      value = found->get<std::string>();
    }
  }
  template <std::size_t N>
  void field(const char* key, std::array<double, N>& values, const Range& = {}) {
    const Json* found = find(key);
    if (found == nullptr) return;
    const bool fits = found->is_array() && found->size() == N &&
                      std::all_of(found->begin(), found->end(), [](const Json& v) { return v.is_number(); });
    if (!fits) return complain("'" + path_of(key) + "' is not a list of " + std::to_string(N) + " numbers");
    values = found->get<std::array<double, N>>();
  }
  template <class T>
  requires std::is_class_v<T>
  void field(const char* key, T& value) {
    if (const Json* found = find(key)) read(*found, path_of(key), value);
  }
  template <class T>
  void field(const char* key, std::optional<T>& value) {
    if (json_.is_object() && json_.contains(key)) field(key, value.emplace());
  }
  template <class T>
  void field(const char* key, std::vector<T>& values) {
    const Json* found = find(key);
    if (found == nullptr) return;
    if (!found->is_array()) return complain("'" + path_of(key) + "' is not a list");
    values.clear();
    for (const Json& item : *found) {
      const std::string place = path_of(key) + "[" + std::to_string(values.size()) + "]";
      read(item, place, values.emplace_back());
    }
  }

  void complain(const std::string& what, hal::ErrorCode code = hal::ErrorCode::kWrongType) {
    if (complaint_.what.empty()) complaint_ = {what, code};
  }
  /// Checks that no key is left that was not read.
  void finish() {
    if (!json_.is_object() || json_.size() == known_.size()) return;
    for (const auto& [key, value] : json_.items()) {
      if (std::find(known_.begin(), known_.end(), key) == known_.end()) {
        return complain("unknown key '" + path_of(key) + "'", hal::ErrorCode::kUnknownKey);
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
      complain("'" + path_of(key) + "' is missing", hal::ErrorCode::kMissingKey);
      return nullptr;
    }
    known_.emplace_back(key);
    return &*found;
  }
  std::string path_of(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }

  const Json& json_;
  std::string path_;
  Complaint& complaint_;
  std::vector<std::string> known_;
};

template <class A>
void describe(A& archive, hal::Vector3& v) {
  archive.field("x", v.x);
  archive.field("y", v.y);
  archive.field("z", v.z);
}

template <class A>
void describe(A& archive, hal::Quaternion& q) {
  archive.field("w", q.w);
  archive.field("x", q.x);
  archive.field("y", q.y);
  archive.field("z", q.z);
}

template <class A, class Parameters>
void describe(A& archive, rt::IdentifiedLaw<Parameters>& law) {
  archive.field("law", law.parameters);
  archive.field("relative_error", law.relative_error);
}

template <class A>
void describe(A& archive, rt::ContactModel& contact) {
  auto& [hunt_crossley, creep] = contact;
  archive.field("hunt_crossley", hunt_crossley);
  archive.field("creep", creep);
}

template <class A>
void describe(A& archive, rt::FrictionModel& model) {
  std::string tip = model.tip == rt::Tip::kRod ? "rod" : "ball_bearing";
  archive.field("tip", tip);
  if constexpr (A::kReads) {
    if (tip != "rod" && tip != "ball_bearing")
      archive.complain("unknown tip '" + tip + "'", hal::ErrorCode::kUnknownWord);
    model.tip = tip == "rod" ? rt::Tip::kRod : rt::Tip::kBallBearing;
  }
  describe(archive, model.friction);
  archive.field("exponent", model.friction.exponent);
  archive.field("maxwell_slip", model.friction.maxwell_slip);
}

template <class A>
void describe(A& archive, rt::StructuralModel& structure) {
  auto& [stiffness, centre_mm, gradient_per_mm, curvature_per_mm2, from_mm, to_mm] = structure;
  archive.field("stiffness_n_per_mm", stiffness);
  archive.field("centre_mm", centre_mm);
  archive.field("gradient_per_mm", gradient_per_mm);
  archive.field("curvature_per_mm2", curvature_per_mm2);
  archive.field("covered_from_mm", from_mm);
  archive.field("covered_to_mm", to_mm);
}

template <class A>
void describe(A& archive, rt::ToolModel& tool) {
  auto& [mass_g, centre_mm, force_bias_n, torque_bias_n_mm, sensor_to_tool, found_under_bias,
         tip_to_centre_mm] = tool;
  archive.field("mass_g", mass_g);
  archive.field("centre_mm", centre_mm);
  archive.field("force_bias_n", force_bias_n);
  archive.field("torque_bias_n_mm", torque_bias_n_mm);
  archive.field("sensor_to_tool", sensor_to_tool);
  archive.field("found_under_bias", found_under_bias);
  archive.field("tip_to_centre_mm", tip_to_centre_mm);
}

template <class A>
void describe(A& archive, rt::ThresholdModel& threshold) {
  auto& [threshold_n, largest_residual_n, observed_s] = threshold;
  archive.field("threshold_n", threshold_n);
  archive.field("largest_residual_n", largest_residual_n);
  archive.field("observed_s", observed_s);
}

template <class A>
void describe(A& archive, rt::GainsModel& gains) {
  auto& [proportional_gain, derivative_ms, ultimate_gain, ultimate_period_ms] = gains;
  archive.field("proportional_gain", proportional_gain);
  archive.field("derivative_ms", derivative_ms);
  archive.field("ultimate_gain", ultimate_gain);
  archive.field("ultimate_period_ms", ultimate_period_ms);
}

template <class A>
void describe(A& archive, rt::InclusionModel& inclusion) {
  auto& [place_mm, surface_mm, response, attenuation, approach] = inclusion;
  archive.field("place_mm", place_mm);
  archive.field("surface_mm", surface_mm);
  archive.field("response", response);
  archive.field("attenuation", attenuation);
  archive.field("approach", approach);
}

template <class A>
void describe(A& archive, rt::EstimatedParameter& parameter) {
  archive.field("name", parameter.name);
  archive.field("unit", parameter.unit);
  archive.field("value", parameter.value);
  archive.field("standard_error", parameter.standard_error);
}

template <class A>
void describe(A& archive, rt::ValidityRange& validity) {
  auto& [displacement_mm, speed_mm_per_s, force_n] = validity;
  archive.field("max_displacement_mm", displacement_mm);
  archive.field("max_speed_mm_per_s", speed_mm_per_s);
  archive.field("max_force_n", force_n);
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
  archive.field("schema", schema);
  archive.field("kind", kind);
  if constexpr (A::kReads) {
    if (schema != kContentSchema) {
      archive.complain("content of the schema '" + schema + "', which is not known here",
                       hal::ErrorCode::kUnknownWord);
    }
    if (auto content = content_of(kind)) {
      model.content = std::move(*content);
    } else {
      archive.complain("unknown kind of model '" + kind + "'", hal::ErrorCode::kUnknownWord);
    }
  }
  std::visit([&archive](auto& content) { archive.field("content", content); }, model.content);
  archive.field("object", model.object);
  archive.field("device", model.device);
  archive.field("sensor", model.sensor);
  archive.field("procedure", model.procedure);
  archive.field("data_reference", model.data_reference);
  archive.field("parameters", model.parameters);
  archive.field("validity", model.validity);
  archive.field("residual", model.residual);
  archive.field("converged", model.converged);
}

}  // namespace hapticd::server::model_archive
