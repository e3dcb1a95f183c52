#include "server/model_library.h"

#include "server/model_file.h"

namespace hapticd::server {

std::vector<ModelLibrary::Entry> ModelLibrary::list() const {
  std::vector<Entry> entries;
  for (const std::string& name : texts_.names()) {
    auto model = find(name);
    Entry& entry = entries.emplace_back();
    entry.name = name;
    if (model) {
      entry.model = std::move(*model);
    } else {
      entry.problem = model.error().text();
    }
  }
  return entries;
}

hal::Result<rt::ObjectModel> ModelLibrary::find(const std::string& name) const {
  const auto text = texts_.find(name);
  if (!text) return text.error();
  return parse_model(text->toml, text->source, name);
}

}  // namespace hapticd::server
