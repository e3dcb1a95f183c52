#include <algorithm>

#include "server/model/store/model_library.h"
#include "server/text/suggestion.h"

namespace hapticd::server {

Outcome<FoundModel::Origin> ModelLibrary::find_inclusion(const std::string& name) const {
  constexpr const char* kKind = "inclusion";
  const auto parsed = ModelName::parse(name, "inclusion.model");
  if (!parsed) return Refusal{RefusalKind::kInvalidArgument, parsed.error()};
  const std::string tag = parsed->tag.empty() ? kCurrentTag : parsed->tag;
  if (auto found = stored(kKind, parsed->object, {tag})) return found;
  std::vector<std::string> known;
  bool is_stored = false;
  if (store_) {
    if (const auto models = store_->list({.kind = kKind, .object = {}, .tag = {}})) {
      for (const StoredModel& model : *models) {
        is_stored = is_stored || model.model.object == parsed->object;
        for (const std::string& one : model.tags) {
          if (one == kCurrentTag && !store_->serves(model)) continue;
          known.push_back(one == kCurrentTag ? model.model.object : model.model.object + "@" + one);
        }
      }
    }
  }
  std::sort(known.begin(), known.end());
  known.erase(std::unique(known.begin(), known.end()), known.end());
  const std::string otherwise =
      is_stored ? "tag one of its models: hapticctl model tag HASH " + tag
                : "identify it: hapticctl identify inclusion --object " + parsed->object + " --adopt";
  return Refusal{RefusalKind::kNotFound,
                 {"no such model of an inclusion", "inclusion.model", name, comma_separated(known),
                  is_stored ? otherwise : did_you_mean(name, known, otherwise)}};
}

}  // namespace hapticd::server
