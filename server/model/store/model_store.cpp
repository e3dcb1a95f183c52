#include "server/model/store/model_store.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <thread>
#include <utility>

#include "server/model/canonical_text.h"
#include "server/model/model_json.h"
#include "server/model/store/model_store_schema.h"
#include "server/model/store/model_store_state.h"
#include "server/process/log.h"
#include "server/text/suggestion.h"
#include "server/text/text_library.h"

namespace hapticd::server {

namespace fs = std::filesystem;

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kOpenTimeout{5};

bool is_device_bound_to_sensor(const rt::IdentifiedModel& model) {
  return !std::holds_alternative<rt::StructuralModel>(model.content);
}

}  // namespace

std::string subject_of(const rt::IdentifiedModel& model) {
  if (const auto* friction = std::get_if<rt::FrictionModel>(&model.content)) {
    return model.object + (friction->tip == rt::Tip::kRod ? "/rod" : "/ball_bearing");
  }
  if (rt::is_of_object(model.content)) return model.object;
  return is_device_bound_to_sensor(model) ? model.device + "/" + model.sensor : model.device;
}

ModelStore::ModelStore(std::unique_ptr<State> state) : state_(std::move(state)) {}
ModelStore::~ModelStore() = default;

bool ModelStore::in_memory() const {
  return state_->path.empty();
}

const std::string& ModelStore::path() const {
  return state_->path;
}

bool ModelStore::serves(const StoredModel& stored) const {
  return state_->rig_kind.empty() || stored.rig_kind.empty() || stored.rig_kind == state_->rig_kind;
}

std::optional<hal::Error> ModelStore::check(const std::string& path) {
  if (means_memory(path)) return std::nullopt;
  std::error_code failure;
  if (fs::exists(path, failure) && !fs::is_regular_file(path, failure)) {
    return hal::Error{"the store of models is not a file", path, "", "a file", "name another one"};
  }
  return store_schema::check_header(path);
}

hal::Result<std::unique_ptr<ModelStore>> ModelStore::open(const std::string& path,
                                                          const std::string& rig_kind) {
  if (auto error = check(path)) return *error;
  if (!means_memory(path)) {
    std::error_code failure;
    const fs::path folder = fs::absolute(path, failure).parent_path();
    fs::create_directories(folder, failure);
    if (failure) {
      return hal::Error{"the folder of the store of models cannot be made", folder.string(),
                        failure.message(), "",
                        "name another file with --model-store, or :memory: to keep no models"};
    }
  }
  const auto until = Clock::now() + kOpenTimeout;
  for (;;) {
    try {
      auto state = std::make_unique<State>(path, rig_kind);
      if (auto error = state->set_up()) return *error;
      return std::unique_ptr<ModelStore>(new ModelStore(std::move(state)));
    } catch (const SQLite::Exception& failure) {
      if (!is_busy(failure) || Clock::now() >= until) return refusal_of(failure, path, errno).error;
    }
    std::this_thread::sleep_for(kRetryEvery);
  }
}

Outcome<StoredModel> ModelStore::add(const rt::IdentifiedModel& model, Until until) {
  const auto canonical = canonical_json(model);
  if (!canonical) return invalid(canonical.error());
  return state_->guarded(until, [&]() -> Outcome<StoredModel> {
    // The device of a recording is not known.
    const std::string identified_on = model.device.empty() ? std::string() : state_->rig_kind;
    return state_->insert(model, *canonical, sha256_hex(*canonical), identified_on);
  });
}

Outcome<StoredModel> ModelStore::get(std::string_view hash, Until until) const {
  return state_->guarded(until, [&]() -> Outcome<StoredModel> { return state_->find(hash); });
}

bool ModelStore::contains(const std::string& hash, Until until) const {
  const auto found = state_->guarded(until, [&]() -> Outcome<bool> {
    SQLite::Statement query(state_->database, "SELECT 1 FROM models WHERE hash = ?");
    query.bind(1, hash);
    return query.executeStep();
  });
  return !found || *found;
}

Outcome<std::vector<StoredModel>> ModelStore::list(const ModelFilter& filter, Until until) const {
  return state_->guarded(until, [&]() -> Outcome<std::vector<StoredModel>> {
    SQLite::Statement query(
        state_->database,
        "SELECT hash, content, stored_at, rig_kind FROM models "
        "WHERE (?1 = '' OR kind = ?1) AND (?2 = '' OR object = ?2) AND "
        "(?3 = '' OR EXISTS (SELECT 1 FROM tags WHERE tags.hash = models.hash AND tag = ?3)) "
        "ORDER BY sequence DESC");
    query.bind(1, filter.kind);
    query.bind(2, filter.object);
    query.bind(3, filter.tag);
    std::vector<StoredModel> models;
    while (query.executeStep()) {
      auto stored = state_->read_row(query);
      if (stored) {
        models.push_back(std::move(*stored));
      } else {
        log_warning(stored.refusal().error.text());
      }
    }
    return models;
  });
}

