#include "server/model/store/model_store_state.h"

#include <algorithm>
#include <cerrno>

#include "server/model/canonical_text.h"
#include "server/model/model_json.h"
#include "server/model/store/model_store_schema.h"
#include "server/text/suggestion.h"
#include "server/text/text_library.h"

namespace hapticd::server {

namespace {

/// SQLite itself never waits for another process: it would do so under our lock.
constexpr int kBusyMs = 0;
constexpr std::size_t kMinPrefix = 6;
constexpr std::size_t kHashLength = 64;
constexpr const char* kMemory = ":memory:";

std::int64_t unix_now_s() {
  return std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

hal::Error damaged(const std::string& path, const std::string& how) {
  return hal::Error::of(
      hal::ErrorCode::kDamaged, "the store of models is damaged", path, how, "",
      "restore it from a copy, or move it away (with its -wal and -shm) and import what was exported; it was "
      "not changed");
}

Refusal disk_full(const std::string& where) {
  return {RefusalKind::kResourceExhausted,
          hal::Error::of(hal::ErrorCode::kFull, "the disk is full: nothing was stored", where, "", "",
                         "make room, then try again"),
          Reason::kDiskFull};
}

/// Beginning of a hash in lower case; an error if it is not one.
hal::Result<std::string> as_prefix(std::string_view hash) {
  std::string prefix(hash);
  std::transform(prefix.begin(), prefix.end(), prefix.begin(),
                 [](char c) { return c >= 'A' && c <= 'F' ? static_cast<char>(c - 'A' + 'a') : c; });
  const bool digits = std::all_of(prefix.begin(), prefix.end(),
                                  [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
  if (digits && prefix.size() >= kMinPrefix && prefix.size() <= kHashLength) return prefix;
  return hal::Error{"not the hash of a model", "hash", std::string(hash.substr(0, kHashLength)),
                    "6 … 64 hexadecimal digits", "see which there are: hapticctl model list --stored"};
}

}  // namespace

bool means_memory(const std::string& path) {
  return path.empty() || path == kMemory;
}

bool is_busy(const SQLite::Exception& failure) {
  const int code = failure.getErrorCode() & 0xFF;
  return code == SQLITE_BUSY || code == SQLITE_LOCKED;
}

Refusal moved_away(const std::string& path) {
  return {RefusalKind::kFailedPrecondition,
          {"the store of models was moved or deleted while hapticd runs: nothing was stored", path, "", "",
           "export the models that are needed, put the file back or leave it away, and start hapticd again"},
          Reason::kStoreLost};
}

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

ModelStore::State::State(const std::string& file, std::string kind_of_rig)
    : path(means_memory(file) ? std::string() : file),
      rig_kind(std::move(kind_of_rig)),
      database(path.empty() ? kMemory : path.c_str(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE, kBusyMs) {
}

std::optional<hal::Error> ModelStore::State::set_up() {
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

bool ModelStore::State::was_moved() {
  int moved = 0;
  if (path.empty()) return false;
  sqlite3_file_control(database.getHandle(), "main", SQLITE_FCNTL_HAS_MOVED, &moved);
  return moved != 0;
}

Outcome<std::string> ModelStore::State::resolve(std::string_view hash) {
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

std::vector<std::string> ModelStore::State::tags_of(const std::string& hash) {
  SQLite::Statement query(database, "SELECT tag FROM tags WHERE hash = ? ORDER BY tag");
  query.bind(1, hash);
  std::vector<std::string> tags;
  while (query.executeStep()) tags.push_back(query.getColumn(0).getString());
  return tags;
}

Outcome<StoredModel> ModelStore::State::read_row(SQLite::Statement& query) {
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

Outcome<StoredModel> ModelStore::State::read(const std::string& hash) {
  SQLite::Statement query(database, "SELECT hash, content, stored_at, rig_kind FROM models WHERE hash = ?");
  query.bind(1, hash);
  query.executeStep();
  return read_row(query);
}

Outcome<StoredModel> ModelStore::State::insert(const rt::IdentifiedModel& model, const std::string& canonical,
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

}  // namespace hapticd::server
