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
    if (tip != "rod" && tip != "ball_bearing")
      archive.complain("unknown tip '" + tip + "'", hal::ErrorCode::kUnknownWord);
    model.tip = tip == "rod" ? rt::Tip::kRod : rt::Tip::kBallBearing;
  }
  // The list of parameters says how well the presliding distance is known.
  auto& [kinetic, presliding_mm, viscous, exponent, maxwell_slip, listed] = model.friction;
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
void describe(A& archive, rt::InclusionModel& inclusion) {
  auto& [place_mm, surface_mm, response, attenuation, approach] = inclusion;
  archive("place_mm", place_mm);
  archive("surface_mm", surface_mm);
  archive("response", response);
  archive("attenuation", attenuation);
  archive("approach", approach);
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
      archive.complain("content of the schema '" + schema + "', which is not known here",
                       hal::ErrorCode::kUnknownWord);
    }
    if (auto content = content_of(kind)) {
      model.content = std::move(*content);
    } else {
      archive.complain("unknown kind of model '" + kind + "'", hal::ErrorCode::kUnknownWord);
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

}  // namespace hapticd::server::model_archive