Outcome<StoredModel> ModelStore::tagged(const std::string& kind, const std::string& subject,
                                        const std::string& tag, Until until) const {
  return state_->guarded(until, [&]() -> Outcome<StoredModel> {
    SQLite::Statement query(
        state_->database,
        "SELECT hash FROM tags WHERE kind = ?1 AND subject = ?2 AND tag = ?3 "
        "AND (?4 = '' OR ?3 <> ?5 OR rig_kind IN ('', ?4)) ORDER BY rig_kind = ?4 DESC, rig_kind LIMIT 1");
    query.bind(1, kind);
    query.bind(2, subject);
    query.bind(3, tag);
    query.bind(4, state_->rig_kind);
    query.bind(5, kCurrentTag);
    if (query.executeStep()) return state_->read(query.getColumn(0).getString());
    return Refusal{RefusalKind::kNotFound,
                   {"no " + kind + " model has this tag", subject, tag, "", "tag one: hapticctl model tag"}};
  });
}

Outcome<std::vector<std::string>> ModelStore::tags_of(const std::string& kind, const std::string& subject,
                                                      Until until) const {
  return state_->guarded(until, [&]() -> Outcome<std::vector<std::string>> {
    SQLite::Statement query(state_->database,
                            "SELECT DISTINCT tag FROM tags WHERE kind = ?1 AND subject = ?2 "
                            "AND (?3 = '' OR tag <> ?4 OR rig_kind IN ('', ?3)) ORDER BY tag");
    query.bind(1, kind);
    query.bind(2, subject);
    query.bind(3, state_->rig_kind);
    query.bind(4, kCurrentTag);
    std::vector<std::string> tags;
    while (query.executeStep()) tags.push_back(query.getColumn(0).getString());
    return tags;
  });
}

Outcome<StoredModel> ModelStore::tag(std::string_view hash, const std::string& tag, Until until) {
  if (auto error = check_name("tag", tag, "tag")) return invalid(*error);
  return state_->guarded(until, [&]() -> Outcome<StoredModel> {
    SQLite::Transaction transaction(state_->database, SQLite::TransactionBehavior::IMMEDIATE);
    const auto whole = state_->resolve(hash);
    if (!whole) return whole.refusal();
    SQLite::Statement row(state_->database,
                          "INSERT INTO tags (kind, subject, rig_kind, tag, hash) "
                          "SELECT kind, subject, rig_kind, ?2, hash FROM models WHERE hash = ?1 "
                          "ON CONFLICT (kind, subject, rig_kind, tag) DO UPDATE SET hash = excluded.hash");
    row.bind(1, *whole);
    row.bind(2, tag);
    row.exec();
    auto stored = state_->read(*whole);
    if (!stored) return stored;
    if (auto refusal = state_->commit(transaction)) return *refusal;
    return stored;
  });
}

Outcome<StoredModel> ModelStore::untag(std::string_view hash, const std::string& tag, Until until) {
  return state_->guarded(until, [&]() -> Outcome<StoredModel> {
    SQLite::Transaction transaction(state_->database, SQLite::TransactionBehavior::IMMEDIATE);
    const auto whole = state_->resolve(hash);
    if (!whole) return whole.refusal();
    SQLite::Statement row(state_->database, "DELETE FROM tags WHERE hash = ? AND tag = ?");
    row.bind(1, *whole);
    row.bind(2, tag);
    if (row.exec() == 0) {
      const auto tags = state_->tags_of(*whole);
      return Refusal{
          RefusalKind::kNotFound,
          {"the model has no such tag", "stored model " + whole->substr(0, StoredModel::kShortHash), tag,
           comma_separated(tags), did_you_mean(tag, tags, "nothing is to be done")}};
    }
    auto stored = state_->read(*whole);
    if (!stored) return stored;
    if (auto refusal = state_->commit(transaction)) return *refusal;
    return stored;
  });
}

Outcome<std::string> ModelStore::erase(std::string_view hash,
                                       const std::function<bool(const std::string&)>& in_use, Until until) {
  return state_->guarded(until, [&]() -> Outcome<std::string> {
    SQLite::Transaction transaction(state_->database, SQLite::TransactionBehavior::IMMEDIATE);
    auto whole = state_->resolve(hash);
    if (!whole) return whole;
    if (in_use && in_use(*whole)) {
      return Refusal{RefusalKind::kFailedPrecondition,
                     {"the loaded scene works with this model", "stored model", *whole, "",
                      "load another scene or unload it, then delete the model"},
                     Reason::kInUse};
    }
    SQLite::Statement row(state_->database, "DELETE FROM models WHERE hash = ?");
    row.bind(1, *whole);
    row.exec();
    if (auto refusal = state_->commit(transaction)) return *refusal;
    return whole;
  });
}

Outcome<std::string> ModelStore::export_json(std::string_view hash, Until until) const {
  return state_->guarded(until, [&]() -> Outcome<std::string> {
    const auto stored = state_->find(hash);
    if (!stored) return stored.refusal();
    const auto canonical = canonical_json(stored->model);
    if (!canonical) return Refusal{RefusalKind::kInternal, canonical.error()};
    return server::export_json(*canonical, stored->hash);
  });
}

Outcome<StoredModel> ModelStore::import_json(std::string_view json, Until until) {
  const auto imported = server::import_json(json);
  if (!imported) return invalid(imported.error());
  return state_->guarded(until, [&]() -> Outcome<StoredModel> {
    return state_->insert(imported->model, imported->canonical, imported->hash, "");
  });
}

}  // namespace hapticd::server
