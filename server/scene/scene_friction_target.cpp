#include "server/scene/scene_friction_target.h"

#include <fmt/format.h>

#include "server/text/toml_text.h"

namespace hapticd::server {

namespace {

constexpr Range kFrictionScale{0.15, 3.0, ""};
constexpr Range kFrictionCoefficient{0.02, 3.0, ""};

}  // namespace

void read_friction_target(TomlTable& root, rt::SceneSpec& spec) {
  if (!root.has("friction_target")) return;
  rt::FrictionTarget& target = spec.friction_target.emplace();
  TomlTable table = root.table("friction_target");
  table.read("scale", target.scale, kFrictionScale);
  table.read("coefficient", target.coefficient, kFrictionCoefficient);
}

std::string friction_target_text(const rt::SceneSpec& spec) {
  if (!spec.friction_target) return {};
  std::string text = "\n[friction_target]\n";
  if (spec.friction_target->scale)
    text += fmt::format("scale = {}\n", toml_number(*spec.friction_target->scale));
  if (spec.friction_target->coefficient) {
    text += fmt::format("coefficient = {}\n", toml_number(*spec.friction_target->coefficient));
  }
  return text;
}

}  // namespace hapticd::server
