#include "server/scene/scene_inclusions.h"

#include <fmt/format.h>

#include "server/text/toml_text.h"

namespace hapticd::server {

namespace {

constexpr std::size_t kMaxInclusions = 8;
constexpr Range kPositionMm{-1000.0, 1000.0, "mm"};
constexpr Range kStiffness{1e-6, 1000.0, "N/mm^m"};
constexpr Range kDamping{0.0, 10.0, "N·s/mm^(m+1)"};
constexpr Range kExponent{1.0, 4.0, ""};
constexpr Range kDepthMm{0.5, 100.0, "mm"};
constexpr Range kAttenuation{2.0, 12.0, ""};
constexpr Range kApproach{0.0, 0.9, ""};
constexpr Range kFriction{0.0, 1.0, ""};
constexpr Range kPreslidingMm{0.01, 10.0, "mm"};

constexpr Word<rt::InclusionVariant> kVariants[] = {{"energy", rt::InclusionVariant::kEnergy},
                                                    {"published", rt::InclusionVariant::kPublished}};

std::string vector_text(const hal::Vector3& v) {
  return fmt::format("[{}, {}, {}]", toml_number(v.x), toml_number(v.y), toml_number(v.z));
}

}  // namespace

void read_inclusions(TomlTable& root, rt::SceneSpec& spec) {
  for (TomlTable& table : root.tables("inclusion", kMaxInclusions)) {
    rt::InclusionParameters& one = spec.inclusions.emplace_back();
    table.read("variant", one.variant, kVariants);
    table.read("place_mm", one.place_mm, kPositionMm);
    table.read("surface_mm", one.surface_mm, kPositionMm);
    table.read("stiffness_n_per_mm_m", one.response.stiffness_n_per_mm_m, kStiffness);
    table.read("damping_n_s_per_mm_m1", one.response.damping_n_s_per_mm_m1, kDamping);
    table.read("exponent", one.response.exponent, kExponent);
    table.read("max_displacement_mm", one.max_displacement_mm, kDepthMm);
    table.read("attenuation", one.attenuation, kAttenuation);
    table.read("approach", one.approach, kApproach);
    table.read("internal_friction", one.internal_friction, kFriction);
    table.read("internal_presliding_mm", one.internal_presliding_mm, kPreslidingMm);
  }
}

std::string inclusions_text(const rt::SceneSpec& spec) {
  std::string text;
  for (const rt::InclusionParameters& one : spec.inclusions) {
    const bool published = one.variant == rt::InclusionVariant::kPublished;
    text += fmt::format(
        "\n[[inclusion]]\nvariant = {}\nplace_mm = {}\nsurface_mm = {}\nstiffness_n_per_mm_m = {}\n"
        "damping_n_s_per_mm_m1 = {}\nexponent = {}\nmax_displacement_mm = {}\nattenuation = {}\n"
        "approach = {}\ninternal_friction = {}\ninternal_presliding_mm = {}\n",
        toml_quoted(published ? "published" : "energy"), vector_text(one.place_mm),
        vector_text(one.surface_mm), toml_number(one.response.stiffness_n_per_mm_m),
        toml_number(one.response.damping_n_s_per_mm_m1), toml_number(one.response.exponent),
        toml_number(one.max_displacement_mm), toml_number(one.attenuation), toml_number(one.approach),
        toml_number(one.internal_friction), toml_number(one.internal_presliding_mm));
  }
  return text;
}

}  // namespace hapticd::server
