#include "server/scene/scene_friction_target.h"

#include "server/text/toml_writer.h"

namespace hapticd::server {

namespace {

constexpr Range kFrictionScale{0.15, 3.0, ""};
constexpr Range kFrictionCoefficient{0.02, 3.0, ""};

void friction_target_fields(auto& root, auto& spec) {
  root.table("friction_target", spec.friction_target, [](auto& table, auto& target) {
    table.field("scale", target.scale, kFrictionScale);
    table.field("coefficient", target.coefficient, kFrictionCoefficient);
  });
}

}  // namespace

void read_friction_target(TomlTable& root, rt::SceneSpec& spec) {
  friction_target_fields(root, spec);
}

std::string friction_target_text(const rt::SceneSpec& spec) {
  return toml_fields([&](auto& root) { friction_target_fields(root, spec); });
}

}  // namespace hapticd::server
