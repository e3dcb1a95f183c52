#include "server/model/store/model_library.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/model/model_file.h"
#include "server/process/log.h"
#include "server/text/suggestion.h"

namespace hapticd::server {

namespace {

void sort_uniquely(std::vector<std::string>& words) {
  std::sort(words.begin(), words.end());
  words.erase(std::unique(words.begin(), words.end()), words.end());
}

/// Narrower of two limits; zero means unknown, then the other is used.
double narrower(double a, double b) {
  if (a == 0.0 || b == 0.0) return std::max(a, b);
  return std::min(a, b);
}

std::string said_of(const StoredModel& stored) {
  const rt::IdentifiedModel& model = stored.model;
  std::string text = "stored model " + stored.short_hash();
  if (!model.device.empty()) text += " of " + model.device;
  if (!model.procedure.empty()) text += ", " + model.procedure;
  return text;
}

/// Replaces a file's parts by those of the stored models.
void put_together(FoundModel& found, const FoundModel::Origin& contact, const FoundModel::Origin& friction,
                  const FoundModel::Origin& bearing) {
  rt::ObjectModel& model = found.model;
  std::vector<std::string> said;
  if (contact) {
    const auto& laws = std::get<rt::ContactModel>(contact->model.content);
    if (laws.hunt_crossley) {
      model.hunt_crossley = laws.hunt_crossley;
      found.hunt_crossley = contact;
    }
    if (laws.creep) {
      model.creep = laws.creep;
      found.creep = contact;
    }
    // The validity is the range that all remaining laws share.
    const bool law_of_file = (model.hunt_crossley && !found.hunt_crossley) || (model.creep && !found.creep);
    const rt::ValidityRange& covered = contact->model.validity;
    model.max_displacement_mm = law_of_file ? narrower(model.max_displacement_mm, covered.max_displacement_mm)
                                            : covered.max_displacement_mm;
    model.max_force_n = law_of_file ? narrower(model.max_force_n, covered.max_force_n) : covered.max_force_n;
    said.push_back(said_of(*contact));
  }
  if (friction) {
    model.rod_friction = rt::rendered_friction(friction->model);
    found.rod_friction = friction;
    said.push_back(said_of(*friction));
  }
  if (bearing) {
    model.bearing_friction = rt::rendered_friction(bearing->model);
    found.bearing_friction = bearing;
    said.push_back(said_of(*bearing));
  }
  if (said.empty()) return;
  const bool part_of_file = (model.hunt_crossley && !found.hunt_crossley) || (model.creep && !found.creep) ||
                            (model.rod_friction && !found.rod_friction) ||
                            (model.bearing_friction && !found.bearing_friction);
  if (part_of_file && !model.identified_on.empty()) said.push_back("the rest: " + model.identified_on);
  model.identified_on = fmt::format("{}", fmt::join(said, "; "));
}

}  // namespace

hal::Result<ModelName> ModelName::parse(std::string_view text, std::string_view where) {
  const std::size_t at = text.find('@');
  ModelName name;
  name.object = std::string(text.substr(0, at));
  if (auto error = check_name("model", name.object, where)) return *error;
  if (at == std::string_view::npos) return name;
  name.tag = std::string(text.substr(at + 1));
  if (auto error = check_name("tag", name.tag, where)) {
    error->remedy = "say NAME@TAG, or NAME alone";
    return *error;
  }
  return name;
}

std::vector<std::string> FoundModel::stored() const {
  std::vector<std::string> hashes;
  for (const Origin& origin : {hunt_crossley, creep, rod_friction, bearing_friction}) {
    if (origin) hashes.push_back(origin->hash);
  }
  sort_uniquely(hashes);
  return hashes;
}

FoundModel::Origin ModelLibrary::stored(const std::string& kind, const std::string& subject,
                                        const std::vector<std::string>& tags) const {
  if (!store_) return nullptr;
  for (const std::string& tag : tags) {
    auto found = store_->tagged(kind, subject, tag);
    if (found) return std::make_shared<const StoredModel>(std::move(*found));
    // One that is there but cannot be read is reported, and the scene goes on with what else there is.
    if (found.refusal().kind != RefusalKind::kNotFound) log_warning(found.refusal().error.text());
  }
  return nullptr;
}

std::vector<std::string> ModelLibrary::tags_of(const std::string& object) const {
  std::vector<std::string> all;
  if (!store_) return all;
  for (const auto& [kind, subject] : {std::pair("contact", object), std::pair("friction", object + "/rod"),
                                      std::pair("friction", object + "/ball_bearing")}) {
    if (auto tags = store_->tags_of(kind, subject)) all.insert(all.end(), tags->begin(), tags->end());
  }
  sort_uniquely(all);
  return all;
}

std::vector<std::string> ModelLibrary::stored_objects() const {
  std::vector<std::string> objects;
  if (!store_) return objects;
  auto models = store_->list({.kind = {}, .object = {}, .tag = kCurrentTag});
  if (!models) {
    log_warning(models.refusal().error.text());
    return objects;
  }
  for (const StoredModel& stored : *models) {
    const bool usable = std::holds_alternative<rt::ContactModel>(stored.model.content) ||
                        std::holds_alternative<rt::FrictionModel>(stored.model.content);
    if (usable && store_->serves(stored)) objects.push_back(stored.model.object);
  }
  sort_uniquely(objects);
  return objects;
}

std::vector<std::string> ModelLibrary::names() const {
  std::vector<std::string> all = texts_.names();
  const std::vector<std::string> objects = stored_objects();
  all.insert(all.end(), objects.begin(), objects.end());
  sort_uniquely(all);
  return all;
}

bool ModelLibrary::contains(const std::string& name) const {
  const auto parsed = ModelName::parse(name, "");
  return parsed && (texts_.contains(parsed->object) || !tags_of(parsed->object).empty());
}

bool ModelLibrary::has_friction_of_bearing(const std::string& name) const {
  const auto parsed = ModelName::parse(name, "");
  if (!parsed || !store_) return false;
  const auto tags = store_->tags_of("friction", parsed->object + "/ball_bearing");
  return tags && !tags->empty();
}

std::vector<ModelLibrary::Entry> ModelLibrary::list() const {
  std::vector<Entry> entries;
  for (const std::string& name : names()) {
    auto found = find_parts(name);
    Entry& entry = entries.emplace_back();
    entry.name = name;
    if (found) {
      entry.stored = found->stored();
      entry.model = std::move(found->model);
    } else {
      entry.problem = found.refusal().error.text();
    }
  }
  return entries;
}

hal::Result<rt::ObjectModel> ModelLibrary::find(const std::string& name) const {
  auto found = find_parts(name);
  if (!found) return found.refusal().error;
  return std::move(found->model);
}

std::string ModelLibrary::other_rig_kind(const std::string& object) const {
  if (!store_) return {};
  const auto models = store_->list({.kind = {}, .object = object, .tag = {}});
  if (!models) return {};
  for (const StoredModel& stored : *models) {
    if (!store_->serves(stored)) return stored.rig_kind;
  }
  return {};
}

hal::Error ModelLibrary::unknown(const std::string& object) const {
  const std::vector<std::string> known = names();
  const std::vector<std::string> tags = tags_of(object);
  if (const std::string other = other_rig_kind(object); tags.empty() && !other.empty()) {
    return {fmt::format("what is stored of '{}' was identified on a {} rig, and this is none", object, other),
            "model name", object, comma_separated(known),
            fmt::format(
                "identify the object on this rig; or, to use it all the same, give it a tag of its own and "
                "say {}@TAG",
                object)};
  }
  if (tags.empty()) {
    return hal::Error::of(hal::ErrorCode::kNotFound, fmt::format("unknown model '{}'", object), "model name",
                          object, comma_separated(known), did_you_mean(object, known, "use one of those"));
  }
  return hal::Error::of(
      hal::ErrorCode::kNotFound, fmt::format("no model of '{}' is tagged '{}'", object, kCurrentTag),
      "model name", object, fmt::format("{}@{}", object, fmt::join(tags, fmt::format(", {}@", object))),
      fmt::format("say one of those, or tag one: hapticctl model tag HASH {}", kCurrentTag));
}

hal::Error ModelLibrary::unknown_tag(const ModelName& name) const {
  const std::vector<std::string> tags = tags_of(name.object);
  if (tags.empty() && !texts_.contains(name.object)) return unknown(name.object);
  return hal::Error::of(hal::ErrorCode::kNotFound,
                        fmt::format("no model of '{}' has the tag '{}'", name.object, name.tag), "model name",
                        name.object + "@" + name.tag,
                        tags.empty() ? "no tag: none of its models is stored" : comma_separated(tags),
                        did_you_mean(name.tag, tags, "tag one: hapticctl model tag HASH " + name.tag));
}

Outcome<FoundModel> ModelLibrary::find_parts(const std::string& name) const {
  const auto parsed = ModelName::parse(name, "model name");
  if (!parsed) return Refusal{RefusalKind::kInvalidArgument, parsed.error()};
  const std::string& object = parsed->object;
  std::vector<std::string> tags;
  if (!parsed->tag.empty()) {
    const std::vector<std::string> known = tags_of(object);
    if (std::find(known.begin(), known.end(), parsed->tag) == known.end()) {
      return Refusal{RefusalKind::kNotFound, unknown_tag(*parsed)};
    }
    tags.push_back(parsed->tag);
  }
  tags.emplace_back(kCurrentTag);
  const FoundModel::Origin contact = stored("contact", object, tags);
  const FoundModel::Origin friction = stored("friction", object + "/rod", tags);
  const FoundModel::Origin bearing = stored("friction", object + "/ball_bearing", tags);

  FoundModel found;
  if (texts_.contains(object)) {
    const auto text = texts_.find(object);
    if (!text) return Refusal{RefusalKind::kInvalidArgument, text.error()};
    auto model = parse_model(text->toml, text->source, object);
    if (!model) return Refusal{RefusalKind::kInvalidArgument, model.error()};
    found.model = std::move(*model);
  } else if (!contact && !friction && !bearing) {
    return Refusal{RefusalKind::kNotFound, unknown(object)};
  }
  found.model.name = object;
  put_together(found, contact, friction, bearing);
  return found;
}

RigModels ModelLibrary::of_rig(const hal::RigInfo& rig) const {
  RigModels models;
  const std::string& device = rig.device.model;
  if (device.empty()) return models;
  const std::string both = device + "/" + rig.sensor.model;
  models.structure = stored("structural_stiffness", device, {kCurrentTag});
  models.tool = stored("tool", both, {kCurrentTag});
  models.threshold = stored("threshold", both, {kCurrentTag});
  models.gains = stored("gains", both, {kCurrentTag});
  return models;
}

}  // namespace hapticd::server
