#pragma once

#include <span>
#include <string_view>

namespace hapticd::server {

/// A TOML file compiled into the daemon.
struct BuiltinText {
  std::string_view name;  ///< of the file, without its ending
  std::string_view toml;
};

/// All files of server/scene/shipped, by name.
std::span<const BuiltinText> builtin_scenes();
/// All files of server/model/shipped, by name.
std::span<const BuiltinText> builtin_models();
/// All files of hal/modbus/maps, by name.
std::span<const BuiltinText> builtin_turntable_maps();

}  // namespace hapticd::server
