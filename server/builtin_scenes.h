#pragma once

#include <span>
#include <string_view>

namespace hapticd::server {

/// A scene compiled into the daemon.
struct BuiltinScene {
  std::string_view name;
  std::string_view toml;
};

/// All files of server/scenes, by name.
std::span<const BuiltinScene> builtin_scenes();

}  // namespace hapticd::server
