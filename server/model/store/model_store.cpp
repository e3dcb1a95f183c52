#include "server/model/store/model_store.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <sqlite3.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <mutex>
#include <thread>
#include <utility>

#include "server/model/canonical_text.h"
#include "server/model/model_json.h"
#include "server/model/store/model_store_schema.h"
#include "server/process/log.h"
#include "server/text/suggestion.h"
#include "server/text/text_library.h"

namespace hapticd::server {

namespace fs = std::filesystem;

namespace {

using Clock = std::chrono::steady_clock;

/// SQLite itself never waits for another process: it would do so under our lock.
constexpr int kBusyMs = 0;
constexpr std::chrono::seconds kOpenTimeout{5};
constexpr std::chrono::milliseconds kRetryEvery{5};
constexpr std::size_t kShortestPrefix = 6;
constexpr std::size_t kHashLength = 64;
constexpr const char* kIdentificationsKept = "1000";
constexpr const char* kMemory = ":memory:";

bool means_memory(const std::string& path) {
  return path.empty() || path == kMemory;
}

std::int64_t unix_now_s() {
  return std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

hal::Error damaged(const std::string& path, const std::string& how) {
  return {
      "the store of models is damaged", path, how, "",
      "restore it from a copy, or move it away (with its -wal and -shm) and import what was exported; it was "
      "not changed"};
}

bool is_busy(const SQLite::Exception& failure) {
  const int code = failure.getErrorCode() & 0xFF;
  return code == SQLITE_BUSY || code == SQLITE_LOCKED;
}

Refusal disk_full(const std::string& where) {
  return {RefusalKind::kResourceExhausted,
          {"the disk is full: nothing was stored", where, "", "", "make room, then try again"},
          Reason::kDiskFull};
}

Refusal moved_away(const std::string& path) {
  return {RefusalKind::kFailedPrecondition,
          {"the store of models was moved or deleted while hapticd runs: nothing was stored", path, "", "",
           "export the models that are needed, put the file back or leave it away, and start hapticd again"},
          Reason::kStoreLost};
}

/// SQLite's error as a refusal. `system_error`: errno of the call that failed.
Refusal refusal_of(const SQLite::Exception& failure, const std::string& path, int system_error) {
  const std::string where = path.empty() ? "store of models in memory" : path;
  if (failure.getExtendedErrorCode() == SQLITE_READONLY_DBMOVED) return moved_away(where);
  // When there is no space for its shared memory, SQLite reports an input/output error.
  if ((failure.getErrorCode() & 0xFF) == SQLITE_IOERR && system_error == ENOSPC) return disk_full(where);
  switch (failure.getErrorCode() & 0xFF) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return {RefusalKind::kUnavailable,
              {"another process keeps the store of models locked", where, "", "", "try again"},
              Reason::kBusy};
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return {RefusalKind::kInternal, damaged(where, failure.what())};
    case SQLITE_FULL:
      return disk_full(where);
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
      return {RefusalKind::kInternal,
              {"the store of models cannot be written", where, failure.what(), "",
               "check that its folder exists and that file and folder may be written to"}};
    default:
      return {RefusalKind::kInternal,
              {"the store of models fails", where, failure.what(), "", "check the disk"}};
  }
}

Refusal invalid(hal::Error error) {
  return {RefusalKind::kInvalidArgument, std::move(error)};
}

/// In lower case; an error where it is not the beginning of a hash.
hal::Result<std::string> as_prefix(std::string_view hash) {
  std::string prefix(hash);
  std::transform(prefix.begin(), prefix.end(), prefix.begin(),
                 [](char c) { return c >= 'A' && c <= 'F' ? static_cast<char>(c - 'A' + 'a') : c; });
  const bool digits = std::all_of(prefix.begin(), prefix.end(),
                                  [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
  if (digits && prefix.size() >= kShortestPrefix && prefix.size() <= kHashLength) return prefix;
  return hal::Error{"not the hash of a model", "hash", std::string(hash.substr(0, kHashLength)),
                    "6 … 64 hexadecimal digits", "see which there are: hapticctl model list --stored"};
}

bool is_device_bound_to_sensor(const rt::IdentifiedModel& model) {
  return !std::holds_alternative<rt::StructuralModel>(model.content);
}

}  // namespace

std::string subject_of(const rt::IdentifiedModel& model) {
  if (std::holds_alternative<rt::ContactModel>(model.content)) return model.object;
  if (const auto* friction = std::get_if<rt::FrictionModel>(&model.content)) {
    return model.object + (friction->tip == rt::Tip::kRod ? "/rod" : "/ball_bearing");
  }
  return is_device_bound_to_sensor(model) ? model.device + "/" + model.sensor : model.device;
}

struct ModelStore::State {
  State(const std::string& file, std::string kind_of_rig)
      : path(means_memory(file) ? std::string() : file),
        rig_kind(std::move(kind_of_rig)),
        database(path.empty() ? kMemory : path.c_str(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE,
                 kBusyMs) {}

  /// Reads before it writes: a file that is refused is not changed. Throws SQLite::Exception.
  std::optional<hal::Error> set_up() {
    sqlite3_db_config(database.getHandle(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
    if (auto error = store_schema::check(database, path)) return error;
    if (const std::string found = database.execAndGet("PRAGMA quick_check(1)").getString(); found != "ok") {
      return damaged(path, found);
    }
    sqlite3_db_config(database.getHandle(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 0, nullptr);
    if (!path.empty()) {
      database.exec("PRAGMA journal_mode = WAL");
      database.exec("PRAGMA synchronous = FULL");  // acknowledged changes survive a power cut, too
    }
    database.exec("PRAGMA foreign_keys = ON; PRAGMA trusted_schema = OFF");
    return store_schema::migrate(database, path);
  }

  /// Runs one call, alone in this process; an exception of SQLite becomes a refusal. While another process
  /// keeps the file locked it is tried again until `until`; other calls run in between.
  template <class Call>
  auto guarded(Clock::time_point until, Call call) -> decltype(call()) {
    for (;;) {
      {
        const std::lock_guard lock(mutex);
        try {
          return call();
        } catch (const SQLite::Exception& failure) {
          // If the file was moved SQLite fails in many ways.
          if (was_moved()) return moved_away(path);
          if (!is_busy(failure) || Clock::now() >= until) {
            return refusal_of(failure, path, sqlite3_system_errno(database.getHandle()));
          }
        }
      }
      std::this_thread::sleep_for(kRetryEvery);
    }
  }

  /// Whether the file that is open is still the one at its path: what is written into another is lost with
  /// this process, without a report.
  bool was_moved() {
    int moved = 0;
    if (path.empty()) return false;
    sqlite3_file_control(database.getHandle(), "main", SQLITE_FCNTL_HAS_MOVED, &moved);
    return moved != 0;
  }
  /// Every change ends with this.
  std::optional<Refusal> commit(SQLite::Transaction& transaction) {
    if (was_moved()) return moved_away(path);  // rolled back by its owner
    transaction.commit();
    return std::nullopt;
  }

  /// The whole hash with this beginning.
  Outcome<std::string> resolve(std::string_view hash) {
    const auto prefix = as_prefix(hash);
    if (!prefix) return invalid(prefix.error());
    // Hashes are digits and letters below 'g', so this is the range of hashes with this beginning.
    SQLite::Statement query(
        database, "SELECT hash FROM models WHERE hash >= ?1 AND hash < ?1 || 'g' ORDER BY hash LIMIT 5");
    query.bind(1, *prefix);
    std::vector<std::string> found;
    while (query.executeStep()) found.push_back(query.getColumn(0).getString());
    if (found.size() == 1) return found.front();
    if (found.empty()) {
      return Refusal{RefusalKind::kNotFound,
                     {"no such model is stored", "hash", *prefix, "",
                      "see which there are: hapticctl model list --stored"}};
    }
    return invalid({"the beginning of the hash is ambiguous", "hash", *prefix, comma_separated(found),
                    "give more of its digits"});
  }

  std::vector<std::string> tags_of(const std::string& hash) {
    SQLite::Statement query(database, "SELECT tag FROM tags WHERE hash = ? ORDER BY tag");
    query.bind(1, hash);
    std::vector<std::string> tags;
    while (query.executeStep()) tags.push_back(query.getColumn(0).getString());
    return tags;
  }

  /// One row of hash, content, stored_at, rig_kind.
  Outcome<StoredModel> read_row(SQLite::Statement& query) {
    StoredModel stored;
    stored.hash = query.getColumn(0).getString();
    auto model = parse_canonical_json(query.getColumn(1).getString(), stored.hash,
                                      "stored model " + stored.short_hash());
    if (!model) return Refusal{RefusalKind::kInternal, model.error()};
    stored.model = std::move(*model);
    stored.stored_at_unix_s = query.getColumn(2).getInt64();
    stored.rig_kind = query.getColumn(3).getString();
    stored.tags = tags_of(stored.hash);
    return stored;
  }

  /// By its whole hash, which exists.
  Outcome<StoredModel> read(const std::string& hash) {
    SQLite::Statement query(database, "SELECT hash, content, stored_at, rig_kind FROM models WHERE hash = ?");
    query.bind(1, hash);
    query.executeStep();
    return read_row(query);
  }

  Outcome<StoredModel> find(std::string_view hash) {
    const auto whole = resolve(hash);
    if (!whole) return whole.refusal();
    return read(*whole);
  }

  Outcome<StoredModel> insert(const rt::IdentifiedModel& model, const std::string& canonical,
                              const std::string& hash, const std::string& identified_on) {
    SQLite::Transaction transaction(database, SQLite::TransactionBehavior::IMMEDIATE);
    SQLite::Statement row(database,
                          "INSERT INTO models (hash, kind, subject, object, content, stored_at, rig_kind) "
                          "VALUES (?, ?, ?, ?, ?, ?, ?) ON CONFLICT (hash) DO NOTHING");
    row.bind(1, hash);
    row.bind(2, rt::kind_name(model.content));
    row.bind(3, subject_of(model));
    row.bind(4, model.object);
    row.bind(5, canonical);
    row.bind(6, unix_now_s());
    row.bind(7, identified_on);
    row.exec();
    auto stored = read(hash);
    if (!stored) return stored;  // rolled back
    if (auto refusal = commit(transaction)) return *refusal;
    return stored;
  }

  std::string path;      ///< empty = in memory
  std::string rig_kind;  ///< of the served rig; empty = any
  mutable std::mutex mutex;
  SQLite::Database database;
};

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

Outcome<std::uint64_t> ModelStore::record_identification(const EndedIdentification& ended, Until until) {
  return state_->guarded(until, [&]() -> Outcome<std::uint64_t> {
    SQLite::Transaction transaction(state_->database, SQLite::TransactionBehavior::IMMEDIATE);
    SQLite::Statement row(state_->database,
                          "INSERT INTO identifications "
                          "(id, kind, object, state, ended_at, model, problem, progress) "
                          "VALUES (?, ?, ?, ?, ?, ?, ?, ?)");
    row.bind(1, ended.id);
    row.bind(2, ended.kind);
    row.bind(3, ended.object);
    row.bind(4, ended.state);
    row.bind(5, ended.ended_at_unix_s);
    row.bind(6, ended.model_hash);
    row.bind(7, ended.problem);
    row.bind(8, static_cast<const void*>(ended.progress.data()), static_cast<int>(ended.progress.size()));
    row.exec();
    const auto sequence = static_cast<std::uint64_t>(state_->database.getLastInsertRowid());
    state_->database.exec(std::string("DELETE FROM identifications WHERE sequence <= "
                                      "(SELECT max(sequence) FROM identifications) - ") +
                          kIdentificationsKept);
    if (auto refusal = state_->commit(transaction)) return *refusal;
    return sequence;
  });
}

Outcome<std::vector<EndedIdentification>> ModelStore::list_identifications(std::size_t limit,
                                                                           Until until) const {
  return state_->guarded(until, [&]() -> Outcome<std::vector<EndedIdentification>> {
    SQLite::Statement query(state_->database,
                            "SELECT id, kind, object, state, ended_at, model, problem, progress "
                            "FROM identifications ORDER BY sequence DESC LIMIT ?");
    query.bind(1, static_cast<std::int64_t>(std::min<std::size_t>(limit, 1'000'000)));
    std::vector<EndedIdentification> all;
    while (query.executeStep()) {
      EndedIdentification& ended = all.emplace_back();
      ended.id = query.getColumn(0).getString();
      ended.kind = query.getColumn(1).getString();
      ended.object = query.getColumn(2).getString();
      ended.state = query.getColumn(3).getString();
      ended.ended_at_unix_s = query.getColumn(4).getInt64();
      ended.model_hash = query.getColumn(5).getString();
      ended.problem = query.getColumn(6).getString();
      const SQLite::Column progress = query.getColumn(7);
      if (progress.getBytes() > 0) ended.progress = progress.getString();
    }
    return all;
  });
}

}  // namespace hapticd::server
