#include "server/scene_library.h"

#include <algorithm>
#include <filesystem>

#include "server/builtin_scenes.h"
#include "server/scene_file.h"
#include "server/suggestion.h"
#include "server/toml_reader.h"

namespace hapticd::server {

namespace fs = std::filesystem;

std::optional<hal::Error> SceneLibrary::check_folder() const {
  std::error_code failure;
  if (folder_.empty() || fs::is_directory(folder_, failure)) return std::nullopt;
  return hal::Error{"the scene folder cannot be read", folder_, failure ? failure.message() : "not a folder",
                    "", "check path and permissions"};
}

std::vector<std::string> SceneLibrary::folder_names() const {
  std::vector<std::string> names;
  if (folder_.empty()) return names;
  std::error_code failure;
  for (fs::directory_iterator it(folder_, failure), end; !failure && it != end; it.increment(failure)) {
    std::error_code kind;
    const std::string stem = it->path().stem().string();
    if (it->path().extension() == ".toml" && it->is_regular_file(kind) && !check_scene_name(stem, "")) {
      names.push_back(stem);
    }
  }
  return names;
}

std::vector<std::string> SceneLibrary::names() const {
  std::vector<std::string> names = folder_names();
  for (const BuiltinScene& scene : builtin_scenes()) names.emplace_back(scene.name);
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

std::vector<SceneLibrary::Entry> SceneLibrary::list() const {
  std::vector<Entry> entries;
  for (const std::string& name : names()) {
    const auto spec = find(name);
    entries.push_back({name, spec ? spec->description : "(cannot be loaded: " + spec.error().text() + ")"});
  }
  return entries;
}

bool SceneLibrary::contains(const std::string& name) const {
  const std::vector<std::string> known = names();
  return std::find(known.begin(), known.end(), name) != known.end();
}

hal::Result<rt::SceneSpec> SceneLibrary::find(const std::string& name) const {
  // Only names found in the folder are opened: a name never becomes a path by itself.
  const std::vector<std::string> in_folder = folder_names();
  if (std::find(in_folder.begin(), in_folder.end(), name) != in_folder.end()) {
    const std::string path = (fs::path(folder_) / (name + ".toml")).string();
    const auto text = read_text_file(path);
    if (!text) return text.error();
    return parse_scene(*text, path, name);
  }
  for (const BuiltinScene& scene : builtin_scenes()) {
    if (scene.name == name) return parse_scene(scene.toml, "built-in scene '" + name + "'", name);
  }
  const std::vector<std::string> known = names();
  return hal::Error{"unknown scene '" + name + "'", "scene name", name, comma_separated(known),
                    did_you_mean(name, known, "use one of those")};
}

}  // namespace hapticd::server
