#include "server/scene/scene_library.h"

#include "server/scene/scene_file.h"

namespace hapticd::server {

std::vector<SceneLibrary::Entry> SceneLibrary::list() const {
  std::vector<Entry> entries;
  for (const std::string& name : texts_.names()) {
    const auto spec = find(name);
    entries.push_back({name, spec ? spec->description : "(cannot be loaded: " + spec.error().text() + ")"});
  }
  return entries;
}

hal::Result<rt::SceneSpec> SceneLibrary::find(const std::string& name) const {
  const auto text = texts_.find(name);
  if (!text) return text.error();
  return parse_scene(text->toml, text->source, name);
}

}  // namespace hapticd::server
