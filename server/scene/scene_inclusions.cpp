#include "server/scene/scene_inclusions.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "server/scene/scene_models.h"
#include "server/scene/scene_words.h"
#include "server/text/suggestion.h"
#include "server/text/toml_writer.h"

namespace hapticd::server {

namespace {

constexpr std::size_t kMaxInclusions = 8;
constexpr Range kPlaceMm{-1000.0, 1000.0, "mm"};
constexpr Range kInclusionStiffness{1e-6, 1000.0, "N/mm^m"};
constexpr Range kDamping{0.0, 10.0, "N·s/mm^(m+1)"};
constexpr Range kInclusionExponent{1.0, 4.0, ""};
constexpr Range kDepthMm{0.5, 100.0, "mm"};
constexpr Range kAttenuation{2.0, 12.0, ""};
constexpr Range kApproach{0.0, 0.9, ""};
constexpr Range kRubbingFriction{0.0, 1.0, ""};
constexpr Range kPreslidingMm{0.01, 10.0, "mm"};

constexpr Word<rt::InclusionVariant> kVariants[] = {{"energy", rt::InclusionVariant::kEnergy},
                                                    {"published", rt::InclusionVariant::kPublished}};

/// What a model says of an inclusion.
constexpr const char* kOfModel[] = {"place_mm", "surface_mm", "stiffness_n_per_mm_m", "damping_n_s_per_mm_m1",
                                    "exponent", "approach",   "max_displacement_mm",  "attenuation"};

/// One refusal that names all of them, at the first: a refusal of each would cost a load of each.
void refuse_what_the_model_says(TomlTable& table, const std::string& model) {
  std::vector<std::string> said;
  for (const char* key : kOfModel) {
    if (table.wants(key)) said.emplace_back(key);
  }
  if (said.empty()) return;
  const auto first = std::min_element(said.begin(), said.end(), [&table](const auto& a, const auto& b) {
    return table.line_of(a) < table.line_of(b);
  });
  table.refuse(*first, hal::Error::of(hal::ErrorCode::kMisplacedKey, "the inclusion's model says this", "",
                                      comma_separated(said), "model = \"" + model + "\" alone",
                                      said.size() == 1 ? "remove the key, or the model"
                                                       : "remove these keys, or the model"));
}

/// Moves place and surface point to where they are to be. Those of a round object turn about its centre, so
/// that the depth stays.
std::optional<hal::Error> move(rt::InclusionParameters& one, std::size_t number) {
  const auto [x_mm, y_mm] = one.moved_mm;
  if (x_mm == 0.0 && y_mm == 0.0) return std::nullopt;
  const auto eigen = [](const hal::Vector3& v) { return Eigen::Vector3d(v.x, v.y, v.z); };
  const auto plain = [](const Eigen::Vector3d& v) { return hal::Vector3{v.x(), v.y(), v.z()}; };
  const Eigen::Vector3d aside(x_mm, y_mm, 0.0);
  if (!one.object_centre_mm) {
    one.place_mm = plain(eigen(one.place_mm) + aside);
    one.surface_mm = plain(eigen(one.surface_mm) + aside);
  } else {
    const Eigen::Vector3d centre = eigen(*one.object_centre_mm);
    const Eigen::Vector3d from = eigen(one.surface_mm) - centre;
    Eigen::Vector3d to = from + aside;
    const double left = from.squaredNorm() - to.head<2>().squaredNorm();
    if (!(left > 0.0)) {
      return hal::Error::of(hal::ErrorCode::kOutOfRange, "the inclusion cannot be moved beyond its object",
                            fmt::format("inclusion[{}].moved_mm", number),
                            fmt::format("[{:g}, {:g}] mm", x_mm, y_mm),
                            fmt::format("within {:.1f} mm of the middle", from.norm()),
                            "see object_centre_mm, or move it less");
    }
    to.z() = std::copysign(std::sqrt(left), from.z());
    // The shortest turn of one to the other; both are as long, and on the same side.
    Eigen::Quaterniond turn;
    turn.w() = from.squaredNorm() + from.dot(to);
    turn.vec() = from.cross(to);
    turn.normalize();
    one.surface_mm = plain(centre + to);
    one.place_mm = plain(centre + turn * (eigen(one.place_mm) - centre));
  }
  one.moved_mm = {};
  one.object_centre_mm.reset();
  return std::nullopt;
}

template <class Table>
void inclusion_fields(Table& table, auto& one) {
  table.field("variant", one.variant, kVariants);
  if (Table::kReads || !one.model.empty()) table.field("model", one.model, kMaxModelName);
  if (one.model.empty()) {
    table.field("place_mm", one.place_mm, kPlaceMm);
    table.field("surface_mm", one.surface_mm, kPlaceMm);
    table.field("stiffness_n_per_mm_m", one.response.stiffness_n_per_mm_m, kInclusionStiffness);
    table.field("damping_n_s_per_mm_m1", one.response.damping_n_s_per_mm_m1, kDamping);
    table.field("exponent", one.response.exponent, kInclusionExponent);
    table.field("max_displacement_mm", one.max_displacement_mm, kDepthMm);
    table.field("attenuation", one.attenuation, kAttenuation);
    table.field("approach", one.approach, kApproach);
  }
  table.field("internal_friction", one.internal_friction, kRubbingFriction);
  table.field("internal_presliding_mm", one.internal_presliding_mm, kPreslidingMm);
  if (Table::kReads || one.moved_mm != std::array<double, 2>{}) {
    table.field("moved_mm", one.moved_mm, kPlaceMm);
  }
  table.field("object_centre_mm", one.object_centre_mm, kPlaceMm);
}

}  // namespace

void read_inclusions(TomlTable& root, rt::SceneSpec& spec) {
  root.tables("inclusion", spec.inclusions, kMaxInclusions, [](TomlTable& table, auto& one) {
    inclusion_fields(table, one);
    if (one.model.empty()) return;
    if (auto name = ModelName::parse(one.model, "inclusion.model"); !name)
      table.refuse("model", name.error());
    refuse_what_the_model_says(table, one.model);
  });
}

std::string inclusions_text(const rt::SceneSpec& spec) {
  return toml_fields([&](TomlWriter& root) {
    root.tables("inclusion", spec.inclusions, kMaxInclusions,
                [](TomlWriter& table, const auto& one) { inclusion_fields(table, one); });
  });
}

std::optional<Refusal> fill_inclusions(const ModelLibrary& models, const hal::RigInfo& rig,
                                       rt::SceneSpec& spec, std::vector<std::string>& stored,
                                       std::vector<std::string>& remarks) {
  for (std::size_t i = 0; i < spec.inclusions.size(); ++i) {
    rt::InclusionParameters& one = spec.inclusions[i];
    if (one.model.empty()) {
      if (auto error = move(one, i)) return Refusal{RefusalKind::kInvalidArgument, *error};
      continue;
    }
    const auto found = models.find_inclusion(one.model);
    if (!found) return found.refusal();
    const StoredModel& model = **found;
    rt::InclusionParameters identified =
        std::get<rt::InclusionModel>(model.model.content).rendered(model.model.validity.max_displacement_mm);
    identified.variant = one.variant;
    identified.internal_friction = one.internal_friction;
    identified.internal_presliding_mm = one.internal_presliding_mm;
    identified.moved_mm = one.moved_mm;
    identified.object_centre_mm = one.object_centre_mm;
    if (auto error = move(identified, i)) return Refusal{RefusalKind::kInvalidArgument, *error};
    std::string remark = fmt::format("inclusion {}: '{}' at {} mm, from stored model {}", i + 1, one.model,
                                     toml_vector(identified.place_mm), model.short_hash());
    for (const std::string& caution : cautions(model, spec, rig)) remark += "; " + caution;
    remarks.push_back(std::move(remark));
    stored.push_back(model.hash);
    one = identified;
  }
  return std::nullopt;
}

}  // namespace hapticd::server
