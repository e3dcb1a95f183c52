#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "server/config/config.h"
#include "server/scene/scene_file.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::server {
namespace {

/// The keys of a TOML text that has one a line.
std::vector<std::string> keys_of(const std::string& toml) {
  std::vector<std::string> keys;
  std::istringstream lines(toml);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t equals = line.find(" = ");
    if (equals != std::string::npos) keys.push_back(line.substr(0, equals));
  }
  return keys;
}

void expect_documented(const std::string& toml, const std::string& pages, const std::string& where) {
  const std::vector<std::string> keys = keys_of(toml);
  EXPECT_GT(keys.size(), 10U);
  for (const std::string& key : keys) {
    EXPECT_NE(pages.find(key), std::string::npos) << "'" << key << "' does not stand in " << where;
  }
}

TEST(DocumentedKeys, EveryKeyOfTheConfigurationHasItsPlace) {
  const std::filesystem::path root = SOURCE_FOLDER;
  std::string pages = test::file_text(root / "docs/configuration.md");
  for (const auto& entry : std::filesystem::directory_iterator(root / "hal")) {
    pages += test::file_text(entry.path() / "README.md");
  }
  expect_documented(write_config(DaemonConfig{}), pages, "docs/configuration.md or a README of hal/");
}

TEST(DocumentedKeys, EveryKeyOfASceneHasItsPlace) {
  const std::string page = test::file_text(std::filesystem::path(SOURCE_FOLDER) / "docs/scenes.md");
  for (const rt::SceneKind kind : {rt::SceneKind::kTap1d, rt::SceneKind::kWall, rt::SceneKind::kExplore}) {
    rt::SceneSpec spec;
    spec.name = "any";
    spec.kind = kind;
    spec.explore.sensor_mounting.emplace();
    expect_documented(write_scene(spec), page, "docs/scenes.md");
  }
}

}  // namespace
}  // namespace hapticd::server
